#include "server/anchors/layer_probe.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>
#include <utility>
#include <vector>

namespace saccade {
namespace {

constexpr FrameId kLayerStride = 3;           // frames between those that are considered
constexpr std::size_t kLayerMostViews = 6;    // that see it most from beside...
constexpr std::size_t kLayerFewestViews = 3;  // ...and how many a pixel needs
constexpr double kLayerLeastParallax_px = 5.0;
constexpr double kLayerMostParallax_px = 40.0;
constexpr double kLayerNearest = 0.5, kLayerFarthest = 2.0;  // of the guess
constexpr int kLayerHalf = 14;  // of the picture's part that is compared [px]
constexpr int kLayerSize = 2 * kLayerHalf + 1;
constexpr int kLayerWindow_px = 7;            // that tells the depth of one pixel
constexpr double kLayerReach_px = 5.0;        // sigma of what counts as at the click
constexpr int kLayerRadius_px = 10;           // beyond it nothing counts
constexpr double kLayerLeastDeviation = 4.0;  // of a window [grey levels]
constexpr double kLayerGoodScore = 0.7, kLayerLead = 0.08;
constexpr int kLayerPeak = 2;               // steps that belong to one peak
constexpr int kLayerFewestPixels = 20;      // with a depth
constexpr double kLayerTolerance_px = 1.2;  // of one surface, in the view most from beside
constexpr double kLayerTolerance = 0.012;   // the same, share of inverse depth
constexpr double kLayerLeastShare = 0.08;   // of a second surface
constexpr double kLayerRelief_px =
    5.0;                          // what a window cannot tell apart: relief as deep as it is wide
constexpr int kLayerSectors = 8;  // round the click
constexpr double kLayerMaxSlope = 4.0;  // |d ln(rho) / d angle|

/// A pixel near the click whose depth is known.
struct DepthPixel {
  double x = 0, y = 0;  // from the click [px]
  double rho = 0;       // 1 / z in the clicked camera
  double weight = 0;    // nearness to the click
};

struct Surface {
  Eigen::Vector3d coefficients = Eigen::Vector3d::Zero();  // rho = c0 + c1 x + c2 y
  double score = -1.0;
  double At(const DepthPixel& pixel) const {
    return coefficients(0) + coefficients(1) * pixel.x + coefficients(2) * pixel.y;
  }
};

class LayerSweep {
 public:
  LayerSweep(const PastFrame& clicked, const Eigen::Vector2d& pixel, double guess_z)
      : clicked_(clicked),
        centre_(std::round(pixel.x()), std::round(pixel.y())),
        guess_z_(guess_z),
        focal_px_(clicked.frame->camera->intrinsics().fx) {}

  bool Gather(FrameId newest, const FrameLookup& frames, const PoseTrail* trail);
  std::vector<DepthPixel> Measure();
  double tolerance(double rho) const {
    return std::max(kLayerTolerance_px * step_, kLayerTolerance * rho);
  }
  double step() const { return step_; }
  double focal_px() const { return focal_px_; }

 private:
  std::optional<cv::Mat> Look(const BesideView& view, double rho) const;
  void AddScore(const cv::Mat& look, cv::Mat& sum, cv::Mat& count) const;

