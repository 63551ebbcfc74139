#include "server/features/search.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "server/features/correlation.hpp"
#include "server/features/sub_pixel.hpp"

namespace saccade {
namespace {

constexpr float kUnseen = -2.0F;  // score of pixels that were not compared
constexpr int kPad = CorrelationScorer::kReadAhead;

double PeakOffset(double left, double middle, double right) {
  const double curvature = left - 2.0 * middle + right;
  if (curvature >= -1e-9) return 0.0;
  return std::clamp(0.5 * (left - right) / curvature, -0.5, 0.5);
}

/// Inside the picture and with the whole template inside it.
cv::Rect Reachable(const cv::Mat& image, int size) {
  return {size / 2, size / 2, image.cols - size + 1, image.rows - size + 1};
}

}  // namespace

/// Pixels p with (p - centre)^T inverse (p - centre) < gate.
struct PatchSearcher::Ellipse {
  Eigen::Vector2d centre;
  Eigen::Matrix2d inverse;
  double gate = 9.0;
  Eigen::Vector2d half_box;  // half width and height of its bounding box

  double Area() const { return M_PI * gate / std::sqrt(std::max(inverse.determinant(), 1e-12)); }
  /// The same place at half resolution, at least 1.5 of its pixels wide.
  Ellipse Halved() const {
    Ellipse half{ImagePyramid::ToLevel(centre, 1), 4.0 * inverse, gate, 0.5 * half_box};
    const Eigen::Vector2d grown = half.half_box.array() + 1.0;
    half.inverse *= (half.half_box.array() / grown.array()).square().mean();
    half.half_box = grown;
    return half;
  }
  /// Columns from..to (inclusive) of row y; false if the row is empty.
  bool Row(int y, int& from, int& to) const {
    const double dy = y - centre.y();
    const double a = inverse(0, 0);
    const double b = inverse(0, 1) * dy;
    const double under = b * b - a * (inverse(1, 1) * dy * dy - gate);
    if (!(under >= 0.0)) return false;
    const double root = std::sqrt(under);
    from = static_cast<int>(std::ceil(centre.x() + (-b - root) / a));
    to = static_cast<int>(std::floor(centre.x() + (-b + root) / a));
    return to >= from;
  }
  cv::Rect Box() const {
    const int x0 = static_cast<int>(std::ceil(centre.x() - half_box.x()));
    const int y0 = static_cast<int>(std::ceil(centre.y() - half_box.y()));
    return {x0, y0, static_cast<int>(std::floor(centre.x() + half_box.x())) - x0 + 1,
            static_cast<int>(std::floor(centre.y() + half_box.y())) - y0 + 1};
  }
};

/// Candidate pixels (template centres) of one scan.
struct PatchSearcher::Window {
  cv::Rect box;
  bool empty() const { return box.width <= 0 || box.height <= 0; }
};

absl::Status SearchOptions::Validate() const {
  if (!(max_nssd > 0.0 && max_nssd <= 2.0)) {
    return absl::InvalidArgumentError(
        absl::StrCat("features.search.max_nssd: ", max_nssd, "; give a number in (0, 2]"));
  }
  if (!(gate_squared > 0.0) || !(max_sigma_px > 0.0 && max_sigma_px <= 100.0) ||
      !(min_half_axis_px >= 1.0) || coarse_peaks < 1 || coarse_peaks > 8 || rival_distance_px < 2 ||
      max_iterations < 1 || !(noise_floor_px >= 0.0)) {
    return absl::InvalidArgumentError(
        "features.search: gate_squared above 0, max_sigma_px in (0, 100], min_half_axis_px at "
        "least 1, coarse_peaks 1 to 8, rival_distance_px at least 2, max_iterations at least 1, "
        "noise_floor_px not negative");
  }
  return absl::OkStatus();
}

const char* ToString(SearchStatus status) {
  switch (status) {
    case SearchStatus::kFound:
      return "found";
    case SearchStatus::kNoMatch:
      return "no match";
    case SearchStatus::kTooUncertain:
      return "too uncertain";
    case SearchStatus::kOutside:
      return "outside";
    case SearchStatus::kBadInput:
      return "bad input";
  }
  return "unknown";
}

double SearchResult::Ambiguity() const {
  return std::clamp((1.0 - zncc) / std::max(1e-6, 1.0 - rival_zncc), 0.0, 1.0);
}

PatchSearcher::PatchSearcher(const SearchOptions& options) : options_(options) {
  scores_.resize(64 * 64);
  pixels_.resize(80 * 96);
  peaks_.reserve(64);
}

int PatchSearcher::Scan(const cv::Mat& image, const CorrelationTemplate& templ,
                        const Window& window, const Ellipse* ellipse) {
  const cv::Rect& box = window.box;
  const int half = templ.size / 2;
  const int width = box.width + templ.size - 1;
  const int height = box.height + templ.size - 1;
  const int stride = width + kPad;
  scores_.resize(std::max<std::size_t>(scores_.size(), box.area()));
  pixels_.resize(std::max<std::size_t>(pixels_.size(), static_cast<std::size_t>(stride) * height));
  // A compact copy: near in the cache, and rows may be read past the picture's edge.
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(box.y - half + y) + box.x - half;
    std::copy_n(row, width, pixels_.data() + y * stride);
    std::fill_n(pixels_.data() + y * stride + width, kPad, std::uint8_t{0});
  }
  const CorrelationScorer scorer(templ, options_.min_deviation);
  int evaluated = 0;
  for (int y = 0; y < box.height; ++y) {
    float* scores = scores_.data() + y * box.width;
    int from = box.x;
    int to = box.x + box.width - 1;
    std::fill_n(scores, box.width, kUnseen);
    if (ellipse != nullptr && !ellipse->Row(box.y + y, from, to)) continue;
    from = std::max(from, box.x);
    to = std::min(to, box.x + box.width - 1);
    if (to < from) continue;
    scorer.Row(pixels_.data() + y * stride + (from - box.x), stride, to - from + 1,
               scores + (from - box.x));
    evaluated += to - from + 1;
  }
  return evaluated;
}

