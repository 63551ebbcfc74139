#include "server/sim/sim_options.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <cmath>
#include <string>

namespace saccade {
namespace {

constexpr const char* kKeys =
    "seed, motion, duration, noise, blur, auto_exposure, exposure_ms, width, height, fps, lens, "
    "supersampling";

absl::Status Bad(const std::string& key, const std::string& value, const char* allowed) {
  return absl::InvalidArgumentError(
      absl::StrCat("source sim: ", key, "=", value, " is not allowed; give ", allowed));
}

absl::Status SetSwitch(const std::string& key, const std::string& value, bool& out) {
  if (value != "on" && value != "off") return Bad(key, value, "on or off");
  out = value == "on";
  return absl::OkStatus();
}

absl::Status SetNumber(const std::string& key, const std::string& value, double& out) {
  if (!absl::SimpleAtod(value, &out) || !std::isfinite(out)) return Bad(key, value, "a number");
  return absl::OkStatus();
}

absl::Status SetInteger(const std::string& key, const std::string& value, int& out) {
  if (!absl::SimpleAtoi(value, &out)) return Bad(key, value, "a whole number");
  return absl::OkStatus();
}

absl::Status SetMotion(const std::string& value, SimMotion& out) {
  if (value == "desk") {
    out = SimMotion::kDesk;
  } else if (value == "sway") {
    out = SimMotion::kSway;
  } else if (value == "walk") {
    out = SimMotion::kWalk;
  } else if (value == "turn") {
    out = SimMotion::kTurn;
  } else if (value == "still") {
    out = SimMotion::kStill;
  } else if (value == "stand") {
    out = SimMotion::kStand;
  } else if (value == "rock") {
    out = SimMotion::kRock;
  } else if (value == "roll") {
    out = SimMotion::kRoll;
  } else if (value == "stroll") {
    out = SimMotion::kStroll;
  } else if (value == "twist") {
    out = SimMotion::kTwist;
  } else {
    return Bad("motion", value,
               "desk, sway, walk, turn, still, stand, rock, roll, stroll or twist");
  }
  return absl::OkStatus();
}

absl::Status SetLens(const std::string& value, LensModel& out) {
  if (value != "pinhole" && value != "brown_conrady") {
    return Bad("lens", value, "pinhole or brown_conrady");
  }
  out = value == "pinhole" ? LensModel::kPinhole : LensModel::kBrownConrady;
  return absl::OkStatus();
}

absl::Status SetOption(const std::string& key, const std::string& value, SimOptions& options) {
  if (key == "seed") {
    if (!absl::SimpleAtoi(value, &options.seed)) return Bad(key, value, "a whole number >= 0");
    return absl::OkStatus();
  }
  if (key == "duration") return SetNumber(key, value, options.duration_s.emplace());
  if (key == "exposure_ms") {
    const absl::Status set = SetNumber(key, value, options.exposure_s);
    options.exposure_s *= 1e-3;
    return set;
  }
  if (key == "motion") return SetMotion(value, options.motion);
  if (key == "noise") return SetNumber(key, value, options.noise);
  if (key == "blur") return SetSwitch(key, value, options.blur);
  if (key == "auto_exposure") return SetSwitch(key, value, options.auto_exposure);
  if (key == "width") return SetInteger(key, value, options.width);
  if (key == "height") return SetInteger(key, value, options.height);
  if (key == "fps") return SetNumber(key, value, options.fps);
  if (key == "lens") return SetLens(value, options.lens);
  if (key == "supersampling") return SetNumber(key, value, options.supersampling);
  return absl::InvalidArgumentError(
      absl::StrCat("source sim: unknown key '", key, "'; the keys are ", kKeys));
}

absl::Status InRange(const char* key, double value, double low, double high) {
  if (value >= low && value <= high) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("source sim: ", key, "=", value, " is outside ", low, " .. ", high));
}

}  // namespace

absl::Status SimOptions::Validate() const {
  for (const absl::Status& status :
       {InRange("duration", duration_s.value_or(1), 0, 86400), InRange("noise", noise, 0, 40),
        InRange("exposure_ms", exposure_s * 1e3, 0, 30), InRange("width", width, 64, 1920),
        InRange("height", height, 48, 1080), InRange("fps", fps, 1, 240),
        InRange("supersampling", supersampling, 1, 4)}) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::StatusOr<SimOptions> SimOptions::FromUri(std::string_view uri) {
  const std::string text(uri);
  const std::pair<std::string, std::string> parts = absl::StrSplit(text, absl::MaxSplits('?', 1));
  if (parts.first != "sim:desk") {
    return absl::InvalidArgumentError(absl::StrCat(
        "source ", text, ": the simulator knows one place; give sim:desk[?key=value&...]"));
  }
  SimOptions options;
  for (const auto& piece : absl::StrSplit(parts.second, '&', absl::SkipEmpty())) {
    const std::pair<std::string, std::string> item = absl::StrSplit(piece, absl::MaxSplits('=', 1));
    if (const absl::Status set = SetOption(item.first, item.second, options); !set.ok()) return set;
  }
  if (const absl::Status valid = options.Validate(); !valid.ok()) return valid;
  return options;
}

CameraIntrinsics SimOptions::Intrinsics() const {
  CameraIntrinsics camera;
  camera.model = lens;
  camera.width = width;
  camera.height = height;
  camera.fx = 458.0 * width / 640.0;
  camera.fy = camera.fx * 1.002;
  // A real sensor is never quite centred.
  camera.cx = 0.5 * (width - 1) + 3.3 * width / 640.0;
  camera.cy = 0.5 * (height - 1) - 2.1 * width / 640.0;
  if (lens == LensModel::kBrownConrady) camera.distortion = {-0.09, 0.035, 0.0006, -0.0004, 0.0};
  camera.fps = fps;
  return camera;
}

}  // namespace saccade
