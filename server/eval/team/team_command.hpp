#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace saccade {

struct TeamArguments {
  std::vector<std::filesystem::path> datasets;  // one, or two recordings
  std::vector<std::string> frames;              // of each of two: A:B; none: all
  std::filesystem::path out;
  std::vector<std::string> set;  // team.key=value; of trackers: key=value
  int foreign_pairs = 0;         // instead of recordings: rooms that are not to be merged
  std::uint64_t seed = 1;
  bool json = false;
};

/// Many in one filter: robots that see each other, or static cameras and a wand; or two recordings
/// whose maps find each other. DIR/report.json and a trajectory of each thing that moves.
absl::Status TeamCommand(const TeamArguments& arguments);

}  // namespace saccade
