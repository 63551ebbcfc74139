#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string>

#include "server/markers/marker_pattern.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// What lies on, before or in the way of the square of a render.
enum class RenderKind {
  kPlain,
  kBlurred,
  kShadow,         // an edge of shadow across it
  kGlare,          // a reflection on it
  kBorderCovered,  // something over a part of one side of its border, none of its cells
  kCodeCovered,    // something over cells: it need not be found, but not be taken for another
  kAtOneMetre,     // plain, and just there
};
inline constexpr int kRenderKinds = 7;
const char* Word(RenderKind kind);
/// Nothing of the square is covered.
inline bool WhollyVisible(RenderKind kind) {
  return kind != RenderKind::kBorderCovered && kind != RenderKind::kCodeCovered;
}

inline constexpr double kRenderSide_m = 0.1;
inline constexpr double kRenderFocal_px = 600;

/// One square of 10 cm on a cluttered wall, seen by a pinhole camera, with what is true of it.
struct SquareRender {
  cv::Mat color;  // CV_8UC3, BGR
  RenderKind kind = RenderKind::kPlain;
  std::array<Eigen::Vector2d, 4> corners;  // as a sighting's [px]
  Rigid3 camera_from_marker;               // marker: x right, y down, from the square's middle
  double side_px = 0;                      // if it were seen from the front at its distance
  double tilt_rad = 0;                     // between its normal and the ray to it
};

/// Render number `index` of `seed`, the same each time: 5 to 60 deg of tilt, 20 to 200 px a side,
/// each uniformly, any turn about the normal, noise of 5 grey levels a channel.
SquareRender RenderSquare(const MarkerPattern& pattern, std::uint64_t seed, int index);

/// The camera that they are seen by.
const CameraModel& RenderCamera();

}  // namespace saccade
