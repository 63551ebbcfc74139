#pragma once

#include <absl/status/status.h>

#include <filesystem>
#include <string>
#include <vector>

namespace saccade {

struct TeamArguments {
  std::filesystem::path dataset, out;
  std::vector<std::string> set;  // team.key=value
  bool json = false;
};

/// Many in one filter: robots that see each other, or static cameras and a wand. DIR/report.json
/// and a trajectory of each thing that moves.
absl::Status TeamCommand(const TeamArguments& arguments);

}  // namespace saccade
