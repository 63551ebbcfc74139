#include "server/eval/consistency.hpp"

#include <algorithm>

#include "server/eval/statistics.hpp"

namespace saccade {

void ConsistencyTally::Add(std::size_t step, double nees, double nis, int matches) {
  Step& at = steps_[step];
  at.nees += nees;
  at.nis += nis;
  at.matches += matches;
  ++at.runs;
}

double ConsistencyTally::MeanNees(std::size_t step) const {
  return steps_[step].nees / std::max(steps_[step].runs, 1);
}

double ConsistencyTally::MeanNis(std::size_t step) const {
  return steps_[step].nis / std::max(steps_[step].matches, 1);
}

nlohmann::ordered_json ConsistencyTally::Report() const {
  double nees = 0, nis = 0;
  std::int64_t matches = 0, samples = 0;
  int runs = 0, below = 0, above = 0, nis_in = 0, nis_steps = 0;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const Step& step = steps_[i];
    nees += step.nees;
    nis += step.nis;
    matches += step.matches;
    samples += step.runs;
    runs = std::max(runs, step.runs);
    const Band band = ChiSquareMeanBand(6, std::max(step.runs, 1));
    below += MeanNees(i) < band.low ? 1 : 0;
    above += MeanNees(i) > band.high ? 1 : 0;
    if (step.matches == 0) continue;
    const Band nis_band = ChiSquareMeanBand(2, step.matches);
    nis_in += MeanNis(i) >= nis_band.low && MeanNis(i) <= nis_band.high ? 1 : 0;
    ++nis_steps;
  }
  const Band band = ChiSquareMeanBand(6, std::max(runs, 1));
  const auto count = static_cast<double>(std::max<std::size_t>(steps_.size(), 1));
  return {{"nees_mean", nees / static_cast<double>(std::max<std::int64_t>(samples, 1))},
          {"nees_band_95", {band.low, band.high}},
          {"nees_steps_in_band_fraction", (count - below - above) / count},
          {"nees_steps_below_band_fraction", below / count},
          {"nees_steps_above_band_fraction", above / count},
          {"nis_per_match_mean", nis / static_cast<double>(std::max<std::int64_t>(matches, 1))},
          {"nis_steps_in_band_fraction", nis_in / static_cast<double>(std::max(nis_steps, 1))}};
}

}  // namespace saccade
