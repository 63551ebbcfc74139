#pragma once

#include <string>

#include "server/markers/marker.hpp"

namespace saccade {

/// detections.csv: file, family, id, four corners [px], their variances [px^2].
inline constexpr char kSightingHeader[] =
    "file,family,id,x0,y0,x1,y1,x2,y2,x3,y3,variance0,variance1,variance2,variance3\n";
std::string SightingRow(const std::string& file, const MarkerSighting& sighting);

/// ",x0,y0,...,x3,y3"
std::string CornerColumns(const std::array<Eigen::Vector2d, 4>& corners);

}  // namespace saccade
