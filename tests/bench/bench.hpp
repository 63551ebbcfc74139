#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <array>
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

struct MapBenchArguments {
  double way_m = 72.0;           // walked round a corridor before the pictures that count
  double walk_s = 8.0;           // of walking that are timed...
  double stand_s = 10.0;         // ...and of standing, the first 2 of which are not
  std::uint64_t seed = 1;        // of the corridor
  int runs = 3;                  // the least time of each frame counts
  std::vector<std::string> set;  // tracker options, key=value
  std::filesystem::path config;  // TOML file of tracker options
};

/// The filter alone on a room of points, every feature measured in every update (slam-spec T42).
absl::StatusOr<TimingReport> BenchFilter(const FilterBenchArguments& arguments);
/// One patch, searched narrowly and widely; corners; on a picture full of texture.
absl::StatusOr<TimingReport> BenchSearch(const SearchBenchArguments& arguments);
/// The whole tracker on pictures that were made or decoded before.
absl::StatusOr<TimingReport> BenchFrame(const FrameBenchArguments& arguments);
/// How long a tracker has been here: some seconds, once round the corridor, all the time.
enum MapAge { kYoung, kMiddle, kOld, kMaps };

/// The same pictures, tracked with maps of different size.
struct MapComparison {
  std::string name;                       // walking, standing
  std::array<double, kMaps> landmarks{};  // medians
  std::vector<bool> compared;             // frames that all of them tracked
  std::array<Sample, kMaps> frame_ms;     // of those: Track() and the anchors, processor time
  Eigen::Vector3d last_positions = Eigen::Vector3d::Zero();  // summed: equal in every run

  /// What the old map costs over a younger one.
  double Ratio(MapAge from, double percentile) const;
};

struct MapBenchResult {
  TimingReport report;
  std::vector<MapComparison> comparisons;
};

/// The whole tracker on the same pictures: with a map of a hundred landmarks, of hundreds, and of
/// thousands, nearly all of them at rest (slam-spec T17).
absl::StatusOr<MapBenchResult> CompareMaps(const MapBenchArguments& arguments);
absl::StatusOr<TimingReport> BenchMap(const MapBenchArguments& arguments);

}  // namespace saccade
