#include "server/features/corner_detector.hpp"

#if defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>
#endif

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace saccade {
namespace {

/// out[x] = in[x] + ... + in[x + kWindow - 1].
template <int kWindow>
void SlidingSum(const int* __restrict in, int count, int* __restrict out) {
  for (int x = 0; x < count; ++x) {
    int sum = 0;
    for (int k = 0; k < kWindow; ++k) sum += in[x + k];
    out[x] = sum;
  }
}

void SlidingSum(const int* in, int count, int window, int* out) {
  switch (window) {
    case 5:
      return SlidingSum<5>(in, count, out);
    case 7:
      return SlidingSum<7>(in, count, out);
    case 9:
      return SlidingSum<9>(in, count, out);
    case 11:
      return SlidingSum<11>(in, count, out);
    case 13:
      return SlidingSum<13>(in, count, out);
    default:
      return SlidingSum<15>(in, count, out);
  }
}

/// Gradient products of one row, without the halves of the central difference.
void GradientProducts(const std::uint8_t* __restrict above, const std::uint8_t* __restrict row,
                      const std::uint8_t* __restrict below, int count, int* __restrict xx,
                      int* __restrict xy, int* __restrict yy) {
  for (int x = 0; x < count; ++x) {
    const int gx = static_cast<int>(row[x + 1]) - static_cast<int>(row[x - 1]);
    const int gy = static_cast<int>(below[x]) - static_cast<int>(above[x]);
    xx[x] = gx * gx;
    xy[x] = gx * gy;
    yy[x] = gy * gy;
  }
}

/// sums += fresh - stale; stale is the row that leaves the window.
void Slide(const int* __restrict fresh, const int* __restrict stale, int count,
           int* __restrict sums) {
  for (int x = 0; x < count; ++x) sums[x] += fresh[x] - stale[x];
}

void MinEigenvalues(const int* xx, const int* xy, const int* yy, int count, float* out) {
  int x = 0;
#if defined(__AVX2__) && defined(__FMA__)
  const __m256 half = _mm256_set1_ps(0.5F);
  for (; x + 8 <= count; x += 8) {
    const auto load = [x](const int* p) {
      return _mm256_cvtepi32_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p + x)));
    };
    const __m256 a = load(xx);
    const __m256 b = load(xy);
    const __m256 c = load(yy);
    const __m256 mean = _mm256_mul_ps(half, _mm256_add_ps(a, c));
    const __m256 difference = _mm256_mul_ps(half, _mm256_sub_ps(a, c));
    const __m256 root =
        _mm256_sqrt_ps(_mm256_fmadd_ps(difference, difference, _mm256_mul_ps(b, b)));
    _mm256_storeu_ps(out + x, _mm256_sub_ps(mean, root));
  }
#endif
  for (; x < count; ++x) {
    const float a = static_cast<float>(xx[x]);
    const float b = static_cast<float>(xy[x]);
    const float c = static_cast<float>(yy[x]);
    out[x] = 0.5F * (a + c) - std::sqrt(0.25F * (a - c) * (a - c) + b * b);
  }
}

/// Offset of a parabola's peak from its middle sample, within half a pixel.
double PeakOffset(double left, double middle, double right) {
  const double curvature = left - 2.0 * middle + right;
  if (curvature >= -1e-9) return 0.0;
  return std::clamp(0.5 * (left - right) / curvature, -0.5, 0.5);
}

}  // namespace

absl::Status CornerOptions::Validate() const {
  if (window_px < 9 || window_px > 15 || window_px % 2 == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("features.corner.window_px: ", window_px, "; give 9, 11, 13 or 15"));
  }
  if (level < 0 || level > 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("features.corner.level: ", level, "; give 0 (full) or 1 (half resolution)"));
  }
  if (border_px < window_px || cell_px < 8 || band_cells < 1 || !(min_distance_px >= 0.0) ||
      !(min_score > 0.0)) {
    return absl::InvalidArgumentError(
        "features.corner: border_px must be at least window_px, cell_px at least 8, band_cells at "
        "least 1, min_distance_px not negative and min_score above 0");
  }
  return absl::OkStatus();
}

CornerDetector::CornerDetector(const CornerOptions& options) : options_(options) {}

