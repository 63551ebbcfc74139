#include "server/markers/grid_search.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>

#include "server/markers/corner_fit.hpp"

namespace saccade {
namespace {

constexpr int kRounds = 3;
constexpr double kLoose_px = 5.0;  // of corners a detector read
constexpr double kFits_px = 2.0;   // of corners against the pose of all
constexpr int kLeastTags = 2;
constexpr int kTrials = 2000;
constexpr double kLeastSide_px = 9.0;
constexpr double kEdge_px = 5.0;
constexpr int kMostWrongBits = 5;  // 36h11 differ in eleven
constexpr double kLeastGridContrast = 20;

using Corners = std::map<int, std::array<Eigen::Vector2d, 4>>;

struct Posed {
  Rigid3 camera_from_grid;
  std::vector<int> outliers;  // tags with a corner that does not fit
  double rms_px = 0;
};

std::optional<std::array<Eigen::Vector2d, 4>> Predict(const CameraModel& camera,
                                                      const TagGrid& grid, int id,
                                                      const Rigid3& camera_from_grid) {
  std::array<Eigen::Vector2d, 4> pixels;
  const std::array<Eigen::Vector3d, 4> corners = grid.Corners(id);
  for (int k = 0; k < 4; ++k) {
    const auto pixel = camera.Project(camera_from_grid * corners[k]);
    if (!pixel || !camera.InImage(*pixel, kEdge_px)) return std::nullopt;
    pixels[k] = *pixel;
  }
  return pixels;
}

/// Pose of the sheet from the corners, robustly.
std::optional<Posed> Pose(const CameraModel& camera, const TagGrid& grid, const Corners& corners,
                          double most_px) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (const auto& [id, pixels] : corners) {
    const std::array<Eigen::Vector3d, 4> on = grid.Corners(id);
    for (int k = 0; k < 4; ++k) {
      const auto bearing = camera.Unproject(pixels[k]);
      if (!bearing || bearing->z() < 0.1) continue;
      points.emplace_back(on[k].x(), on[k].y(), on[k].z());
      rays.emplace_back(bearing->x() / bearing->z(), bearing->y() / bearing->z());
    }
  }
  if (points.size() < 4 * kLeastTags) return std::nullopt;
  // The sheet is flat: between it and the rays is a homography, whichever of them are right.
  std::vector<cv::Point2d> on_sheet;
  for (const cv::Point3d& point : points) on_sheet.emplace_back(point.x, point.y);
  cv::theRNG().state = 1;  // the same picture, the same pose
  std::vector<std::uint8_t> fits;
  const cv::Mat homography = cv::findHomography(
      on_sheet, rays, cv::RANSAC, most_px * camera.RadiansPerPixel(), fits, kTrials, 0.9999);
  if (homography.empty()) return std::nullopt;
  std::vector<cv::Point3d> used_points;
  std::vector<cv::Point2d> used_rays;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (fits[k] == 0) continue;
    used_points.push_back(points[k]);
    used_rays.push_back(rays[k]);
  }
  if (used_points.size() < 4 * kLeastTags) return std::nullopt;
  cv::Vec3d rotation, translation;
  const cv::Matx33d identity = cv::Matx33d::eye();
  try {
    if (!cv::solvePnP(used_points, used_rays, identity, {}, rotation, translation, false,
                      cv::SOLVEPNP_IPPE)) {
      return std::nullopt;
    }
    cv::solvePnPRefineLM(used_points, used_rays, identity, {}, rotation, translation);
  } catch (const cv::Exception&) {  // points on a line
    return std::nullopt;
  }
  cv::Matx33d turn;
  cv::Rodrigues(rotation, turn);
  Eigen::Matrix3d matrix;
  cv::cv2eigen(turn, matrix);
  Posed posed;
  posed.camera_from_grid = Rigid3(Eigen::Quaterniond(matrix),
                                  Eigen::Vector3d(translation[0], translation[1], translation[2]));
  double squares = 0;
  int count = 0;
  for (const auto& [id, pixels] : corners) {
    const auto predicted = Predict(camera, grid, id, posed.camera_from_grid);
    double worst = predicted ? 0 : 1e9;
    for (int k = 0; predicted && k < 4; ++k) {
      worst = std::max(worst, ((*predicted)[k] - pixels[k]).norm());
    }
    if (worst > most_px) {
      posed.outliers.push_back(id);
      continue;
    }
    for (int k = 0; k < 4; ++k) squares += ((*predicted)[k] - pixels[k]).squaredNorm();
    count += 4;
  }
  if (count < 4 * kLeastTags) return std::nullopt;
  posed.rms_px = std::sqrt(squares / count);
  return posed;
}

