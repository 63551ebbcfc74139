#include "server/markers/border_fit.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace saccade {
namespace {

constexpr double kStep_px = 0.5;  // along a profile
constexpr double kFine_px = 0.8, kCoarse_px = 1.1;
constexpr double kCoarseFrom_px = 28;  // sides so long are searched with the coarser Gaussian
constexpr int kTaps = 6;               // of the derivative, to either side
constexpr int kMostProfile = 64;
constexpr int kMostSamples = 80, kLeastSamples = 4;
// Corners are rounded by the lens: samples keep away from them.
constexpr double kClear_px = 2.0, kClearShare = 0.2;
constexpr double kInlier_px = 0.6;
constexpr int kReweightings = 8;
// A sample's variance before there are residuals: so many, of this picture noise over contrast.
constexpr double kPriorSamples = 4, kPriorNoise = 4, kPriorGain = 9;
// Neighbouring samples share pixels.
constexpr double kCorrelated = 1.6;
// What pixels' own shape leaves of the best line [px^2].
constexpr double kLeastVariance_px2 = 0.01 * 0.01;
// A white that is cut off, and what a side is worth that can be seen against no other [px^2].
constexpr double kSaturated = 252, kSaturatedVariance_px2 = 0.15 * 0.15;
constexpr double kLeastUnsaturated = 0.4;
// Two sides that are nearly parallel have no corner.
constexpr double kLeastSine = 0.1;

struct Sample {
  double along, across, contrast;
  bool saturated;  // white is cut off: the edge seems to be further in than it is
};

/// A line through `middle`; the variance of its place so far along it is offset + along^2 slope.
struct Line {
  Eigen::Vector2d middle, direction, outward;
  double offset_variance = 0, slope_variance = 0;
  double support = 0;

  double VarianceAt(const Eigen::Vector2d& point) const {
    const double along = direction.dot(point - middle);
    return offset_variance + along * along * slope_variance;
  }
};

struct Kernel {
  explicit Kernel(double sigma_px) {
    for (int k = -kTaps; k <= kTaps; ++k) {
      const double x = k * kStep_px / sigma_px;
      weight[k + kTaps] = k * std::exp(-0.5 * x * x);
    }
  }
  std::array<double, 2 * kTaps + 1> weight{};
};

double At(const cv::Mat& grey, double x, double y) {
  const int left = static_cast<int>(x), top = static_cast<int>(y);
  const double a = x - left, b = y - top;
  const auto* upper = grey.ptr<std::uint8_t>(top) + left;
  const auto* lower = grey.ptr<std::uint8_t>(top + 1) + left;
  return (1 - b) * ((1 - a) * upper[0] + a * upper[1]) + b * ((1 - a) * lower[0] + a * lower[1]);
}

bool Inside(const cv::Mat& grey, const Eigen::Vector2d& p) {
  return p.x() >= 0 && p.y() >= 0 && p.x() < grey.cols - 1 && p.y() < grey.rows - 1;
}

/// The strongest dark-to-bright edge along `outward` within reach of `start`.
std::optional<Sample> FindEdge(const cv::Mat& grey, const Kernel& kernel,
                               const Eigen::Vector2d& start, const Eigen::Vector2d& outward,
                               const BorderFitOptions& options) {
  const int reach = std::min(static_cast<int>(options.reach_px / kStep_px + 0.5),
                             (kMostProfile - 2 * kTaps - 1) / 2 - 1);
  const int half = reach + 1 + kTaps, count = 2 * half + 1;
  std::array<double, kMostProfile> profile;
  if (!Inside(grey, start - half * kStep_px * outward) ||
      !Inside(grey, start + half * kStep_px * outward)) {
    return std::nullopt;
  }
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector2d p = start + (k - half) * kStep_px * outward;
    profile[k] = At(grey, p.x(), p.y());
  }
  std::array<double, kMostProfile> response{};
  int best = -1;
  for (int k = kTaps; k + kTaps < count; ++k) {
    for (int tap = 0; tap <= 2 * kTaps; ++tap) {
      response[k] += kernel.weight[tap] * profile[k - kTaps + tap];
    }
    const bool inner = k > kTaps && k + kTaps + 1 < count;
    if (inner && (best < 0 || response[k] > response[best])) best = k;
  }
  const auto [low, high] =
      std::minmax_element(profile.begin() + best - kTaps, profile.begin() + best + kTaps + 1);
  const double contrast = *high - *low,
               bend = response[best - 1] - 2 * response[best] + response[best + 1];
  if (response[best] <= 0 || contrast < options.least_contrast || bend >= 0) return std::nullopt;
  const double shift = 0.5 * (response[best - 1] - response[best + 1]) / bend;
  if (std::abs(shift) > 1) return std::nullopt;  // it goes on rising outside of reach
  return Sample{0, (best + shift - half) * kStep_px, contrast, *high >= kSaturated};
}

