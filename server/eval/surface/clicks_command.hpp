#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "server/eval/commands.hpp"

namespace CLI {
class App;
}

namespace saccade {

struct ClicksArguments {
  std::string source;  // sim:...
  std::filesystem::path out;
  int count = 200;
  double late_s = 0.4;  // a click speaks of the frame this long before
  bool in_map = false;  // along a line of sight into the map, instead of a pixel of a frame
  bool surfaces = true;
  TrackerArguments tracker;
};

void AddClicks(CLI::App& app, ClicksArguments& arguments);

/// Clicks on random pixels of a simulated run, objects and walls alike, and compares where each
/// mark lies with what that pixel really shows: clicks.csv and a report, which is printed.
absl::Status ClicksCommand(const ClicksArguments& arguments);

}  // namespace saccade