/// Bits of `id`'s code that read otherwise at these corners; nothing where there is no contrast.
std::optional<int> WrongBits(const cv::Mat& grey, const TagFamily& family, int id,
                             const std::array<Eigen::Vector2d, 4>& corners) {
  const auto cells = static_cast<float>(family.cells());
  // From the code's own axes, x right and y down, to the order of the corners.
  const std::array<cv::Point2f, 4> from = {{{0, cells}, {cells, cells}, {cells, 0}, {0, 0}}};
  std::array<cv::Point2f, 4> to;
  for (int k = 0; k < 4; ++k) to[k] = cv::Point2f(cv::Point2d(corners[k].x(), corners[k].y()));
  const cv::Mat warp = cv::getPerspectiveTransform(from.data(), to.data());
  const std::vector<TagFamily::Bit> bits = family.Bits(id);
  std::vector<cv::Point2f> places, pixels;
  for (const TagFamily::Bit& bit : bits) places.emplace_back(bit.column + 0.5F, bit.row + 0.5F);
  const std::size_t coded = places.size();
  for (float k = 0.5F; k < cells; ++k) {  // the border, all dark
    for (const cv::Point2f& place : {cv::Point2f(k, 0.5F), cv::Point2f(k, cells - 0.5F),
                                     cv::Point2f(0.5F, k), cv::Point2f(cells - 0.5F, k)}) {
      places.push_back(place);
    }
  }
  cv::perspectiveTransform(places, pixels, warp);
  std::vector<double> values;
  for (const cv::Point2f& pixel : pixels) {
    cv::Mat value;
    cv::getRectSubPix(grey, {1, 1}, pixel, value);
    values.push_back(value.at<std::uint8_t>(0, 0));
  }
  const double dark =
      std::accumulate(values.begin() + static_cast<std::ptrdiff_t>(coded), values.end(), 0.0) /
      static_cast<double>(values.size() - coded);
  const double bright =
      *std::max_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(coded));
  if (bright - dark < kLeastGridContrast) return std::nullopt;
  int wrong = 0;
  for (std::size_t k = 0; k < coded; ++k) {
    wrong += (values[k] > 0.5 * (dark + bright)) != bits[k].bright;
  }
  return wrong;
}

/// The tag where it must be; nothing if it is not to be seen there.
std::optional<MarkerSighting> LookFor(const cv::Mat& grey, const TagFamily& family, int id,
                                      const std::array<Eigen::Vector2d, 4>& predicted) {
  MarkerSighting sighting;
  sighting.family = family.name();
  sighting.id = id;
  sighting.corners = predicted;
  const double side = ShortestSide(sighting);
  if (side < kLeastSide_px) return std::nullopt;
  for (int k = 0; k < 4; ++k) {
    const std::optional<CornerFit> fit = FitCorner(grey, predicted[k], CornerReach(side));
    if (!fit) return std::nullopt;
    sighting.corners[k] = fit->pixel;
    sighting.variance_px2[k] = fit->variance_px2;
  }
  const std::optional<int> wrong = WrongBits(grey, family, id, sighting.corners);
  if (!wrong || *wrong > kMostWrongBits) return std::nullopt;
  sighting.corrected_bits = *wrong;
  return sighting;
}

}  // namespace

std::optional<GridView> SearchGrid(const cv::Mat& grey, const CameraModel& camera,
                                   const TagGrid& grid, const TagFamily& family,
                                   const std::vector<MarkerSighting>& read) {
  Corners corners;
  for (const MarkerSighting& sighting : read) {
    if (sighting.family == family.name() && grid.Holds(sighting.id)) {
      corners[sighting.id] = sighting.corners;
    }
  }
  std::optional<GridView> view;
  double most_px = kLoose_px;
  for (int round = 0; round < kRounds; ++round) {
    std::optional<Posed> posed = Pose(camera, grid, corners, most_px);
    if (!posed) return view;
    GridView next;
    next.camera_from_grid = posed->camera_from_grid;
    for (int id = 0; id < grid.tags(); ++id) {
      const auto predicted = Predict(camera, grid, id, posed->camera_from_grid);
      if (!predicted) continue;
      if (auto sighting = LookFor(grey, family, id, *predicted)) {
        next.sightings.push_back(*std::move(sighting));
      }
    }
    corners.clear();
    for (const MarkerSighting& sighting : next.sightings) corners[sighting.id] = sighting.corners;
    most_px = kFits_px;
    posed = Pose(camera, grid, corners, most_px);
    if (!posed) return view;
    std::erase_if(next.sightings, [&](const MarkerSighting& sighting) {
      corners.erase(sighting.id);
      return std::find(posed->outliers.begin(), posed->outliers.end(), sighting.id) !=
             posed->outliers.end();
    });
    for (const MarkerSighting& sighting : next.sightings) corners[sighting.id] = sighting.corners;
    next.camera_from_grid = posed->camera_from_grid;
    next.rms_px = posed->rms_px;
    view = std::move(next);
  }
  return view;
}

}  // namespace saccade
