#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string_view>

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// What gain and white balance do.
enum class SimExposure { kOff, kDrift, kScene };
/// How the wearer begins: at rest before the chessboard, or turning towards it.
enum class SimStart { kRest, kTurn };

/// What the simulated wearer does (docs/configuration.md describes each).
enum class SimMotion { kDesk, kSway, kWalk, kTurn, kStill, kStand, kRock, kRoll, kStroll, kTwist };

/// `sim:desk?key=value&...`. Every key is optional.
struct SimOptions {
  std::uint64_t seed = 1;  // seed: textures, small differences of the room, motion, noise
  SimMotion motion = SimMotion::kDesk;  // motion: desk sway walk ... (configuration.md)
  std::optional<double> duration_s;     // duration: frames end after it; absent: never
  double noise = 1.5;                   // noise: sigma at mid grey [grey levels]; 0: none
  bool blur = true;                     // blur: motion blur of the exposure, on or off
  SimExposure auto_exposure = SimExposure::kDrift;  // auto_exposure: off; on: gain drifts and
                                                    // breathes; scene: it follows what is seen
  double exposure_s = 0.008;                        // exposure_ms: 0 .. 30
  int width = 640, height = 480;                    // width, height [px]; the field of view stays
  double fps = 30.0;                                // fps
  LensModel lens = LensModel::kBrownConrady;        // lens: pinhole, brown_conrady
  double supersampling = 1.15;  // supersampling: drawn pixels per camera pixel, 1 .. 4

  // What real pictures have (docs/measurements); `real=on` sets them all.
  double vignetting = 0.14;          // vignetting: light that the corners lose
  double lens_error_px = 0.0;        // lens_error_px: of the told calibration, in the corners
  double rolling_shutter_s = 0.0;    // rolling_shutter_ms: read-out, first row to last
  double jitter_s = 0.0;             // jitter_ms: sigma of a frame's time; its stamp is right
  int jpeg = 0;                      // jpeg: quality that pictures are compressed with; 0: not
  double contrast = 1.0;             // contrast: share that haze and stray light leave
  double softness_px = 0.0;          // softness_px: sigma of the lens's blur
  bool arm = false;                  // arm: the wearer's own reaches into the view now and then
  SimStart start = SimStart::kRest;  // start: rest, or turn

  /// Parses a whole source URI. InvalidArgument names the key and what it may be.
  static absl::StatusOr<SimOptions> FromUri(std::string_view uri);
  absl::Status Validate() const;

  /// The camera these options describe: 70 degrees wide, mild barrel distortion. This is what a
  /// tracker is told.
  CameraIntrinsics Intrinsics() const;
  /// The camera that takes the pictures: off by `lens_error_px` in the corners, half of it by focal
  /// length, half by radial distortion.
  CameraIntrinsics TrueIntrinsics() const;
  /// When frame `frame` is exposed (its middle) [s].
  double TimeOf(std::uint64_t frame) const;
  /// Sets everything to what was measured on real recordings (docs/measurements).
  void MakeReal();
};

}  // namespace saccade
