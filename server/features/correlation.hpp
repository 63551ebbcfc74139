#pragma once

#include <cstddef>
#include <cstdint>

#include "server/features/patch.hpp"

namespace saccade {

/// Normalised cross-correlation (ZNCC) of one template with many places of a picture.
///
/// The sums are exact integers; a place costs about 20 ns with an 11 x 11 template (AVX2).
class CorrelationScorer {
 public:
  /// Bytes that must be readable to the right of the last candidate's first column.
  static constexpr int kReadAhead = 16;

  /// `templ` must outlive the scorer. Places whose standard deviation is below `min_deviation`
  /// [grey levels] score -1: too flat to tell.
  CorrelationScorer(const CorrelationTemplate& templ, double min_deviation);

  /// Scores `count` places side by side: out[x] is for the template's top-left pixel at pixels + x.
  /// Rows are `stride` bytes apart.
  void Row(const std::uint8_t* pixels, std::ptrdiff_t stride, int count, float* out) const;

 private:
  template <int kSize>
  void RowOf(const std::uint8_t* pixels, std::ptrdiff_t stride, int count, float* out) const;

  const CorrelationTemplate& templ_;
  float root_;   // standard deviation of the template times its pixel count
  float least_;  // of count * sum of squares - sum^2
};

}  // namespace saccade
