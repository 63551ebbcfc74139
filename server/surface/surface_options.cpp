#include "server/surface/surface_options.hpp"

#include <absl/strings/str_cat.h>

namespace saccade {
namespace {

absl::Status Within(const char* name, double value, double least, double most) {
  if (value >= least && value <= most) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("surfaces.", name, "=", value, ": give ", least, " to ", most));
}

}  // namespace

absl::Status SurfaceOptions::Validate() const {
  for (const absl::Status& status : {
           Within("width_px", width_px, 40, 640),
           Within("max_keyframes", max_keyframes, 4, 2000),
           Within("views", views, 2, 12),
           Within("fewest_views", fewest_views, 2, views),
           Within("planes", planes, 16, 250),
           Within("farthest_inverse", farthest_inverse, 0.0, 0.9 * nearest_inverse),
           Within("nearest_inverse", nearest_inverse, 0.5, 100.0),
           Within("voxel_m", voxel_m, 0.002, 0.2),
           Within("voxel_share", voxel_share, 0.001, 0.1),
           Within("truncation_voxels", truncation_voxels, 1.0, 8.0),
           Within("max_blocks", static_cast<double>(max_blocks), 100, 1e6),
       }) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace saccade
