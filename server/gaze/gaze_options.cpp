#include "server/gaze/gaze_options.hpp"

#include <absl/strings/str_cat.h>

#include "shared/io/option_table.hpp"
#include "shared/io/toml_table.hpp"

namespace saccade {
namespace {

const OptionTable<GazeOptions>& Table() {
  using O = GazeOptions;
  static const OptionTable<O> table = {
      {"rate_deg_s", &O::rate_deg_s, 0.1, 3600, "per axis, on the way to a target"},
      {"acceleration_deg_s2", &O::acceleration_deg_s2, 1, 1e5, "to that rate"},
      {"gain_per_s", &O::gain_per_s, 0.5, 50, "closes the last degrees; higher: quicker, noisier"},
      {"fast_gain_per_s", &O::fast_gain_per_s, 0.5, 100, "of fast saccades"},
      {"park_rate_deg_s", &O::park_rate_deg_s, 0.1, 3600, "home, when the pilot vanished"},
      {"compensate_latency", &O::compensate_latency, 0, 1, "aim where the wearer will be"},
      {"servo_lag_s", &O::servo_lag_s, 0, 0.5, "to the motion, beyond mount_model's latency"},
      {"pose_window_s", &O::pose_window_s, 0.03, 1, "over which the wearer's motion is fitted"},
      {"pose_stale_s", &O::pose_stale_s, 0.05, 10, "without a believed pose: the head rests"},
      {"insist_s", &O::insist_s, 0.05, 60, "a pose that cannot be is believed after so long"},
      {"suspend_above_deg_s", &O::suspend_above_deg_s, 1, 1e5, "of the head: poses are not used"},
      {"arrived_deg", &O::arrived_deg, 0.05, 20, "error below this ..."},
      {"arrived_s", &O::arrived_s, 0, 10, "... for so long is arrival"},
      {"not_following_deg", &O::not_following_deg, 0.5, 90, "error of a joint above this ..."},
      {"not_following_s", &O::not_following_s, 0.05, 10, "... for so long is a fault"},
      {"min_target_distance_m", &O::min_target_distance_m, 1e-3, 10, "from the optic centre"},
      {"max_target_distance_m", &O::max_target_distance_m, 0.1, 1e6, "from the wearer"},
      {"heartbeat_s", &O::heartbeat_s, 0.1, 60, "silence after which a pilot is gone"},
      {"queue_silence_s", &O::queue_silence_s, 0.5, 3600, "... and one who waits"},
      {"wearer_silence_s", &O::wearer_silence_s, 1, 3600, "... and a wearer without a stream"},
      {"turn_grace_s", &O::turn_grace_s, 0.1, 60, "for the next in the queue to notice his turn"},
      {"explore_when_idle", &O::explore_when_idle, 0, 1, "look where the map is least certain"},
      {"explore_dwell_s", &O::explore_dwell_s, 0.1, 60, "at each such place"},
  };
  return table;
}

}  // namespace

absl::Status GazeOptions::Validate() const { return Table().Validate(*this, "gaze."); }

absl::Status GazeOptions::LoadToml(const std::filesystem::path& file) {
  return LoadTomlTable(
      file, "gaze", [](TomlTable& table, GazeOptions& options) { Table().Read(table, options); },
      *this);
}

std::string GazeOptions::Describe() {
  return absl::StrCat("[gaze]\n", Table().Describe(GazeOptions()));
}

}  // namespace saccade
