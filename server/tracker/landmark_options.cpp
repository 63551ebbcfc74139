#include "server/tracker/landmark_options.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>

#include "shared/io/toml_table.hpp"

namespace saccade {
namespace {

constexpr double kLargest_m = 5.0;

}  // namespace

std::vector<std::string> LandmarkOptions::Keys() {
  return {"mode", "detector", "family", "size_m", "file", "live"};
}

absl::Status LandmarkOptions::Validate() const {
  if (mode != "fused" && mode != "koller" && mode != "off") {
    return absl::InvalidArgumentError(
        absl::StrCat("landmarks.mode: '", mode, "'; give fused, koller or off"));
  }
  if (!(size_m >= 0.0 && size_m <= kLargest_m)) {
    return absl::InvalidArgumentError(absl::StrCat("landmarks.size_m: ", size_m,
                                                   "; give the side of the black border, 0 to ",
                                                   kLargest_m, " m"));
  }
  if (mode == "koller" && file.empty()) {
    return absl::InvalidArgumentError(
        "landmarks.mode koller needs landmarks.file, the map of the squares");
  }
  if (mode != "off" && family.empty() != (size_m == 0.0)) {
    return absl::InvalidArgumentError(
        "landmarks.family and landmarks.size_m go together: squares of unknown place are mapped "
        "where their family and their side are given");
  }
  return absl::OkStatus();
}

absl::Status LandmarkOptions::Set(absl::string_view key, absl::string_view value) {
  const std::string text(value);
  if (key == "mode") {
    mode = text;
  } else if (key == "detector") {
    detector = text;
  } else if (key == "family") {
    family = text;
  } else if (key == "file") {
    file = text;
  } else if (key == "size_m") {
    if (!absl::SimpleAtod(value, &size_m)) {
      return absl::InvalidArgumentError(
          absl::StrCat("landmarks.size_m: '", text, "' is not a length in metres"));
    }
  } else if (key == "live") {
    if (!absl::SimpleAtob(value, &live)) {
      return absl::InvalidArgumentError(
          absl::StrCat("landmarks.live: '", text, "' is not true or false"));
    }
  } else {
    return absl::InvalidArgumentError(absl::StrCat(
        "landmarks option '", key, "' does not exist; known: ", absl::StrJoin(Keys(), ", ")));
  }
  return absl::OkStatus();
}

absl::Status LandmarkOptions::LoadToml(const std::filesystem::path& config) {
  const auto read = [](TomlTable& table, LandmarkOptions& options) {
    std::string map = options.file.string();
    table.Text("mode", options.mode);
    table.Text("detector", options.detector);
    table.Text("family", options.family);
    table.Number("size_m", 1.0, options.size_m);
    table.Text("file", map);
    table.Boolean("live", options.live);
    options.file = map;
  };
  LandmarkOptions changed = *this;
  if (const absl::Status read_all = LoadTomlTable(config, "landmarks", read, changed);
      !read_all.ok()) {
    return read_all;
  }
  if (changed.file != file && changed.file.is_relative()) {
    changed.file = config.parent_path() / changed.file;
  }
  *this = changed;
  return absl::OkStatus();
}

std::string LandmarkOptions::Describe() {
  return "[landmarks]\n"
         "mode = \"fused\"        # squares and natural features in one filter; koller: squares "
         "alone; off\n"
         "detector = \"apriltag\" # or aruco\n"
         "family = \"\"           # of squares whose place is not known, e.g. apriltag36h11\n"
         "size_m = 0.0          # side of these; with it the map is in metres\n"
         "file = \"\"             # map of known squares: [[square]] family, id, side_m, "
         "middle_m,\n"
         "                      # rotation_xyzw\n"
         "live = true           # a late detection is used later; false: it is waited for\n";
}

absl::StatusOr<SquareMap> LoadSquares(const LandmarkOptions& options) {
  if (options.file.empty()) return SquareMap();
  return LoadSquareMap(options.file);
}

absl::StatusOr<std::unique_ptr<MarkerDetector>> MakeDetector(const LandmarkOptions& options,
                                                             const SquareMap& map) {
  MarkerOptions what;
  if (!options.family.empty()) what.families.push_back(options.family);
  for (const KnownSquare& square : map.squares) {
    if (std::ranges::find(what.families, square.family) == what.families.end()) {
      what.families.push_back(square.family);
    }
  }
  return MakeMarkerDetector(options.detector, what);
}

}  // namespace saccade
