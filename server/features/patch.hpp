#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>

#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// What a feature looked like when it was born: the pixels around its birth pixel. About 1.8 KB.
///
/// Pixels outside `valid` (beyond the picture's border, or beyond a smaller given template) are
/// never sampled. The pose of the birth camera is state of the filter and therefore not kept here.
struct PatchTemplate {
  static constexpr int kSize = 41;  // [px], odd
  static constexpr int kHalf = kSize / 2;

  std::array<std::uint8_t, kSize * kSize> pixels{};          // row major
  Eigen::Vector2d birth_pixel = Eigen::Vector2d::Zero();     // of the feature, sub-pixel
  Eigen::Vector3d birth_bearing = Eigen::Vector3d::UnitZ();  // unit, in the birth camera
  /// The feature in template pixels: kHalf plus the fraction that birth_pixel was cut at.
  Eigen::Vector2d centre_in_template = Eigen::Vector2d(kHalf, kHalf);
  cv::Rect valid;                             // within [0, kSize) x [0, kSize)
  std::shared_ptr<const CameraModel> camera;  // lens of the birth view

  std::uint8_t at(int x, int y) const { return pixels[y * kSize + x]; }
};

/// Cuts the template of the feature at `pixel` of `grey` (CV_8UC1, seen through `camera`).
/// InvalidArgument: not 8-bit grey, pixel not finite or not invertible by the lens; OutOfRange:
/// less than 8 px of picture around it on any side.
absl::StatusOr<PatchTemplate> CutPatch(const cv::Mat& grey, const Eigen::Vector2d& pixel,
                                       const std::shared_ptr<const CameraModel>& camera);

/// Makes a template of a picture given from elsewhere (a printed target's patch): `templ` is a
/// CV_8UC1 square of odd side 7 to 41, taken to show the surroundings of `pixel` as seen by
/// `camera`.
absl::StatusOr<PatchTemplate> PatchFromImage(const cv::Mat& templ, const Eigen::Vector2d& pixel,
                                             const std::shared_ptr<const CameraModel>& camera);

/// A small square of predicted appearance, ready for correlation. Rows are 16 wide, zero-padded.
struct CorrelationTemplate {
  static constexpr int kMaxSize = 15;
  static constexpr int kStride = 16;
  int size = 0;  // odd; 0: not there
  alignas(32) std::array<std::int16_t, kMaxSize * kStride> pixels{};
  std::int32_t sum = 0;
  std::int64_t sum_squared = 0;
  /// Standard deviation of the pixels [grey levels].
  double Deviation() const;
  /// Recomputes the sums from the pixels.
  void Finish();
};

/// Predicted appearance of a feature in the current view; its centre is the feature itself.
struct WarpedPatch {
  CorrelationTemplate fine;  // full resolution, options.size px
  CorrelationTemplate
      coarse;          // half resolution, 9 px (about 18 px of the picture); size 0: no room
  double scale = 1.0;  // size now / size at birth
  double view_angle_rad = 0.0;  // between the two viewing rays at the point
};

enum class WarpStatus {
  kOk,
  kNotInView,   // behind either camera, or outside the invertible lens
  kTooOblique,  // view angle, or grazing angle on the surface
  kScale,       // outside [1 / max_scale, max_scale]
  kOutside,     // would need pixels that the template does not have
  kLowTexture,  // standard deviation below min_deviation
  kBadInput,    // non-finite numbers, inverse depth below zero
};
const char* ToString(WarpStatus status);

struct WarpOptions {
  int size = 11;                      // side of the fine template [px], odd, 7 to 15
  double max_scale = 2.0;             // and its inverse (slam-spec 5.1)
  double max_view_angle_rad = 1.047;  // 60 deg, allowed with warping (slam-spec 5.2)
  double max_grazing_rad = 1.31;      // 75 deg between viewing ray and surface normal
  double min_deviation = 10.0;        // grey levels (slam-spec 5.1)
  bool coarse = true;                 // also make the half-resolution template
};

/// Predicts how `patch` looks through `camera` from the current pose. Allocation-free, about 2 us.
///
/// The surface at the point is a plane through it with unit normal `normal_in_birth` (pointing
/// towards the birth camera; zero: facing the birth camera, i.e. -bearing). Each pixel of the
/// result is carried through rays of both lenses, not through a pixel homography, so wide lenses
/// are exact to second order over the patch (the map is evaluated on a 3 x 3 grid and interpolated
/// by a biquadratic).
///
/// `current_from_birth`: birth camera to current camera. `bearing_in_birth`: unit; usually the
/// filter's own, which may differ from patch.birth_bearing by its corrections (the warp is centred
/// on patch.birth_pixel whatever it says). `inverse_depth`: 1 / range from the birth camera [1/m],
/// >= 0 (0: infinitely far). `predicted_pixel`: where the result is centred, usually the projection
/// of the point. On any status but kOk `warped` is unspecified.
WarpStatus WarpPatch(const PatchTemplate& patch, const Rigid3& current_from_birth,
                     const Eigen::Vector3d& bearing_in_birth, double inverse_depth,
                     const Eigen::Vector3d& normal_in_birth, const CameraModel& camera,
                     const Eigen::Vector2d& predicted_pixel, const WarpOptions& options,
                     WarpedPatch& warped);

/// The template as it is, unwarped (for comparison, and for features seen from where they were
/// born).
WarpStatus CopyPatch(const PatchTemplate& patch, const WarpOptions& options, WarpedPatch& warped);

}  // namespace saccade
