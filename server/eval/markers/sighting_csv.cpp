#include "server/eval/markers/sighting_csv.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

namespace saccade {

std::string CornerColumns(const std::array<Eigen::Vector2d, 4>& corners) {
  std::string columns;
  for (const Eigen::Vector2d& corner : corners) {
    absl::StrAppendFormat(&columns, ",%.4f,%.4f", corner.x(), corner.y());
  }
  return columns;
}

std::string SightingRow(const std::string& file, const MarkerSighting& sighting) {
  std::string row =
      absl::StrCat(file, ",", sighting.family, ",", sighting.id, CornerColumns(sighting.corners));
  for (const double variance : sighting.variance_px2) {
    absl::StrAppendFormat(&row, ",%.6g", variance);
  }
  return row + "\n";
}

}  // namespace saccade
