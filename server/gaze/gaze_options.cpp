#include "server/gaze/gaze_options.hpp"

#include <absl/strings/str_cat.h>

#include <toml.hpp>
#include <variant>

namespace saccade {
namespace {

using O = GazeOptions;
struct Key {
  const char* name;
  std::variant<double O::*, bool O::*> field;
  double least, most;
};
const Key kKeys[] = {
    {"rate_deg_s", &O::rate_deg_s, 0.1, 3600},
    {"acceleration_deg_s2", &O::acceleration_deg_s2, 1, 1e5},
    {"gain_per_s", &O::gain_per_s, 0.5, 50},
    {"fast_gain_per_s", &O::fast_gain_per_s, 0.5, 100},
    {"park_rate_deg_s", &O::park_rate_deg_s, 0.1, 3600},
    {"compensate_latency", &O::compensate_latency, 0, 1},
    {"servo_lag_s", &O::servo_lag_s, 0, 0.5},
    {"pose_window_s", &O::pose_window_s, 0.03, 1},
    {"pose_stale_s", &O::pose_stale_s, 0.05, 10},
    {"insist_s", &O::insist_s, 0.05, 60},
    {"suspend_above_deg_s", &O::suspend_above_deg_s, 1, 1e5},
    {"arrived_deg", &O::arrived_deg, 0.05, 20},
    {"arrived_s", &O::arrived_s, 0, 10},
    {"not_following_deg", &O::not_following_deg, 0.5, 90},
    {"not_following_s", &O::not_following_s, 0.05, 10},
    {"min_target_distance_m", &O::min_target_distance_m, 1e-3, 10},
    {"max_target_distance_m", &O::max_target_distance_m, 0.1, 1e6},
    {"heartbeat_s", &O::heartbeat_s, 0.1, 60},
    {"queue_silence_s", &O::queue_silence_s, 0.5, 3600},
    {"turn_grace_s", &O::turn_grace_s, 0.1, 60},
    {"explore_when_idle", &O::explore_when_idle, 0, 1},
    {"explore_dwell_s", &O::explore_dwell_s, 0.1, 60},
};

absl::Status CheckKey(const GazeOptions& options, const Key& key) {
  const double value =
      std::visit([&](auto field) { return static_cast<double>(options.*field); }, key.field);
  if (value >= key.least && value <= key.most) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "gaze.", key.name, ": ", value, "; give a number from ", key.least, " to ", key.most));
}

absl::Status SetKey(const std::string& name, const toml::value& value, GazeOptions& options) {
  for (const Key& key : kKeys) {
    if (name != key.name) continue;
    if (const auto* number = std::get_if<double O::*>(&key.field)) {
      if (value.is_floating()) {
        options.*(*number) = value.as_floating();
      } else if (value.is_integer()) {
        options.*(*number) = static_cast<double>(value.as_integer());
      } else {
        return absl::InvalidArgumentError(absl::StrCat("gaze.", name, ": is not a number"));
      }
    } else if (value.is_boolean()) {
      options.*std::get<bool O::*>(key.field) = value.as_boolean();
    } else {
      return absl::InvalidArgumentError(absl::StrCat("gaze.", name, ": give true or false"));
    }
    return absl::OkStatus();
  }
  std::string known;
  for (const Key& key : kKeys) absl::StrAppend(&known, known.empty() ? "" : ", ", key.name);
  return absl::InvalidArgumentError(absl::StrCat("gaze.", name, ": unknown key; known: ", known));
}

}  // namespace

absl::Status GazeOptions::Validate() const {
  for (const Key& key : kKeys) {
    if (const absl::Status status = CheckKey(*this, key); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status GazeOptions::LoadToml(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    return absl::NotFoundError(absl::StrCat(file.string(), ": no such file; give one that exists"));
  }
  GazeOptions read = *this;
  try {
    const toml::value root = toml::parse(file.string());
    if (!root.contains("gaze")) return absl::OkStatus();
    absl::Status status = root.at("gaze").is_table()
                              ? absl::OkStatus()
                              : absl::InvalidArgumentError("gaze: is not a table");
    if (status.ok()) {
      for (const auto& [name, value] : root.at("gaze").as_table()) {
        if (status = SetKey(name, value, read); !status.ok()) break;
      }
    }
    if (status.ok()) status = read.Validate();
    if (!status.ok()) {
      return absl::Status(status.code(), absl::StrCat(file.string(), ": ", status.message()));
    }
  } catch (const std::exception& problem) {
    return absl::InvalidArgumentError(absl::StrCat(file.string(), ": ", problem.what()));
  }
  *this = read;
  return absl::OkStatus();
}

}  // namespace saccade
