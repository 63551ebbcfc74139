#include "server/features/correlation.hpp"

#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include <array>
#include <cmath>

namespace saccade {
namespace {

struct Sums {
  int cross = 0;    // template * picture
  int sum = 0;      // picture
  int squared = 0;  // picture^2
};

#if defined(__AVX2__)

int HorizontalSum(__m256i v) {
  const __m128i quarter = _mm_add_epi32(_mm256_castsi256_si128(v), _mm256_extracti128_si256(v, 1));
  const __m128i eighth = _mm_add_epi32(quarter, _mm_shuffle_epi32(quarter, 0x4E));
  return _mm_cvtsi128_si32(_mm_add_epi32(eighth, _mm_shuffle_epi32(eighth, 0xB1)));
}

template <int kSize>
constexpr std::array<std::int16_t, 16> MaskOf() {
  std::array<std::int16_t, 16> mask{};
  for (int k = 0; k < kSize; ++k) mask[k] = -1;
  return mask;
}

/// Sums over kSize x kSize pixels from `pixels` on. 16 bytes a row must be readable.
template <int kSize>
Sums Correlate(const std::uint8_t* pixels, std::ptrdiff_t stride, const std::int16_t* templ) {
  alignas(32) static constexpr std::array<std::int16_t, 16> kMask = MaskOf<kSize>();
  const __m256i mask = _mm256_load_si256(reinterpret_cast<const __m256i*>(kMask.data()));
  __m256i cross = _mm256_setzero_si256();
  __m256i sum = _mm256_setzero_si256();
  __m256i squared = _mm256_setzero_si256();
  for (int row = 0; row < kSize; ++row) {
    const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(pixels + row * stride));
    const __m256i seen = _mm256_and_si256(mask, _mm256_cvtepu8_epi16(bytes));
    const __m256i expected = _mm256_loadu_si256(
        reinterpret_cast<const __m256i*>(templ + row * CorrelationTemplate::kStride));
    cross = _mm256_add_epi32(cross, _mm256_madd_epi16(seen, expected));
    squared = _mm256_add_epi32(squared, _mm256_madd_epi16(seen, seen));
    sum = _mm256_add_epi16(sum, seen);  // at most 15 * 255
  }
  const __m256i wide = _mm256_madd_epi16(sum, _mm256_set1_epi16(1));
  return {HorizontalSum(cross), HorizontalSum(wide), HorizontalSum(squared)};
}

#else  // arm64, and x86-64 before v3: whole numbers, so the same sums

template <int kSize>
Sums Correlate(const std::uint8_t* pixels, std::ptrdiff_t stride, const std::int16_t* templ) {
  Sums sums;
  for (int row = 0; row < kSize; ++row) {
    const std::uint8_t* seen = pixels + row * stride;
    const std::int16_t* expected = templ + row * CorrelationTemplate::kStride;
    for (int k = 0; k < kSize; ++k) {
      sums.cross += seen[k] * expected[k];
      sums.sum += seen[k];
      sums.squared += seen[k] * seen[k];
    }
  }
  return sums;
}

#endif

}  // namespace

CorrelationScorer::CorrelationScorer(const CorrelationTemplate& templ, double min_deviation)
    : templ_(templ) {
  const double count = templ.size * templ.size;
  root_ = static_cast<float>(templ.Deviation() * count);
  least_ = static_cast<float>(min_deviation * min_deviation * count * count);
}

template <int kSize>
void CorrelationScorer::RowOf(const std::uint8_t* pixels, std::ptrdiff_t stride, int count,
                              float* out) const {
  constexpr std::int64_t kCount = kSize * kSize;
  for (int x = 0; x < count; ++x) {
    const Sums s = Correlate<kSize>(pixels + x, stride, templ_.pixels.data());
    // Integers: the difference of large products would lose its digits in float.
    const auto spread = static_cast<float>(kCount * s.squared - std::int64_t{s.sum} * s.sum);
    const auto common = static_cast<float>(kCount * s.cross - std::int64_t{templ_.sum} * s.sum);
    out[x] = spread >= least_ && spread > 0.0F && root_ > 0.0F
                 ? common / (root_ * std::sqrt(spread))
                 : -1.0F;
  }
}

void CorrelationScorer::Row(const std::uint8_t* pixels, std::ptrdiff_t stride, int count,
                            float* out) const {
  switch (templ_.size) {
    case 7:
      return RowOf<7>(pixels, stride, count, out);
    case 9:
      return RowOf<9>(pixels, stride, count, out);
    case 11:
      return RowOf<11>(pixels, stride, count, out);
    case 13:
      return RowOf<13>(pixels, stride, count, out);
    default:
      return RowOf<15>(pixels, stride, count, out);
  }
}

}  // namespace saccade
