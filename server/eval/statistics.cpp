#include "server/eval/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace saccade {

double Sample::Mean() const {
  if (values_.empty()) return 0.0;
  return std::accumulate(values_.begin(), values_.end(), 0.0) / static_cast<double>(values_.size());
}

double Sample::Max() const {
  return values_.empty() ? 0.0 : *std::max_element(values_.begin(), values_.end());
}

double Sample::Percentile(double percent) const {
  if (values_.empty()) return 0.0;
  std::vector<double> sorted = values_;
  const auto count = static_cast<double>(sorted.size());
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(percent / 100.0 * count)) - 1;
  const auto at = sorted.begin() + std::clamp<std::ptrdiff_t>(rank, 0, std::ssize(sorted) - 1);
  std::nth_element(sorted.begin(), at, sorted.end());
  return *at;
}

Band ChiSquareMeanBand(int dimension, int count) {
  const double n = static_cast<double>(dimension) * count;
  const auto quantile = [&](double z) {
    const double root = 1.0 - 2.0 / (9.0 * n) + z * std::sqrt(2.0 / (9.0 * n));
    return n * root * root * root / count;
  };
  return {quantile(-1.959964), quantile(1.959964)};
}

}  // namespace saccade
