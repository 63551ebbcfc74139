#include "server/anchors/depth_probe.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "server/features/patch.hpp"

namespace saccade {
namespace {

constexpr FrameId kStride = 6;                     // frames between those that are considered
constexpr std::size_t kMostViews = 12;             // that see it most from beside...
constexpr std::size_t kFewestViews = 4;            // ...and how many a range needs
constexpr double kLeastParallax_px = 4.0;          // of a view, at the guess
constexpr double kMostParallax_px = 70.0;          // more would need too many steps
constexpr double kNearest = 0.4, kFarthest = 2.5;  // of the guess
constexpr int kSteps = 170;                        // about 1 px each in the widest view
constexpr int kPatch_px = 15;
constexpr double kLeastDeviation = 4.0;  // of the patch [grey levels]: sensor noise has about 2
constexpr double kGoodScore = 0.75;      // mean correlation
constexpr double kLead = 0.10;           // over any other range
constexpr double kLargestSigma = 0.06;   // of the range

double Correlation(const CorrelationTemplate& look, const cv::Mat& seen) {
  const int size = look.size;
  double sum = 0.0, squared = 0.0, cross = 0.0;
  for (int y = 0; y < size; ++y) {
    const float* row = seen.ptr<float>(y);
    for (int x = 0; x < size; ++x) {
      sum += row[x];
      squared += static_cast<double>(row[x]) * row[x];
      cross += static_cast<double>(row[x]) * look.pixels[y * CorrelationTemplate::kStride + x];
    }
  }
  const double n = size * size;
  const double variance = squared - sum * sum / n;
  const double own = static_cast<double>(look.sum_squared) -
                     static_cast<double>(look.sum) * static_cast<double>(look.sum) / n;
  if (variance < 4.0 * n || own <= 0.0) return 0.0;
  return (cross - sum * static_cast<double>(look.sum) / n) / std::sqrt(variance * own);
}

class Sweep {
 public:
  Sweep(const PastFrame& clicked, PatchTemplate patch, double guess_m)
      : clicked_(clicked), patch_(std::move(patch)), guess_m_(guess_m) {}

  void Gather(FrameId newest, const FrameLookup& frames, const PoseTrail* trail) {
    views_ = ViewsFromBeside(clicked_, patch_.birth_bearing, guess_m_, newest, frames, trail,
                             {.stride = kStride,
                              .most = kMostViews,
                              .least_parallax_px = kLeastParallax_px,
                              .most_parallax_px = kMostParallax_px});
  }

  std::size_t views() const { return views_.size(); }

  /// Mean correlation if the range is 1 / `inverse_range`; -1 where too few views see it.
  double Score(double inverse_range) {
    WarpOptions options;
    options.coarse = false;
    options.size = kPatch_px;
    options.min_deviation = kLeastDeviation;
    double sum = 0.0;
    std::size_t seen = 0;
    for (const BesideView& view : views_) {
      const CameraModel& camera = *view.past.frame->camera;
      const Eigen::Vector3d point = view.view_from_clicked * (patch_.birth_bearing / inverse_range);
      const auto pixel = point.z() > 0.0 ? camera.Project(point) : std::nullopt;
      if (!pixel || !camera.InImage(*pixel, options.size)) continue;
      if (WarpPatch(patch_, view.view_from_clicked, patch_.birth_bearing, inverse_range,
                    Eigen::Vector3d::Zero(), camera, *pixel, options, warped_) != WarpStatus::kOk) {
        continue;
      }
      cv::getRectSubPix(view.past.frame->grey, {options.size, options.size},
                        {static_cast<float>(pixel->x()), static_cast<float>(pixel->y())}, rect_,
                        CV_32F);
      sum += std::max(0.0, Correlation(warped_.fine, rect_));
      ++seen;
    }
    return seen < kFewestViews ? -1.0 : sum / static_cast<double>(seen);
  }

 private:
  const PastFrame& clicked_;
  PatchTemplate patch_;
  double guess_m_;
  std::vector<BesideView> views_;
  WarpedPatch warped_;
  cv::Mat rect_;
};

}  // namespace

std::optional<ProbedDepth> ProbeDepth(const PastFrame& clicked, const Eigen::Vector2d& pixel,
                                      double guess_m, FrameId newest, const FrameLookup& frames,
                                      const PoseTrail* trail) {
  if (!(guess_m > 0.0) || clicked.snapshot->status != TrackingStatus::kTracking)
    return std::nullopt;
  absl::StatusOr<PatchTemplate> patch = CutPatch(clicked.frame->grey, pixel, clicked.frame->camera);
  if (!patch.ok()) return std::nullopt;
  Sweep sweep(clicked, *std::move(patch), guess_m);
  sweep.Gather(newest, frames, trail);
  if (sweep.views() < kFewestViews) return std::nullopt;
  const double low = 1.0 / (kFarthest * guess_m), high = 1.0 / (kNearest * guess_m);
  const double step = (high - low) / (kSteps - 1);
  std::vector<double> scores(kSteps);
  for (int k = 0; k < kSteps; ++k) scores[k] = sweep.Score(low + k * step);
  const int best =
      static_cast<int>(std::max_element(scores.begin(), scores.end()) - scores.begin());
  const double top = scores[best];
  if (top < kGoodScore || best == 0 || best == kSteps - 1) return std::nullopt;
  int left = best, right = best;
  while (left > 0 && scores[left] > top - kLead) --left;
  while (right < kSteps - 1 && scores[right] > top - kLead) ++right;
  for (int k = 0; k < kSteps; ++k) {
    if ((k < left || k > right) && scores[k] > top - kLead) return std::nullopt;
  }
  const double a = scores[best - 1], c = scores[best + 1];
  const double curve = a - 2.0 * top + c;
  const double shift = curve < 0.0 ? std::clamp(0.5 * (a - c) / curve, -0.5, 0.5) : 0.0;
  const double inverse = low + (best + shift) * step;
  const double sigma = std::max(0.3, 0.25 * (right - left)) * step;
  if (sigma > kLargestSigma * inverse) return std::nullopt;
  return ProbedDepth{1.0 / inverse, sigma / (inverse * inverse), top,
                     static_cast<int>(sweep.views())};
}

void JoinDepth(const ProbedDepth& probed, double& range_m, double& sigma_m) {
  constexpr double kAgree = 2.5;
  const double both = std::hypot(probed.sigma_m, sigma_m);
  if (std::abs(probed.range_m - range_m) < kAgree * both) {
    const double share = sigma_m * sigma_m / (both * both);  // of the probe
    range_m += share * (probed.range_m - range_m);
    sigma_m = probed.sigma_m * sigma_m / both;
  } else {
    range_m = probed.range_m;
    sigma_m = probed.sigma_m;
  }
}

}  // namespace saccade
