#pragma once

#include <nlohmann/json.hpp>
#include <vector>

namespace saccade {

/// Sums NEES and NIS by step over Monte-Carlo runs and holds them against their 95 % bands.
/// Source: Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to Tracking and Navigation",
/// 2001, section 5.4.
class ConsistencyTally {
 public:
  explicit ConsistencyTally(std::size_t steps) : steps_(steps) {}

  /// `nees` of the 6-D pose; `nis` of `matches` two-dimensional matches together.
  void Add(std::size_t step, double nees, double nis, int matches);

  double MeanNees(std::size_t step) const;
  double MeanNis(std::size_t step) const;  // per match

  /// nees_mean, nees_band_95, nees_steps_in_band_fraction, nees_steps_below_band_fraction,
  /// nees_steps_above_band_fraction, nis_per_match_mean, nis_steps_in_band_fraction.
  nlohmann::ordered_json Report() const;

 private:
  struct Step {
    double nees = 0, nis = 0;
    int runs = 0, matches = 0;
  };
  std::vector<Step> steps_;
};

}  // namespace saccade
