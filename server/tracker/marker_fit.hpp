#pragma once

#include <optional>
#include <span>
#include <string>

#include "server/markers/marker.hpp"
#include "server/tracker/square_pose.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// A square as seen from a camera whose pose the tracker knows.
struct MarkerView {
  Timestamp time_ns = 0;
  Rigid3 world_from_camera;
  MarkerSighting sighting;
};

/// Where a square is, by all its views together.
struct MarkerFit {
  Rigid3 world_from_marker;
  double metre = 1.0;            // in units of the map; 1 unless it was asked for
  double log_metre_sigma = 0.0;  // of that
  double rms_px = 0.0;
  Matrix6d covariance = Matrix6d::Zero();  // [position (world), rotation (local)]
};

struct MarkerFitOptions {
  bool metric = true;  // the map is in metres; false: what a metre is in it is sought as well
  double sigma_px = 0.5;
  int fewest_views = 5;
  /// Cost of the mirrored pose beyond the better one's, of sigma_px^2: camera poses are shared by
  /// all views, so that it must be well above chance.
  double least_evidence = 40.0;
  double most_rms_px = 1.5;
};

/// Places a square of unknown place with the motion of the camera, which tells the two poses of a
/// flat thing apart that one picture cannot (slam-spec 7). Both are fitted to all views; nothing
/// while they still explain them about as well, or too few views are there.
std::optional<MarkerFit> FitMarker(const CameraModel& camera, std::span<const MarkerView> views,
                                   double side_m, const MarkerFitOptions& options);

}  // namespace saccade