struct Weighted {
  double weight = 0, along = 0, across = 0, spread = 0, slope = 0;
};

/// Across = across(along) as a straight line, by `weights`.
Weighted FitWeighted(const std::vector<Sample>& samples, const std::vector<double>& weights) {
  Weighted fit;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    fit.weight += weights[k];
    fit.along += weights[k] * samples[k].along;
    fit.across += weights[k] * samples[k].across;
  }
  fit.along /= fit.weight;
  fit.across /= fit.weight;
  double mixed = 0;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const double along = samples[k].along - fit.along;
    fit.spread += weights[k] * along * along;
    mixed += weights[k] * along * (samples[k].across - fit.across);
  }
  fit.slope = fit.spread > 0 ? mixed / fit.spread : 0;
  return fit;
}

double MedianAcross(std::vector<Sample> samples) {
  const auto middle = samples.begin() + static_cast<std::ptrdiff_t>(samples.size() / 2);
  std::nth_element(samples.begin(), middle, samples.end(),
                   [](const Sample& a, const Sample& b) { return a.across < b.across; });
  return middle->across;
}

/// Leaves those that are not saturated, if they are enough; the share of saturated ones that stay.
double TakeOutSaturated(std::vector<Sample>& samples) {
  const auto saturated = [](const Sample& sample) { return sample.saturated; };
  const auto count = std::count_if(samples.begin(), samples.end(), saturated);
  const double all = static_cast<double>(samples.size());
  const double left = all - static_cast<double>(count);
  if (left < kLeastUnsaturated * all || left < 2 * kLeastSamples) return 1 - left / all;
  std::erase_if(samples, saturated);
  return 0;
}

/// Straight from the first point to the second, then where the samples say.
std::optional<Line> FitLine(const cv::Mat& grey, const Eigen::Vector2d& from,
                            const Eigen::Vector2d& to, bool left_is_outside,
                            const BorderFitOptions& options) {
  Line line;
  const double length = (to - from).norm();
  line.direction = (to - from) / length;
  line.outward = left_is_outside ? Eigen::Vector2d(line.direction.y(), -line.direction.x())
                                 : Eigen::Vector2d(-line.direction.y(), line.direction.x());
  const double clear = std::min(kClear_px, kClearShare * length);
  const int count = std::min(kMostSamples, static_cast<int>(length - 2 * clear) + 1);
  if (count < kLeastSamples) return std::nullopt;
  const Kernel kernel(length >= kCoarseFrom_px ? kCoarse_px : kFine_px);
  std::vector<Sample> samples;
  for (int k = 0; k < count; ++k) {
    const double along = clear + (length - 2 * clear) * k / (count - 1);
    std::optional<Sample> found =
        FindEdge(grey, kernel, from + along * line.direction, line.outward, options);
    if (!found) continue;
    found->along = along;
    samples.push_back(*found);
  }
  if (samples.size() < static_cast<std::size_t>(kLeastSamples)) return std::nullopt;
  const std::size_t found = samples.size();
  const double saturated_share = TakeOutSaturated(samples);
  std::vector<double> weights(samples.size(), 1.0);
  Weighted fit;
  fit.along = 0.5 * length;
  fit.across = MedianAcross(samples);
  for (int round = 0; round < kReweightings; ++round) {
    for (std::size_t k = 0; k < samples.size(); ++k) {
      const double off =
          samples[k].across - fit.across - fit.slope * (samples[k].along - fit.along);
      const double relative = std::max(0.0, 1 - std::pow(off / (2 * kInlier_px), 2));
      weights[k] = round == 0 ? std::max(0.01, relative) : relative * relative;
    }
    fit = FitWeighted(samples, weights);
    if (!(fit.weight > 1) || !(fit.spread > 0)) return std::nullopt;
  }
  double squares = 0, contrast = 0, inliers = 0;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const double off = samples[k].across - fit.across - fit.slope * (samples[k].along - fit.along);
    squares += weights[k] * off * off;
    contrast += weights[k] * samples[k].contrast;
    inliers += std::abs(off) < kInlier_px;
  }
  // Those taken out would have agreed, but for what is cut off.
  line.support = inliers / count * found / samples.size();
  if (line.support < options.least_support || inliers < kLeastSamples) return std::nullopt;
  contrast /= fit.weight;
  const double prior = kPriorGain * std::pow(kPriorNoise / contrast, 2);
  const double variance = kCorrelated * (squares + kPriorSamples * prior) /
                          (std::max(0.0, fit.weight - 2) + kPriorSamples);
  line.offset_variance = kLeastVariance_px2 + variance / fit.weight +
                         saturated_share * saturated_share * kSaturatedVariance_px2;
  line.slope_variance = variance / fit.spread;
  line.middle = from + fit.along * line.direction + fit.across * line.outward;
  const Eigen::Vector2d turned = (line.direction + fit.slope * line.outward).normalized();
  line.outward = (line.outward - fit.slope * line.direction).normalized();
  line.direction = turned;
  return line;
}

