#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string_view>

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// What the simulated wearer does (README.md describes each).
enum class SimMotion { kDesk, kSway, kWalk, kTurn, kStill, kStand, kRock, kRoll, kStroll, kTwist };

/// `sim:desk?key=value&...`. Every key is optional.
struct SimOptions {
  std::uint64_t seed = 1;  // seed: textures, small differences of the room, motion, noise
  SimMotion motion = SimMotion::kDesk;        // motion: desk sway walk ... (README.md)
  std::optional<double> duration_s;           // duration: frames end after it; absent: never
  double noise = 1.5;                         // noise: sigma at mid grey [grey levels]; 0: none
  bool blur = true;                           // blur: motion blur of the exposure, on or off
  bool auto_exposure = true;                  // auto_exposure: gain drifts and breathes, on or off
  double exposure_s = 0.008;                  // exposure_ms: 0 .. 30
  int width = 640, height = 480;              // width, height [px]; the field of view stays
  double fps = 30.0;                          // fps
  LensModel lens = LensModel::kBrownConrady;  // lens: pinhole, brown_conrady
  double supersampling = 1.15;  // supersampling: drawn pixels per camera pixel, 1 .. 4

  /// Parses a whole source URI. InvalidArgument names the key and what it may be.
  static absl::StatusOr<SimOptions> FromUri(std::string_view uri);
  absl::Status Validate() const;

  /// The camera these options describe: 70 degrees wide, mild barrel distortion.
  CameraIntrinsics Intrinsics() const;
};

}  // namespace saccade
