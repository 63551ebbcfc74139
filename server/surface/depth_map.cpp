#include "server/surface/depth_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "server/surface/semi_global.hpp"

namespace saccade {
namespace {

constexpr int kDepthPeak = 2;         // planes that belong to one minimum
constexpr int kDepthBorder = 3;       // of the picture, where windows end [px]
constexpr float kSeenThrough = 3;     // times what counts as agreement
constexpr int kFringe = 3;            // half a window and one [px]
constexpr float kFringeStep = 0.92f;  // of inverse depth, across the edge of a thing
constexpr int kLeastPatch = 12;       // pixels in one piece

/// Inverse depth at the minimum of the sums; 0 where it does not stand out.
float PickPlane(const CostVolume& volume, const std::uint8_t* costs, const std::uint16_t* sums,
                const SurfaceOptions& options) {
  const int planes = volume.planes.count;
  const int best = static_cast<int>(std::min_element(sums, sums + planes) - sums);
  if (best == 0 || best == planes - 1) return 0.0f;
  const auto most = static_cast<int>(CostVolume::kUnrelated * (1.0 - options.least_correlation));
  if (costs[best] > most) return 0.0f;
  const double rival = sums[best] * (1.0 + options.least_lead) + 8.0;
  for (int k = 0; k < planes; ++k) {
    if (std::abs(k - best) > kDepthPeak && sums[k] < rival) return 0.0f;
  }
  const float a = sums[best - 1], b = sums[best], c = sums[best + 1];
  const float curve = a - 2.0f * b + c;
  const float shift = curve > 0.0f ? std::clamp(0.5f * (a - c) / curve, -0.5f, 0.5f) : 0.0f;
  return volume.planes.first + (static_cast<float>(best) + shift) * volume.planes.step;
}

/// Takes out what lies just before something farther: a window that holds the edge of a near thing
/// shows its depth also beside it.
void RemoveFringes(cv::Mat& inverse_depth) {
  const cv::Mat known = inverse_depth > 0.0f;
  cv::Mat farthest = inverse_depth.clone(), nearby;
  farthest.setTo(std::numeric_limits<float>::max(), ~known);
  cv::erode(farthest, nearby,
            cv::getStructuringElement(cv::MORPH_RECT, {2 * kFringe + 1, 2 * kFringe + 1}));
  inverse_depth.setTo(0.0f, nearby < kFringeStep * inverse_depth);
}

/// Takes out pieces of a few pixels that their surroundings do not share.
void RemoveSpecks(cv::Mat& inverse_depth, float tolerance) {
  const int width = inverse_depth.cols, height = inverse_depth.rows;
  std::vector<std::uint8_t> done(static_cast<std::size_t>(width) * height, 0);
  std::vector<int> piece;
  for (int start = 0; start < width * height; ++start) {
    if (done[start] != 0 || inverse_depth.at<float>(start / width, start % width) <= 0.0f) continue;
    piece.assign(1, start);
    done[start] = 1;
    for (std::size_t next = 0; next < piece.size(); ++next) {
      const int x = piece[next] % width, y = piece[next] / width;
      const float own = inverse_depth.at<float>(y, x);
      constexpr int kSides[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
      for (const auto& [dx, dy] : kSides) {
        const int nx = x + dx, ny = y + dy;
        if (nx < 0 || ny < 0 || nx >= width || ny >= height) continue;
        const float other = inverse_depth.at<float>(ny, nx);
        if (done[ny * width + nx] != 0 || other <= 0.0f || std::abs(other - own) > tolerance) {
          continue;
        }
        done[ny * width + nx] = 1;
        piece.push_back(ny * width + nx);
      }
    }
    if (piece.size() >= kLeastPatch) continue;
    for (const int each : piece) inverse_depth.at<float>(each / width, each % width) = 0.0f;
  }
}

}  // namespace

double DepthMap::KnownShare() const {
  return static_cast<double>(cv::countNonZero(inverse_depth)) /
         std::max<std::size_t>(1, inverse_depth.total());
}

DepthMap FindDepth(const SurfacePicture& reference, std::span<const SweepView> views,
                   const SweepPlanes& planes, const SurfaceOptions& options) {
  const CostVolume volume = SweepViews(reference, views, planes);
  const std::vector<std::uint16_t> sums =
      SumSemiGlobally(volume, reference.grey, SmoothnessOptions());
  DepthMap depth{reference.camera, cv::Mat::zeros(volume.height, volume.width, CV_32F)};
  for (int y = kDepthBorder; y < volume.height - kDepthBorder; ++y) {
    for (int x = kDepthBorder; x < volume.width - kDepthBorder; ++x) {
      if (volume.deviation.at<float>(y, x) < options.least_deviation) continue;
      const std::uint8_t* costs = volume.At(x, y);
      depth.inverse_depth.at<float>(y, x) =
          PickPlane(volume, costs, sums.data() + (costs - volume.costs.data()), options);
    }
  }
  RemoveFringes(depth.inverse_depth);
  RemoveSpecks(depth.inverse_depth, 1.5f * planes.step);
  return depth;
}

DepthMap KeepConfirmed(const DepthMap& depth, float length_factor,
                       std::span<const OtherDepth> others, const SurfaceOptions& options) {
  DepthMap kept{depth.camera, cv::Mat::zeros(depth.inverse_depth.size(), CV_32F)};
  const auto tolerance = static_cast<float>(options.agree_share);
  struct Turned {
    const OtherDepth* other;
    Eigen::Matrix3f turn;
    Eigen::Vector3f shift;
  };
  std::vector<Turned> turned;
  for (const OtherDepth& other : others) {
    turned.push_back({&other, other.other_from_this.RotationMatrix().cast<float>(),
                      other.other_from_this.translation.cast<float>()});
  }
  for (int y = 0; y < depth.camera.height; ++y) {
    for (int x = 0; x < depth.camera.width; ++x) {
      const float inverse = depth.inverse_depth.at<float>(y, x);
      if (inverse <= 0.0f) continue;
      const Eigen::Vector3f point = depth.camera.Ray(static_cast<float>(x), static_cast<float>(y)) *
                                    (length_factor / inverse);
      int agree = 0, against = 0;
      for (const Turned& each : turned) {
        const Eigen::Vector3f there = each.turn * point + each.shift;
        if (there.z() <= 0.0f) continue;
        const Pinhole& camera = each.other->depth->camera;
        const float scale = camera.focal_px / there.z();
        const float seen =
            each.other->depth->At(static_cast<int>(std::lround(there.x() * scale + camera.cx)),
                                  static_cast<int>(std::lround(there.y() * scale + camera.cy))) /
            each.other->length_factor;
        if (seen <= 0.0f) continue;
        const float off = seen * there.z() - 1.0f;  // below 0: it sees farther
        if (std::abs(off) < tolerance) ++agree;
        if (off < -kSeenThrough * tolerance) ++against;
      }
      if (agree >= options.fewest_agreeing && 2 * against <= agree) {
        kept.inverse_depth.at<float>(y, x) = inverse;
      }
    }
  }
  return kept;
}

}  // namespace saccade