PatchSearcher::Peak PatchSearcher::Best(const Window& window) const {
  const auto count = static_cast<std::ptrdiff_t>(window.box.area());
  const auto best = std::max_element(scores_.begin(), scores_.begin() + count);
  const int at = static_cast<int>(best - scores_.begin());
  return {window.box.x + at % window.box.width, window.box.y + at / window.box.width, *best};
}

float PatchSearcher::Rival(const Window& window, const Peak& best) const {
  const cv::Rect& box = window.box;
  float rival = -1.0F;
  for (int y = 0; y < box.height; ++y) {
    const bool near_row = std::abs(box.y + y - best.y) < options_.rival_distance_px;
    const float* row = scores_.data() + y * box.width;
    for (int x = 0; x < box.width; ++x) {
      const float score = row[x];
      if (score <= rival) continue;
      if (near_row && std::abs(box.x + x - best.x) < options_.rival_distance_px) continue;
      // Only summits count, not the slope of the best one.
      const bool summit = (x == 0 || row[x - 1] <= score) &&
                          (x == box.width - 1 || row[x + 1] <= score) &&
                          (y == 0 || row[x - box.width] <= score) &&
                          (y == box.height - 1 || row[x + box.width] <= score);
      if (summit) rival = score;
    }
  }
  return rival;
}

void PatchSearcher::TopPeaks(const Window& window) {
  const cv::Rect& box = window.box;
  peaks_.clear();
  for (int y = 0; y < box.height; ++y) {
    for (int x = 0; x < box.width; ++x) {
      const float score = scores_[y * box.width + x];
      if (score < options_.coarse_min_zncc) continue;
      bool summit = true;
      for (int k = 0; k < 9 && summit; ++k) {
        const int nx = x + k % 3 - 1;
        const int ny = y + k / 3 - 1;
        if (k == 4 || nx < 0 || ny < 0 || nx >= box.width || ny >= box.height) continue;
        const float other = scores_[ny * box.width + nx];
        summit = k < 4 ? other < score : other <= score;
      }
      if (summit) peaks_.push_back({box.x + x, box.y + y, score});
    }
  }
  std::stable_sort(peaks_.begin(), peaks_.end(),
                   [](const Peak& a, const Peak& b) { return a.zncc > b.zncc; });
  if (static_cast<int>(peaks_.size()) > options_.coarse_peaks) {
    peaks_.resize(options_.coarse_peaks);
  }
}

float PatchSearcher::ScoreAt(const cv::Mat& image, const CorrelationTemplate& templ, int x,
                             int y) const {
  const int half = templ.size / 2;
  if (!Reachable(image, templ.size).contains({x, y})) return kUnseen;
  std::array<std::uint8_t, CorrelationTemplate::kMaxSize * CorrelationTemplate::kStride> local{};
  for (int v = 0; v < templ.size; ++v) {
    std::copy_n(image.ptr<std::uint8_t>(y - half + v) + x - half, templ.size,
                local.data() + v * CorrelationTemplate::kStride);
  }
  float score = kUnseen;
  CorrelationScorer(templ, options_.min_deviation)
      .Row(local.data(), CorrelationTemplate::kStride, 1, &score);
  return score;
}

