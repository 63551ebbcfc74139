#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/markers/marker_detector.hpp"
#include "server/markers/square_map.hpp"

namespace saccade {

/// What tracking does with square markers: the [landmarks] table.
struct LandmarkOptions {
  /// "fused": squares and natural features in one filter; "koller": squares alone (Koller 1997);
  /// "off".
  std::string mode = "fused";
  std::string detector = "apriltag";  // or aruco
  std::string family;                 // of squares whose place is not known; empty: none are sought
  double size_m = 0.0;                // side of these; 0: none are sought
  std::filesystem::path file;         // map of known squares (server/markers/square_map.hpp)
  /// Live: a picture is looked at on another thread, and used when that is done; false: it is
  /// waited for, so that a run repeats.
  bool live = false;

  /// Squares are sought at all.
  bool wanted() const {
    return mode != "off" && (!file.empty() || (!family.empty() && size_m > 0));
  }
  /// InvalidArgument names the key and what it may be.
  absl::Status Validate() const;
  /// `--set landmarks.key=value`.
  absl::Status Set(absl::string_view key, absl::string_view value);
  /// Reads the [landmarks] table over the present values. Errors as TrackerOptions::LoadToml.
  absl::Status LoadToml(const std::filesystem::path& file);
  static std::vector<std::string> Keys();
  /// The table with its defaults, for people.
  static std::string Describe();
};

/// The map of `options.file`; empty without one. Errors as LoadSquareMap.
absl::StatusOr<SquareMap> LoadSquares(const LandmarkOptions& options);
/// What sees these and the family of unknown ones. Errors as MakeMarkerDetector.
absl::StatusOr<std::unique_ptr<MarkerDetector>> MakeDetector(const LandmarkOptions& options,
                                                             const SquareMap& map);

}  // namespace saccade
