#pragma once

#include <array>
#include <string>
#include <vector>

#include "shared/geometry/rigid3.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

using Polyline3 = std::vector<Eigen::Vector3d>;  // in world [m]

// docs/design/marks.md and overlay.md define all of it; the page follows them too.

/// The lines of one annotation's shape in world, as seen from a camera (a picture faces it).
std::vector<Polyline3> ShapeLines(const Annotation& annotation,
                                  const Rigid3& world_from_camera = {});

/// Where the label stands, in world [m].
Eigen::Vector3d LabelPoint(const Annotation& annotation, const Rigid3& world_from_camera = {});

/// What the label says, without "do not trust". `metric`: the map has metres.
std::string LabelWords(const Annotation& annotation, bool metric = true);

/// "347 ± 4 mm", "2.35 ± 0.02 m"; without metres "0.347 ± 0.004, no scale".
std::string MeasureText(double length_m, double sigma_m, bool metric);

/// Of a picture, in world [m]: lower left, lower right, upper right, upper left, as seen.
std::array<Eigen::Vector3d, 4> PictureCorners(const Annotation& annotation,
                                              const Rigid3& world_from_camera);

}  // namespace saccade