  const PastFrame& clicked_;
  const Eigen::Vector2d centre_;
  const double guess_z_, focal_px_;
  std::vector<BesideView> views_;
  double step_ = 0.0;  // of rho: one pixel in the view most from beside
  cv::Mat own_, own_mean_, own_deviation_;
};

bool LayerSweep::Gather(FrameId newest, const FrameLookup& frames, const PoseTrail* trail) {
  const CameraModel& camera = *clicked_.frame->camera;
  const cv::Mat& grey = clicked_.frame->grey;
  const cv::Rect part(static_cast<int>(centre_.x()) - kLayerHalf,
                      static_cast<int>(centre_.y()) - kLayerHalf, kLayerSize, kLayerSize);
  if ((part & cv::Rect(0, 0, grey.cols, grey.rows)) != part) return false;
  const auto bearing = camera.Unproject(centre_);
  if (!bearing || bearing->z() <= 0.0) return false;
  const Eigen::Vector3d ray = bearing->normalized();
  views_ = ViewsFromBeside(clicked_, ray, guess_z_ / ray.z(), newest, frames, trail,
                           {.stride = kLayerStride,
                            .most = kLayerMostViews,
                            .least_parallax_px = kLayerLeastParallax_px,
                            .most_parallax_px = kLayerMostParallax_px});
  if (views_.size() < kLayerFewestViews) return false;
  step_ = 1.0 / (guess_z_ * views_.front().parallax_px);
  grey(part).convertTo(own_, CV_32F);
  cv::Mat squares;
  cv::boxFilter(own_, own_mean_, CV_32F, {kLayerWindow_px, kLayerWindow_px});
  cv::boxFilter(own_.mul(own_), squares, CV_32F, {kLayerWindow_px, kLayerWindow_px});
  cv::sqrt(cv::max(squares - own_mean_.mul(own_mean_), 0.0), own_deviation_);
  return true;
}

/// The part as `view` shows it if all of it is 1 / `rho` deep: the warp is affine, the part small.
std::optional<cv::Mat> LayerSweep::Look(const BesideView& view, double rho) const {
  const CameraModel& camera = *view.past.frame->camera;
  std::array<cv::Point2f, 3> from, to;
  const std::array<Eigen::Vector2d, 3> corners = {Eigen::Vector2d(-kLayerHalf, -kLayerHalf),
                                                  {kLayerHalf, -kLayerHalf},
                                                  {-kLayerHalf, kLayerHalf}};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto bearing = clicked_.frame->camera->Unproject(centre_ + corners[k]);
    if (!bearing || bearing->z() <= 0.0) return std::nullopt;
    const auto pixel = camera.Project(view.view_from_clicked * (*bearing / bearing->z() / rho));
    if (!pixel || !camera.InImage(*pixel, 2.0)) return std::nullopt;
    from[k] = {static_cast<float>(corners[k].x() + kLayerHalf),
               static_cast<float>(corners[k].y() + kLayerHalf)};
    to[k] = {static_cast<float>(pixel->x()), static_cast<float>(pixel->y())};
  }
  cv::Mat look, part;
  cv::warpAffine(view.past.frame->grey, look, cv::getAffineTransform(from.data(), to.data()),
                 {kLayerSize, kLayerSize}, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
  look.convertTo(part, CV_32F);
  return part;
}

/// Adds the correlation of each pixel's window.
void LayerSweep::AddScore(const cv::Mat& look, cv::Mat& sum, cv::Mat& count) const {
  const cv::Size window(kLayerWindow_px, kLayerWindow_px);
  cv::Mat mean, squares, cross;
  cv::boxFilter(look, mean, CV_32F, window);
  cv::boxFilter(look.mul(look), squares, CV_32F, window);
  cv::boxFilter(look.mul(own_), cross, CV_32F, window);
  for (int y = 0; y < kLayerSize; ++y) {
    for (int x = 0; x < kLayerSize; ++x) {
      const float m = mean.at<float>(y, x), own = own_deviation_.at<float>(y, x);
      const float deviation = std::sqrt(std::max(0.0f, squares.at<float>(y, x) - m * m));
      if (deviation < 1.5f || own < 1.5f) continue;
      const float score =
          (cross.at<float>(y, x) - m * own_mean_.at<float>(y, x)) / (deviation * own);
      sum.at<float>(y, x) += std::max(0.0f, score);
    }
  }
  count += 1.0f;
}

std::vector<DepthPixel> LayerSweep::Measure() {
  const double low = 1.0 / (kLayerFarthest * guess_z_), high = 1.0 / (kLayerNearest * guess_z_);
  const int steps = 1 + static_cast<int>(std::ceil((high - low) / step_));
  std::vector<cv::Mat> scores;
  for (int k = 0; k < steps; ++k) {
    cv::Mat sum = cv::Mat::zeros(kLayerSize, kLayerSize, CV_32F), count = sum.clone();
    for (const BesideView& view : views_) {
      if (const auto look = Look(view, low + k * step_)) AddScore(*look, sum, count);
    }
    if (count.at<float>(0, 0) < static_cast<float>(kLayerFewestViews)) count.setTo(1e9f);
    scores.push_back(sum / count);
  }
  std::vector<DepthPixel> pixels;
  for (int y = -kLayerRadius_px; y <= kLayerRadius_px; ++y) {
    for (int x = -kLayerRadius_px; x <= kLayerRadius_px; ++x) {
      if (x * x + y * y > kLayerRadius_px * kLayerRadius_px) continue;
      if (own_deviation_.at<float>(y + kLayerHalf, x + kLayerHalf) < kLayerLeastDeviation) continue;
      const auto score = [&](int k) { return scores[k].at<float>(y + kLayerHalf, x + kLayerHalf); };
      int best = 0;
      for (int k = 1; k < steps; ++k) best = score(k) > score(best) ? k : best;
      if (best == 0 || best + 1 == steps || score(best) < kLayerGoodScore) continue;
      bool alone = true;
      for (int k = 0; k < steps && alone; ++k) {
        alone = std::abs(k - best) <= kLayerPeak || score(k) < score(best) - kLayerLead;
      }
      if (!alone) continue;
      const double a = score(best - 1), b = score(best), c = score(best + 1);
      const double curve = a - 2.0 * b + c;
      const double shift = curve < 0.0 ? std::clamp(0.5 * (a - c) / curve, -0.5, 0.5) : 0.0;
      pixels.push_back({static_cast<double>(x), static_cast<double>(y),
                        low + (best + shift) * step_,
                        std::exp(-0.5 * (x * x + y * y) / (kLayerReach_px * kLayerReach_px))});
    }
  }
  return pixels;
}

/// How far from the click pixels have a depth, on the side where that is least far.
double ReachOf(const std::vector<DepthPixel>& pixels) {
  // The farthest two of each side: one may be wrong.
  std::array<std::array<double, 2>, kLayerSectors> farthest{};
  for (const DepthPixel& pixel : pixels) {
    const double radius = std::hypot(pixel.x, pixel.y);
    const double turn = std::atan2(pixel.y, pixel.x) / (2.0 * std::numbers::pi) + 0.5;
    auto& [first, second] =
        farthest[std::min(kLayerSectors - 1, static_cast<int>(turn * kLayerSectors))];
    if (radius > first) {
      second = std::exchange(first, radius);
    } else {
      second = std::max(second, radius);
    }
  }
  const auto less = [](const auto& a, const auto& b) { return a[1] < b[1]; };
  return (*std::min_element(farthest.begin(), farthest.end(), less))[1];
}

/// The flat surface that most of the pixels lie on, weighted by nearness to the click.
Surface BestSurface(const std::vector<DepthPixel>& pixels, const LayerSweep& sweep) {
  std::mt19937 random(1);  // the same every time
  std::uniform_int_distribution<std::size_t> pick(0, pixels.size() - 1);
  Surface best;
  for (int round = 0; round < 120; ++round) {
    Surface surface;
    const DepthPixel &a = pixels[pick(random)], &b = pixels[pick(random)],
                     &c = pixels[pick(random)];
    if (round % 2 == 0) {  // facing the camera
      surface.coefficients << a.rho, 0, 0;
    } else {
      Eigen::Matrix3d m;
      m << 1, a.x, a.y, 1, b.x, b.y, 1, c.x, c.y;
      if (std::abs(m.determinant()) < 20.0) continue;
      surface.coefficients = m.inverse() * Eigen::Vector3d(a.rho, b.rho, c.rho);
      const double slope = surface.coefficients.tail<2>().norm() * sweep.focal_px();
      if (surface.coefficients(0) <= 0.0 || slope > kLayerMaxSlope * surface.coefficients(0))
        continue;
    }
    surface.score = 0.0;
    for (const DepthPixel& pixel : pixels) {
      const double off = std::abs(pixel.rho - surface.At(pixel)) / sweep.tolerance(pixel.rho);
      if (off < 1.0) surface.score += pixel.weight * (1.0 - off * off);
    }
    if (surface.score > best.score) best = surface;
  }
  return best;
}

}  // namespace

std::optional<DepthLayers> ProbeLayers(const PastFrame& clicked, const Eigen::Vector2d& pixel,
                                       double guess_m, FrameId newest, const FrameLookup& frames,
                                       const PoseTrail* trail) {
  if (!(guess_m > 0.0) || clicked.snapshot->status != TrackingStatus::kTracking) {
    return std::nullopt;
  }
  const auto bearing = clicked.frame->camera->Unproject(pixel);
  if (!bearing || bearing->z() <= 0.0) return std::nullopt;
  LayerSweep sweep(clicked, pixel, guess_m * bearing->z());
  if (!sweep.Gather(newest, frames, trail)) return std::nullopt;
  const std::vector<DepthPixel> pixels = sweep.Measure();
  if (pixels.size() < kLayerFewestPixels) return std::nullopt;
  const Surface first = BestSurface(pixels, sweep);
  if (first.score <= 0.0) return std::nullopt;
  double total = 0.0, on_first = 0.0;
  std::vector<DepthPixel> others;
  for (const DepthPixel& each : pixels) {
    total += each.weight;
    const double off = std::abs(each.rho - first.At(each));
    if (off < 2.0 * sweep.tolerance(each.rho)) {
      on_first += each.weight;
    } else {
      others.push_back(each);
    }
  }
  DepthLayers layers;
  const double rho = first.coefficients(0);
  layers.range_m = 1.0 / (rho * bearing->z());
  layers.sigma_m =
      layers.range_m * std::hypot(0.3 * sweep.step() / rho, kLayerRelief_px / sweep.focal_px());
  layers.reach_px = ReachOf(pixels);
  // Wrong matches are everywhere; another surface is where many agree.
  if (others.size() < kLayerFewestPixels / 2) return layers;
  const Surface second = BestSurface(others, sweep);
  double on_second = 0.0;
  std::vector<double> distances_px;
  for (const DepthPixel& each : others) {
    if (std::abs(each.rho - second.At(each)) < 2.0 * sweep.tolerance(each.rho)) {
      on_second += each.weight;
      distances_px.push_back(std::hypot(each.x, each.y));
    }
  }
  const double share = on_second / total;
  if (second.score <= 0.0 || distances_px.size() < 3 || share < kLayerLeastShare) return layers;
  std::nth_element(distances_px.begin(), distances_px.begin() + 2, distances_px.end());
  layers.other_from_px = distances_px[2];  // one or two may be wrong
  layers.other_share = share;
  layers.other_range_m = 1.0 / (second.coefficients(0) * bearing->z());
  return layers;
}

}  // namespace saccade
