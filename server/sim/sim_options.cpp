#include "server/sim/sim_options.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace saccade {
namespace {

constexpr const char* kKeys =
    "seed, motion, duration, noise, blur, auto_exposure, exposure_ms, width, height, fps, lens, "
    "supersampling, real, vignetting, lens_error_px, rolling_shutter_ms, jitter_ms, jpeg, "
    "contrast, softness_px, arm, start";

struct NumberKey {
  const char* name;
  double SimOptions::*field;
  double unit;  // of the field, that one of the key is
  double low, high;
};

// In the key's own unit.
constexpr NumberKey kNumbers[] = {
    {"noise", &SimOptions::noise, 1, 0, 40},
    {"exposure_ms", &SimOptions::exposure_s, 1e-3, 0, 30},
    {"fps", &SimOptions::fps, 1, 1, 240},
    {"supersampling", &SimOptions::supersampling, 1, 1, 4},
    {"vignetting", &SimOptions::vignetting, 1, 0, 0.9},
    {"lens_error_px", &SimOptions::lens_error_px, 1, -10, 10},
    {"rolling_shutter_ms", &SimOptions::rolling_shutter_s, 1e-3, 0, 33},
    {"jitter_ms", &SimOptions::jitter_s, 1e-3, 0, 10},
    {"contrast", &SimOptions::contrast, 1, 0.05, 1},
    {"softness_px", &SimOptions::softness_px, 1, 0, 5},
};

std::uint64_t Mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// Box-Muller on our own bits: the standard library's distributions differ between makers.
double StandardNormal(std::uint64_t seed, std::uint64_t index) {
  const std::uint64_t bits = Mix(Mix(seed) + index);
  const double a = (static_cast<double>(bits >> 40) + 0.5) * 0x1.0p-24;
  const double b = static_cast<double>(bits & 0xffffff) * 0x1.0p-24;
  return std::sqrt(-2.0 * std::log(a)) * std::cos(2.0 * std::numbers::pi * b);
}

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

absl::Status SetExposure(const std::string& value, SimExposure& out) {
  if (value == "off") {
    out = SimExposure::kOff;
  } else if (value == "on") {
    out = SimExposure::kDrift;
  } else if (value == "scene") {
    out = SimExposure::kScene;
  } else {
    return Bad("auto_exposure", value, "on, off or scene");
  }
  return absl::OkStatus();
}

absl::Status SetStart(const std::string& value, SimStart& out) {
  if (value != "rest" && value != "turn") return Bad("start", value, "rest or turn");
  out = value == "rest" ? SimStart::kRest : SimStart::kTurn;
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
  for (const NumberKey& number : kNumbers) {
    if (key != number.name) continue;
    const absl::Status set = SetNumber(key, value, options.*number.field);
    options.*number.field *= number.unit;
    return set;
  }
  if (key == "motion") return SetMotion(value, options.motion);
  if (key == "blur") return SetSwitch(key, value, options.blur);
  if (key == "auto_exposure") return SetExposure(value, options.auto_exposure);
  if (key == "arm") return SetSwitch(key, value, options.arm);
  if (key == "start") return SetStart(value, options.start);
  if (key == "jpeg") return SetInteger(key, value, options.jpeg);
  if (key == "width") return SetInteger(key, value, options.width);
  if (key == "height") return SetInteger(key, value, options.height);
  if (key == "lens") return SetLens(value, options.lens);
  if (key == "real") {  // FromUri has set it before all others
    bool real = false;
    return SetSwitch(key, value, real);
  }
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
       {InRange("duration", duration_s.value_or(1), 0, 86400), InRange("width", width, 64, 1920),
        InRange("height", height, 48, 1080), InRange("jpeg", jpeg, 0, 100)}) {
    if (!status.ok()) return status;
  }
  for (const NumberKey& number : kNumbers) {
    const absl::Status status =
        InRange(number.name, this->*number.field / number.unit, number.low, number.high);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

void SimOptions::MakeReal() {
  noise = 2.0;
  exposure_s = 0.012;
  auto_exposure = SimExposure::kScene;
  vignetting = 0.25;
  lens_error_px = 1.0;
  rolling_shutter_s = 0.013;
  jitter_s = 0.0026;
  jpeg = 85;
  contrast = 0.9;
  softness_px = 0.4;
  arm = true;
  start = SimStart::kTurn;
}

absl::StatusOr<SimOptions> SimOptions::FromUri(std::string_view uri) {
  const std::string text(uri);
  const std::pair<std::string, std::string> parts = absl::StrSplit(text, absl::MaxSplits('?', 1));
  if (parts.first != "sim:desk") {
    return absl::InvalidArgumentError(absl::StrCat(
        "source ", text, ": the simulator knows one place; give sim:desk[?key=value&...]"));
  }
  SimOptions options;
  const std::vector<std::string> pieces = absl::StrSplit(parts.second, '&', absl::SkipEmpty());
  // First, wherever it stands: single keys then say what is different.
  if (std::find(pieces.begin(), pieces.end(), "real=on") != pieces.end()) options.MakeReal();
  for (const std::string& piece : pieces) {
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

CameraIntrinsics SimOptions::TrueIntrinsics() const {
  CameraIntrinsics camera = Intrinsics();
  if (lens_error_px == 0.0) return camera;
  const double corner_px = std::hypot(0.5 * width, 0.5 * height);
  const double corner = corner_px / camera.fx;  // tangent of the angle to the axis
  const double half = 0.5 * lens_error_px;
  const double zoom = 1.0 + half / corner_px;
  camera.fx *= zoom;
  camera.fy *= zoom;
  if (camera.model == LensModel::kPinhole) {
    camera.model = LensModel::kBrownConrady;
    camera.distortion = {0.0, 0.0, 0.0, 0.0, 0.0};
  }
  camera.distortion[0] += half / (camera.fx * corner * corner * corner);
  return camera;
}

double SimOptions::TimeOf(std::uint64_t frame) const {
  const double even = static_cast<double>(frame) / fps;
  if (jitter_s <= 0.0 || frame == 0) return even;
  // Neighbours keep their order, and half an interval between them at least.
  const double late =
      std::clamp(jitter_s * StandardNormal(seed ^ 0x717e, frame), -0.25 / fps, 0.25 / fps);
  return even + late;
}

}  // namespace saccade