void CornerDetector::Score(const cv::Mat& image, const cv::Rect& area, int window) {
  const int half = window / 2;
  const int width = area.width + 2 * half;
  score_.create(area.height, area.width, CV_32FC1);
  // A ring of `window` rows of the three products, then the three column sums, then row sums.
  products_.assign(static_cast<std::size_t>(3) * width * (window + 1), 0);
  column_sums_.assign(static_cast<std::size_t>(6) * width, 0);
  int* const fresh = products_.data() + static_cast<std::size_t>(3) * width * window;
  int* const columns = column_sums_.data();
  int* const sums = columns + 3 * static_cast<std::ptrdiff_t>(width);
  const int first = area.y - half;
  for (int y = first; y < area.y + area.height + half; ++y) {
    const int left = area.x - half;
    GradientProducts(image.ptr<std::uint8_t>(y - 1) + left, image.ptr<std::uint8_t>(y) + left,
                     image.ptr<std::uint8_t>(y + 1) + left, width, fresh, fresh + width,
                     fresh + 2 * width);
    int* const slot =
        products_.data() + static_cast<std::size_t>(3) * width * ((y - first) % window);
    Slide(fresh, slot, 3 * width, columns);
    std::memcpy(slot, fresh, sizeof(int) * 3 * static_cast<std::size_t>(width));
    const int row = y - half - area.y;
    if (row < 0) continue;
    for (int k = 0; k < 3; ++k) {
      SlidingSum(columns + k * width, area.width, window, sums + k * width);
    }
    MinEigenvalues(sums, sums + width, sums + 2 * width, area.width, score_.ptr<float>(row));
  }
}

void CornerDetector::BlankOccupied(const cv::Rect& area,
                                   std::span<const Eigen::Vector2d> occupied) {
  const double reach = options_.min_distance_px / (1 << options_.level);
  for (const Eigen::Vector2d& pixel : occupied) {
    if (!pixel.allFinite()) continue;
    const Eigen::Vector2d at =
        ImagePyramid::ToLevel(pixel, options_.level) - Eigen::Vector2d(area.x, area.y);
    if (at.x() < -reach || at.y() < -reach || at.x() > area.width + reach ||
        at.y() > area.height + reach) {
      continue;
    }
    const int last = std::min(area.height - 1, static_cast<int>(at.y() + reach));
    for (int y = std::max(0, static_cast<int>(std::ceil(at.y() - reach))); y <= last; ++y) {
      const double wide = std::sqrt(std::max(0.0, reach * reach - (y - at.y()) * (y - at.y())));
      const int from = std::max(0, static_cast<int>(std::ceil(at.x() - wide)));
      const int to = std::min(area.width - 1, static_cast<int>(std::floor(at.x() + wide)));
      if (to >= from) std::fill(score_.ptr<float>(y) + from, score_.ptr<float>(y) + to + 1, 0.0F);
    }
  }
}

void CornerDetector::BestOfCells(const cv::Rect& area, double to_spec,
                                 std::span<const Eigen::Vector2d> occupied) {
  BlankOccupied(area, occupied);
  candidates_.clear();
  const int cell = std::max(1, options_.cell_px / (1 << options_.level));
  const float least = static_cast<float>(options_.min_score / to_spec);
  // Cells are anchored to the picture, not to the area, so that bands and whole pictures agree.
  for (int top = area.y / cell * cell; top < area.y + area.height; top += cell) {
    for (int left = area.x / cell * cell; left < area.x + area.width; left += cell) {
      const cv::Rect box = cv::Rect(left, top, cell, cell) & area;
      const cv::Mat scores = score_(box - area.tl());
      float best = least;
      cv::Point peak(-1, -1);
      for (int y = 0; y < scores.rows; ++y) {
        const float* row = scores.ptr<float>(y);
        const float* highest = std::max_element(row, row + scores.cols);
        if (*highest <= best) continue;
        best = *highest;
        peak = {static_cast<int>(highest - row) + box.x - area.x, y + box.y - area.y};
      }
      if (peak.x < 0) continue;
      Eigen::Vector2d at(peak.x + area.x, peak.y + area.y);
      if (peak.x > 0 && peak.y > 0 && peak.x < area.width - 1 && peak.y < area.height - 1) {
        const auto s = [&](int x, int y) { return score_.at<float>(peak.y + y, peak.x + x); };
        at.x() += PeakOffset(s(-1, 0), s(0, 0), s(1, 0));
        at.y() += PeakOffset(s(0, -1), s(0, 0), s(0, 1));
      }
      candidates_.push_back({ImagePyramid::FromLevel(at, options_.level), best * to_spec});
    }
  }
}

