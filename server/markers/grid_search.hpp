#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "server/markers/marker.hpp"
#include "server/markers/tag_family.hpp"
#include "server/markers/tag_grid.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"

namespace saccade {

/// The grid in one picture.
struct GridView {
  std::vector<MarkerSighting> sightings;  // of its tags, by id
  Rigid3 camera_from_grid;
  double rms_px = 0;  // of their corners
};

/// The second step of Koller et al. (VRST 1997, section 4.1): from the tags that a detector read
/// the sheet's pose, from that pose where the others must be, and there the search for their
/// corners; a tag counts if its code, read at these corners, is its own. A reading that does not
/// fit is left out. Nothing where fewer than two tags agree.
std::optional<GridView> SearchGrid(const cv::Mat& grey, const CameraModel& camera,
                                   const TagGrid& grid, const TagFamily& family,
                                   const std::vector<MarkerSighting>& read);

}  // namespace saccade
