#include "server/tracker/square_pose.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

constexpr double kPoseSigma_px = 0.3;
constexpr double kWorstPose_px = 2.0;  // rms of the corners of a square that is where it is said
constexpr double kSamePoseAngle_rad = 0.05;
constexpr double kFloor_px = 0.05;  // below, residuals are noise of the detector

double Rms(const CameraModel& camera, const Rigid3& world_from_camera,
           const std::array<Eigen::Vector3d, 4>& points, const MarkerSighting& sighting) {
  const Rigid3 camera_from_world = world_from_camera.Inverse();
  double squares = 0.0;
  for (int k = 0; k < 4; ++k) {
    const auto pixel = camera.Project(camera_from_world * points[k]);
    if (!pixel) return 1e9;
    squares += (*pixel - sighting.corners[k]).squaredNorm();
  }
  return std::sqrt(0.25 * squares);
}

struct Known {
  const MarkerSighting* sighting;
  std::array<Eigen::Vector3d, 4> points;
};

/// Those of the map, each seen once.
std::vector<Known> KnownOnes(const std::vector<MarkerSighting>& sightings, const SquareMap& map) {
  std::vector<Known> known;
  for (const MarkerSighting& sighting : sightings) {
    const auto same = [&](const MarkerSighting& other) {
      return other.id == sighting.id && other.family == sighting.family;
    };
    const KnownSquare* square = map.Find(sighting.family, sighting.id);
    if (square == nullptr || std::ranges::count_if(sightings, same) != 1) continue;
    known.push_back({&sighting, square->CornersInWorld()});
  }
  return known;
}

/// Those whose corners are about where they are seen.
std::vector<std::size_t> Agreeing(const CameraModel& camera, const Rigid3& at,
                                  const std::vector<Known>& known, double worst_px) {
  std::vector<std::size_t> agreeing;
  for (std::size_t k = 0; k < known.size(); ++k) {
    if (Rms(camera, at, known[k].points, *known[k].sighting) <= worst_px) agreeing.push_back(k);
  }
  return agreeing;
}

std::optional<PoseFit> FitTo(const CameraModel& camera, const std::vector<Known>& known,
                             const std::vector<std::size_t>& which, const Rigid3& start) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (const std::size_t k : which) {
    points.insert(points.end(), known[k].points.begin(), known[k].points.end());
    pixels.insert(pixels.end(), known[k].sighting->corners.begin(),
                  known[k].sighting->corners.end());
  }
  PoseFitOptions options;
  options.sigma_px = kPoseSigma_px;
  const auto fit = FitPose(camera, points, pixels, start, options);
  if (!fit.ok()) return std::nullopt;
  return *fit;
}

}  // namespace

std::optional<SquarePose> PoseOfSquare(const CameraModel& camera, const MarkerSighting& sighting,
                                       double side_m) {
  const auto corners = SquareCorners(sighting.family, side_m);
  PoseFitOptions options;
  options.sigma_px = kPoseSigma_px;
  const auto fits = FitPlanarPose(camera, corners, sighting.corners, options);
  if (!fits.ok() || fits->empty() || fits->front().rms_px > kWorstPose_px) return std::nullopt;
  const PoseFit& best = fits->front();
  SquarePose pose{best.world_from_camera, best.world_from_camera, 1e3, best.rms_px,
                  best.covariance};
  if (fits->size() > 1 &&
      RotationAngle(best.world_from_camera, (*fits)[1].world_from_camera) > kSamePoseAngle_rad) {
    pose.other = (*fits)[1].world_from_camera;
    pose.ratio = std::max((*fits)[1].rms_px, kFloor_px) / std::max(best.rms_px, kFloor_px);
  }
  return pose;
}

std::optional<SquaresPose> PoseOfSquares(const CameraModel& camera,
                                         const std::vector<MarkerSighting>& sightings,
                                         const SquareMap& map) {
  const std::vector<Known> known = KnownOnes(sightings, map);
  std::vector<std::size_t> most;
  Rigid3 start;
  double least = 1e9;
  for (const Known& each : known) {
    const KnownSquare& square = *map.Find(each.sighting->family, each.sighting->id);
    const auto pose = PoseOfSquare(camera, *each.sighting, square.side_m);
    if (!pose) continue;
    std::vector<Rigid3> candidates = {square.world_from_square * pose->square_from_camera};
    // A lone square's mirror is tried as well, to be compared with; and never believed.
    candidates.push_back(square.world_from_square * pose->other);
    if (known.size() == 1 && !pose->sure()) return std::nullopt;
    for (const Rigid3& candidate : candidates) {
      // One square's corners fix the camera loosely: far squares may be off by degrees at first.
      Rigid3 at = candidate;
      std::vector<std::size_t> agreeing;
      for (const double worst_px : {12.0, 4.0, kWorstPose_px}) {
        agreeing = Agreeing(camera, at, known, worst_px);
        const auto fit = FitTo(camera, known, agreeing, at);
        if (fit) at = fit->world_from_camera;
      }
      agreeing = Agreeing(camera, at, known, kWorstPose_px);
      if (agreeing.empty()) continue;
      double sum = 0.0;
      for (const std::size_t k : agreeing) {
        sum += Rms(camera, at, known[k].points, *known[k].sighting);
      }
      const double mean = sum / static_cast<double>(agreeing.size());
      if (agreeing.size() > most.size() || (agreeing.size() == most.size() && mean < least)) {
        most = agreeing;
        start = at;
        least = mean;
      }
    }
  }
  if (most.empty() || (most.size() == 1 && known.size() > 1)) return std::nullopt;
  const auto fit = FitTo(camera, known, most, start);
  if (!fit || fit->rms_px > kWorstPose_px) return std::nullopt;
  return SquaresPose{*fit, static_cast<int>(most.size())};
}

}  // namespace saccade