void CornerDetector::Detect(const ImagePyramid& pyramid, cv::Rect region,
                            std::span<const Eigen::Vector2d> occupied, int max_corners,
                            std::vector<Corner>& corners) {
  corners.clear();
  if (pyramid.empty() || max_corners <= 0) return;
  const int border = options_.border_px;
  region &= cv::Rect(border, border, pyramid.width() - 2 * border, pyramid.height() - 2 * border);
  const int step = 1 << options_.level;
  const cv::Mat& image = pyramid.level(options_.level);
  const int window = options_.level == 0 ? options_.window_px : (options_.window_px / step) | 1;
  const int margin = window / 2 + 1;
  const cv::Rect area =
      cv::Rect(region.x / step, region.y / step, region.width / step, region.height / step) &
      cv::Rect(margin, margin, image.cols - 2 * margin, image.rows - 2 * margin);
  if (area.width < 1 || area.height < 1) return;
  Score(image, area, window);
  // Gradients are twice the central difference, and per pixel of this level.
  const double to_spec = 121.0 / (window * window) * 0.25 / (step * step);
  BestOfCells(area, to_spec, occupied);
  std::sort(candidates_.begin(), candidates_.end(), [](const Corner& a, const Corner& b) {
    if (a.score != b.score) return a.score > b.score;
    return a.pixel.y() != b.pixel.y() ? a.pixel.y() < b.pixel.y() : a.pixel.x() < b.pixel.x();
  });
  const double apart = options_.min_distance_px * options_.min_distance_px;
  for (const Corner& candidate : candidates_) {
    if (static_cast<int>(corners.size()) >= max_corners) break;
    const bool free = std::none_of(corners.begin(), corners.end(), [&](const Corner& other) {
      return (other.pixel - candidate.pixel).squaredNorm() < apart;
    });
    if (free) corners.push_back(candidate);
  }
}

void CornerDetector::DetectAll(const ImagePyramid& pyramid,
                               std::span<const Eigen::Vector2d> occupied, int max_corners,
                               std::vector<Corner>& corners) {
  Detect(pyramid, cv::Rect(0, 0, pyramid.width(), pyramid.height()), occupied, max_corners,
         corners);
}

cv::Rect CornerDetector::Band(const ImagePyramid& pyramid, int index) const {
  const int height = options_.band_cells * options_.cell_px;
  return cv::Rect(0, index * height, pyramid.width(), height) &
         cv::Rect(0, 0, pyramid.width(), pyramid.height());
}

int CornerDetector::Bands(const ImagePyramid& pyramid) const {
  const int height = options_.band_cells * options_.cell_px;
  return std::max(1, (pyramid.height() + height - 1) / height);
}

cv::Rect CornerDetector::DetectNextBand(const ImagePyramid& pyramid,
                                        std::span<const Eigen::Vector2d> occupied, int max_corners,
                                        std::vector<Corner>& corners) {
  next_band_ %= Bands(pyramid);
  const cv::Rect band = Band(pyramid, next_band_++);
  Detect(pyramid, band, occupied, max_corners, corners);
  return band;
}

cv::Rect CornerDetector::DetectEmptiestBand(const ImagePyramid& pyramid,
                                            std::span<const Eigen::Vector2d> occupied,
                                            int max_corners, std::vector<Corner>& corners) {
  const int bands = Bands(pyramid);
  if (static_cast<int>(band_used_.size()) != bands) band_used_.assign(bands, -bands);
  ++calls_;
  int best = -1;
  double best_density = 0.0;
  const int border = options_.border_px;
  for (int k = 0; k < bands; ++k) {
    if (calls_ - band_used_[k] <= bands / 2) continue;
    const cv::Rect usable =
        Band(pyramid, k) &
        cv::Rect(border, border, pyramid.width() - 2 * border, pyramid.height() - 2 * border);
    if (usable.area() <= 0) continue;
    const auto inside =
        std::count_if(occupied.begin(), occupied.end(), [&](const Eigen::Vector2d& p) {
          return p.allFinite() && p.x() >= usable.x && p.x() < usable.x + usable.width &&
                 p.y() >= usable.y && p.y() < usable.y + usable.height;
        });
    const double density = static_cast<double>(inside) / usable.area();
    if (best < 0 || density < best_density) {
      best = k;
      best_density = density;
    }
  }
  if (best < 0) return DetectNextBand(pyramid, occupied, max_corners, corners);
  band_used_[best] = calls_;
  const cv::Rect band = Band(pyramid, best);
  Detect(pyramid, band, occupied, max_corners, corners);
  return band;
}

}  // namespace saccade
