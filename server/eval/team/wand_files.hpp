#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <map>
#include <vector>

#include "server/eval/trajectory.hpp"
#include "server/team/wand_start.hpp"

namespace saccade {

/// Static cameras that see a wand with tags: cameras.yaml (`camN: {camera_model, distortion_model,
/// distortion_coeffs, intrinsics, resolution}`), wand_tags.csv (tag, wand_from_tag; the side in a
/// comment "tag side 0.12 m"), detections.csv (time, camera, tag, four corners), and to judge by,
/// where they are, reference_wand.tum and reference_cameras.csv.
struct WandData {
  std::vector<CameraModel> lenses;
  WandBody body;
  std::vector<Timestamp> times_ns;  // of the instants, rising
  std::vector<TagSight> sights;     // in order of time
  Trajectory reference_wand;        // may be empty
  std::map<int, Rigid3> reference_cameras;
};

/// `side_m`: of the tags, above 0 instead of what wand_tags.csv says. Errors name file, line or
/// field, and remedy.
absl::StatusOr<WandData> LoadWand(const std::filesystem::path& folder, double side_m);

}  // namespace saccade
