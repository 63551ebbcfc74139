#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <string>
#include <vector>

namespace saccade {

/// What one picture came to.
struct FigureResult {
  std::string file;
  int squares = 0;         // of the room's, that were read in it
  double position_mm = 0;  // of the camera by them, off the truth
  double angle_deg = 0;
  double light = 0;  // confidence of where it comes from
};

/// Remakes figures 6 and 7 of Koller et al. (VRST 1997). Each picture is a rendered room with
/// Koller's squares; the camera's place is found by `koller`'s sightings in it and nothing else,
/// the light by their paper, and what is virtual is drawn from there as the augmented view draws
/// it. Writes DIR/1-....jpg to DIR/8-....jpg and returns what each came to. NotFound: a picture in
/// which the squares did not tell the camera's place.
absl::StatusOr<std::vector<FigureResult>> RunFigures(const std::filesystem::path& out);

}  // namespace saccade