double SignedArea(const std::array<Eigen::Vector2d, 4>& corners) {
  double twice = 0;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d &a = corners[k], &b = corners[(k + 1) % 4];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

std::optional<BorderFit> FitOnce(const cv::Mat& grey, const std::array<Eigen::Vector2d, 4>& rough,
                                 const BorderFitOptions& options) {
  const bool clockwise = SignedArea(rough) > 0;  // as seen, y down: left of the way is outside
  std::array<Line, 4> lines;
  BorderFit fit;
  fit.support = 1;
  for (int k = 0; k < 4; ++k) {
    const std::optional<Line> line =
        FitLine(grey, rough[k], rough[(k + 1) % 4], clockwise, options);
    if (!line) return std::nullopt;
    lines[k] = *line;
    fit.support = std::min(fit.support, line->support);
  }
  for (int k = 0; k < 4; ++k) {
    const Line &before = lines[(k + 3) % 4], &after = lines[k];
    Eigen::Matrix2d normals;
    normals << before.outward.transpose(), after.outward.transpose();
    if (std::abs(normals.determinant()) < kLeastSine) return std::nullopt;
    const Eigen::Matrix2d inverse = normals.inverse();
    fit.corners[k] = inverse * Eigen::Vector2d(before.outward.dot(before.middle),
                                               after.outward.dot(after.middle));
    const Eigen::Vector2d variances(before.VarianceAt(fit.corners[k]),
                                    after.VarianceAt(fit.corners[k]));
    fit.variance_px2[k] = 0.5 * (inverse * variances.asDiagonal() * inverse.transpose()).trace();
  }
  return fit;
}

}  // namespace

std::optional<BorderFit> FitBorder(const cv::Mat& grey, const std::array<Eigen::Vector2d, 4>& rough,
                                   const BorderFitOptions& options) {
  if (grey.empty() || grey.type() != CV_8UC1) return std::nullopt;
  for (int k = 0; k < 4; ++k) {
    if (!rough[k].allFinite() || !Inside(grey, rough[k])) return std::nullopt;
    if ((rough[(k + 1) % 4] - rough[k]).norm() < 2 * kLeastSamples) return std::nullopt;
  }
  const std::optional<BorderFit> first = FitOnce(grey, rough, options);
  if (!first) return std::nullopt;
  BorderFitOptions closer = options;
  closer.reach_px = std::min(options.reach_px, 1.5);
  return FitOnce(grey, first->corners, closer);
}

}  // namespace saccade
