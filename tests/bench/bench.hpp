#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/bench/timing_report.hpp"

namespace saccade {

struct FilterBenchArguments {
  std::vector<int> features = {50, 100, 150};
  std::string form = "both";  // sid, esid or both
  int updates = 600;          // that are timed, after the first 120
  int repeats = 3;            // of the whole run; the least time of each update counts
};

struct SearchBenchArguments {
  int repeats = 60;  // of each patch; the least time counts
};

struct FrameBenchArguments {
  std::filesystem::path dataset;  // a recording; empty: the simulator
  std::string source = "desk?duration=20";
  int runs = 3;                      // the least time of each frame counts
  std::vector<std::string> set;      // tracker options, key=value
  std::filesystem::path config;      // TOML file of tracker options
  std::filesystem::path frames_csv;  // where each frame's times go, if anywhere
};

/// The filter alone on a room of points, every feature measured in every update (slam-spec T42).
absl::StatusOr<TimingReport> BenchFilter(const FilterBenchArguments& arguments);
/// One patch, searched narrowly and widely; corners; on a picture full of texture.
absl::StatusOr<TimingReport> BenchSearch(const SearchBenchArguments& arguments);
/// The whole tracker on pictures that were made or decoded before.
absl::StatusOr<TimingReport> BenchFrame(const FrameBenchArguments& arguments);

}  // namespace saccade
