#pragma once

#include <vector>

namespace saccade {

/// Collects numbers and tells their mean and percentiles.
class Sample {
 public:
  void Add(double value) { values_.push_back(value); }
  void Add(const Sample& other) {
    values_.insert(values_.end(), other.values_.begin(), other.values_.end());
  }
  std::size_t size() const { return values_.size(); }
  const std::vector<double>& values() const { return values_; }
  double Mean() const;
  double Max() const;
  /// Smallest value that at least `percent` of all do not exceed (nearest rank); 0 if empty.
  double Percentile(double percent) const;

 private:
  std::vector<double> values_;
};

/// 95 % band of a chi-square mean: of the sum of `count` independent values with `dimension`
/// degrees of freedom each, divided by `count`. By Wilson and Hilferty's cube root; exact to 0.3 %
/// from 10 degrees of freedom in total on.
struct Band {
  double low = 0, high = 0;
};
Band ChiSquareMeanBand(int dimension, int count);

}  // namespace saccade
