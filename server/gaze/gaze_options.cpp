#include "server/gaze/gaze_options.hpp"

#include <absl/strings/str_cat.h>

#include <variant>

#include "server/mount/toml_table.hpp"

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
    {"wearer_silence_s", &O::wearer_silence_s, 1, 3600},
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

void ReadGaze(TomlTable& table, GazeOptions& options) {
  for (const Key& key : kKeys) {
    if (const auto* number = std::get_if<double O::*>(&key.field)) {
      table.Number(key.name, 1.0, options.*(*number));
    } else {
      table.Boolean(key.name, options.*std::get<bool O::*>(key.field));
    }
  }
}

}  // namespace

absl::Status GazeOptions::Validate() const {
  for (const Key& key : kKeys) {
    if (const absl::Status status = CheckKey(*this, key); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status GazeOptions::LoadToml(const std::filesystem::path& file) {
  return LoadTomlTable(file, "gaze", ReadGaze, *this);
}

}  // namespace saccade
