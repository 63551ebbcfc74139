#include "server/eval/markers/render_score.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <optional>

namespace saccade {
namespace {

constexpr std::array kShortest_px = {0, 10, 15, 20, 40, 80};
constexpr std::array kTilt_deg = {0, 20, 40};
// A sighting is the square's own if each corner is this near, beside a share of its side.
constexpr double kNear_px = 3, kNearOfSide = 0.1;
constexpr double kDegrees = 180 / std::numbers::pi;

template <std::size_t n>
int Bin(const std::array<int, n>& bounds, double value) {
  return *(std::upper_bound(bounds.begin(), bounds.end(), value) - 1);
}

double Percentile(std::vector<double> values, double percent) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::size_t>(0.01 * percent * (values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[at];
}

double Mean(const std::vector<double>& values) {
  return values.empty() ? 0 : std::accumulate(values.begin(), values.end(), 0.0) / values.size();
}

double ShortestOf(const SquareRender& truth) {
  MarkerSighting sighting;
  sighting.corners = truth.corners;
  return ShortestSide(sighting);
}

/// From the corners alone: of the two poses of a square the one that fits them better, refined.
std::optional<Rigid3> PoseOf(const MarkerSighting& sighting, const SquareRender& truth) {
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> image;
  const Rigid3 marker_from_camera = truth.camera_from_marker.Inverse();
  for (int k = 0; k < 4; ++k) {
    // The corner's own place on the marker, by its number.
    const Eigen::Vector3d ray = *RenderCamera().Unproject(truth.corners[k]);
    const Eigen::Vector3d way = marker_from_camera.rotation * ray;
    const Eigen::Vector3d eye = marker_from_camera.translation;
    const Eigen::Vector3d at = eye - eye.z() / way.z() * way;
    object.emplace_back(at.x(), at.y(), 0);
    image.emplace_back(sighting.corners[k].x(), sighting.corners[k].y());
  }
  const CameraIntrinsics& lens = RenderCamera().intrinsics();
  const cv::Matx33d matrix(lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1);
  cv::Vec3d turn, shift;
  if (!cv::solvePnP(object, image, matrix, cv::noArray(), turn, shift, false, cv::SOLVEPNP_IPPE)) {
    return std::nullopt;
  }
  cv::solvePnPRefineLM(object, image, matrix, cv::noArray(), turn, shift);
  return Rigid3{ExpQuaternion({turn[0], turn[1], turn[2]}), {shift[0], shift[1], shift[2]}};
}

}  // namespace

void RenderScore::MeasureCorners(const SquareRender& truth, const MarkerSighting& sighting) {
  const double shortest = ShortestOf(truth);
  for (int k = 0; k < 4; ++k) {
    const double error = (sighting.corners[k] - truth.corners[k]).norm();
    const double nees = error * error / sighting.variance_px2[k];
    nees_by_kind_[truth.kind].push_back(nees);
    if (!WhollyVisible(truth.kind)) continue;
    error_px_.push_back(error);
    nees_.push_back(nees);
    nees_by_shortest_[Bin(kShortest_px, shortest)].push_back(nees);
  }
  if (truth.kind != RenderKind::kAtOneMetre) return;
  const std::optional<Rigid3> pose = PoseOf(sighting, truth);
  if (!pose) return;
  const Rigid3& real = truth.camera_from_marker;
  at_1_m_mm_.push_back(1e3 * (pose->translation - real.translation).norm());
  at_1_m_deg_.push_back(kDegrees * RotationAngle(*pose, real));
}

void RenderScore::Add(const SquareRender& truth, const std::string& family, int id,
                      const std::vector<MarkerSighting>& sightings, double detector_ms) {
  ++renders_;
  ms_.push_back(detector_ms);
  const double shortest = ShortestOf(truth);
  const MarkerSighting* own = nullptr;
  for (const MarkerSighting& sighting : sightings) {
    bool right = own == nullptr && sighting.family == family && sighting.id == id;
    for (int k = 0; k < 4 && right; ++k) {
      right = (sighting.corners[k] - truth.corners[k]).norm() < kNear_px + kNearOfSide * shortest;
    }
    if (right) {
      own = &sighting;
    } else {
      ++wrong_;
    }
  }
  by_kind_[truth.kind].Count(own != nullptr);
  if (WhollyVisible(truth.kind)) {
    visible_.Count(own != nullptr);
    by_shortest_[Bin(kShortest_px, shortest)].Count(own != nullptr);
    by_tilt_[Bin(kTilt_deg, kDegrees * truth.tilt_rad)].Count(own != nullptr);
  }
  if (own != nullptr) MeasureCorners(truth, *own);
}

double RenderScore::BorderCoveredFound() const {
  const auto covered = by_kind_.find(RenderKind::kBorderCovered);
  return covered == by_kind_.end() ? 0 : covered->second.Share();
}

double RenderScore::Nees() const { return Mean(nees_); }

nlohmann::ordered_json RenderScore::Json(const Tally& tally) {
  return {{"renders", tally.there}, {"found", tally.found}, {"share", tally.Share()}};
}

nlohmann::ordered_json RenderScore::Report() const {
  nlohmann::ordered_json report;
  report["renders"] = renders_;
  report["wrong_ids"] = wrong_;
  report["detection_wholly_visible"] = Json(visible_);
  nlohmann::ordered_json kinds, sides, tilts;
  for (const auto& [kind, tally] : by_kind_) {
    kinds[Word(kind)] = Json(tally);
    const auto nees = nees_by_kind_.find(kind);
    if (nees != nees_by_kind_.end()) kinds[Word(kind)]["nees_mean"] = Mean(nees->second);
  }
  for (const auto& [bound, tally] : by_shortest_) {
    nlohmann::ordered_json& side = sides["from_" + std::to_string(bound) + "_px"];
    side = Json(tally);
    const auto nees = nees_by_shortest_.find(bound);
    if (nees != nees_by_shortest_.end()) side["nees_mean"] = Mean(nees->second);
  }
  for (const auto& [bound, tally] : by_tilt_) {
    tilts["from_" + std::to_string(bound) + "_deg"] = Json(tally);
  }
  report["by_kind"] = kinds;
  report["wholly_visible_by_shortest_side_in_picture"] = sides;
  report["wholly_visible_by_tilt"] = tilts;
  report["corners"] = {
      {"error_px_p50", Percentile(error_px_, 50)}, {"error_px_p95", Percentile(error_px_, 95)},
      {"error_px_p99", Percentile(error_px_, 99)}, {"nees_mean", Nees()},
      {"nees_p50", Percentile(nees_, 50)},         {"nees_p99", Percentile(nees_, 99)}};
  report["pose_at_1_m"] = {{"poses", at_1_m_mm_.size()},
                           {"error_mm_p50", Percentile(at_1_m_mm_, 50)},
                           {"error_mm_p95", Percentile(at_1_m_mm_, 95)},
                           {"error_deg_p50", Percentile(at_1_m_deg_, 50)},
                           {"error_deg_p95", Percentile(at_1_m_deg_, 95)}};
  report["detector_ms"] = {{"p50", Percentile(ms_, 50)}, {"p99", Percentile(ms_, 99)}};
  return report;
}

}  // namespace saccade