void PatchSearcher::Finish(const cv::Mat& image, const CorrelationTemplate& templ, const Peak& peak,
                           SearchResult& result) {
  result.zncc = peak.zncc;
  result.nssd = 2.0 * (1.0 - result.zncc);
  result.pixel = {peak.x, peak.y};
  if (result.nssd > options_.max_nssd) {
    result.status = SearchStatus::kNoMatch;
    return;
  }
  result.status = SearchStatus::kFound;
  double method_sigma = 0.29;  // of rounding to whole pixels
  if (options_.sub_pixel != SubPixel::kNone) {
    method_sigma = 0.1;
    const auto score = [&](int dx, int dy) {
      return ScoreAt(image, templ, peak.x + dx, peak.y + dy);
    };
    const float left = score(-1, 0), right = score(1, 0), up = score(0, -1), down = score(0, 1);
    if (left > kUnseen && right > kUnseen) {
      result.pixel.x() += PeakOffset(left, peak.zncc, right);
    }
    if (up > kUnseen && down > kUnseen) result.pixel.y() += PeakOffset(up, peak.zncc, down);
  }
  const bool align = options_.sub_pixel == SubPixel::kLucasKanade;
  const Alignment fit =
      AlignTemplate(image, templ, result.pixel, align ? options_.max_iterations : 1);
  if (align && fit.converged) {
    result.pixel = fit.pixel;
    result.refined = true;
    method_sigma = 0.0;
  }
  const double floor = options_.noise_floor_px;
  result.covariance = Eigen::Matrix2d::Identity() * (floor * floor + method_sigma * method_sigma);
  if (fit.covariance.allFinite()) result.covariance += fit.covariance;
}

SearchResult PatchSearcher::FindFine(const cv::Mat& image, const CorrelationTemplate& templ,
                                     const Ellipse& ellipse) {
  SearchResult result;
  const Window window{ellipse.Box() & Reachable(image, templ.size)};
  if (!window.empty()) result.evaluated = Scan(image, templ, window, &ellipse);
  if (result.evaluated == 0) {
    result.status = SearchStatus::kOutside;
    return result;
  }
  const Peak best = Best(window);
  result.rival_zncc = Rival(window, best);
  Finish(image, templ, best, result);
  return result;
}

SearchResult PatchSearcher::FindCoarse(const ImagePyramid& pyramid, const WarpedPatch& patch,
                                       const Ellipse& ellipse) {
  SearchResult result;
  const Ellipse half = ellipse.Halved();
  const cv::Mat& small = pyramid.level(1);
  const Window coarse{half.Box() & Reachable(small, patch.coarse.size)};
  if (!coarse.empty()) result.evaluated = Scan(small, patch.coarse, coarse, &half);
  if (result.evaluated == 0) {
    result.status = SearchStatus::kOutside;
    return result;
  }
  TopPeaks(coarse);
  const cv::Mat& image = pyramid.level(0);
  Peak best;
  float rival = -1.0F;
  for (std::size_t k = 0; k < peaks_.size(); ++k) {
    const Eigen::Vector2d at = ImagePyramid::FromLevel({peaks_[k].x, peaks_[k].y}, 1);
    const int x0 = static_cast<int>(std::floor(at.x())) - 1;
    const int y0 = static_cast<int>(std::floor(at.y())) - 1;
    const Window window{cv::Rect(x0, y0, 4, 4) & ellipse.Box() & Reachable(image, patch.fine.size)};
    if (window.empty()) continue;
    result.evaluated += Scan(image, patch.fine, window, nullptr);
    Peak found = Best(window);
    if (found.zncc > best.zncc) std::swap(found, best);
    const int apart = std::max(std::abs(found.x - best.x), std::abs(found.y - best.y));
    if (apart >= options_.rival_distance_px) rival = std::max(rival, found.zncc);
  }
  result.rival_zncc = rival;
  if (best.zncc <= kUnseen) {
    result.status = SearchStatus::kNoMatch;
    return result;
  }
  Finish(image, patch.fine, best, result);
  return result;
}

SearchResult PatchSearcher::Find(const ImagePyramid& pyramid, const WarpedPatch& patch,
                                 const Eigen::Vector2d& predicted,
                                 const Eigen::Matrix2d& innovation_covariance) {
  SearchResult result;
  const int size = patch.fine.size;
  if (pyramid.empty() || size < 7 || size > CorrelationTemplate::kMaxSize || size % 2 == 0 ||
      !predicted.allFinite() || predicted.lpNorm<Eigen::Infinity>() > 1e6 ||
      !innovation_covariance.allFinite()) {
    return result;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(innovation_covariance);
  if (!(eigen.eigenvalues()[0] > 0.0)) return result;
  if (eigen.eigenvalues()[1] > options_.max_sigma_px * options_.max_sigma_px) {
    result.status = SearchStatus::kTooUncertain;
    return result;
  }
  const double least =
      options_.min_half_axis_px * options_.min_half_axis_px / options_.gate_squared;
  const Eigen::Vector2d variances = eigen.eigenvalues().cwiseMax(least);
  const Eigen::Matrix2d covariance =
      eigen.eigenvectors() * variances.asDiagonal() * eigen.eigenvectors().transpose();
  Ellipse ellipse{predicted, covariance.inverse(), options_.gate_squared,
                  (options_.gate_squared * covariance.diagonal()).cwiseSqrt()};
  if (patch.coarse.size > 0 && ellipse.Area() > options_.coarse_above_pixels) {
    const SearchResult coarse = FindCoarse(pyramid, patch, ellipse);
    if (coarse.status != SearchStatus::kOutside) return coarse;
  }
  return FindFine(pyramid.level(0), patch.fine, ellipse);
}

}  // namespace saccade
