#include "tests/unit/server/anchors/synthetic_map.hpp"

#include <algorithm>
#include <cmath>

namespace saccade::testing {
namespace {

/// A rectangle: a corner and two edges [m]. World: y down, the camera looks along +z at first.
struct Patch {
  Eigen::Vector3d corner, u, v;
};

const std::vector<Patch>& Room() {
  static const std::vector<Patch> room = {
      {{-2, -1.3, 2.5}, {4, 0, 0}, {0, 2.5, 0}},       // back wall
      {{-2, -1.3, -1.5}, {0, 0, 4}, {0, 2.5, 0}},      // left wall
      {{2, -1.3, -1.5}, {0, 0, 4}, {0, 2.5, 0}},       // right wall
      {{-2, 1.2, -1.5}, {4, 0, 0}, {0, 0, 4}},         // floor
      {{-0.8, 0.45, 1.2}, {1.6, 0, 0}, {0, 0, 0.8}},   // desk top
      {{-0.8, 0.45, 1.2}, {1.6, 0, 0}, {0, 0.1, 0}},   // its front
      {{0.1, 0.15, 1.5}, {0.35, 0, 0}, {0, 0.3, 0}},   // box on it: front
      {{0.1, 0.15, 1.5}, {0.35, 0, 0}, {0, 0, 0.25}},  // top
      {{0.1, 0.15, 1.5}, {0, 0, 0.25}, {0, 0.3, 0}},   // side
  };
  return room;
}

}  // namespace

Rigid3 LookFrom(const Eigen::Vector3d& position, double yaw, double pitch) {
  return {ExpQuaternion({0, yaw, 0}) * ExpQuaternion({-pitch, 0, 0}), position};
}

SyntheticMap::SyntheticMap(const Options& options)
    : options_(options), random_(options.seed), metric_(options.metric) {
  CameraIntrinsics intrinsics;
  intrinsics.model = LensModel::kBrownConrady;
  intrinsics.width = 640;
  intrinsics.height = 480;
  intrinsics.fx = intrinsics.fy = 500;
  intrinsics.cx = 321.5;
  intrinsics.cy = 238.2;
  intrinsics.distortion = {-0.12, 0.05, 0.001, -0.0005, 0.0};
  camera_ = std::make_shared<const CameraModel>(intrinsics);
  Populate();
}

void SyntheticMap::Populate() {
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<double> areas;
  for (const Patch& patch : Room()) areas.push_back(patch.u.cross(patch.v).norm() + 0.3);
  std::discrete_distribution<std::size_t> pick(areas.begin(), areas.end());
  for (int i = 0; i < options_.features; ++i) {
    const std::size_t surface = pick(random_);
    const Patch& patch = Room()[surface];
    const Eigen::Vector3d truth = patch.corner + unit(random_) * patch.u + unit(random_) * patch.v;
    const double depth = truth.norm();
    const Eigen::Vector3d ray = truth / depth;
    const double across = options_.lateral_sigma_px / 500 * depth;
    const double along = options_.depth_sigma * depth;
    const Eigen::Matrix3d projector = ray * ray.transpose();
    const Eigen::Matrix3d covariance =
        along * along * projector + across * across * (Eigen::Matrix3d::Identity() - projector);
    const Eigen::Matrix3d root = covariance.llt().matrixL();
    features_.push_back(
        {next_id_++, truth, truth + root * Noise(1.0), covariance, 30, static_cast<int>(surface)});
  }
}

Eigen::Vector3d SyntheticMap::Noise(double sigma) {
  std::normal_distribution<double> normal(0, sigma);
  const double x = normal(random_), y = normal(random_), z = normal(random_);
  return {x, y, z};
}

std::optional<double> SyntheticMap::Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray,
                                        int* surface) const {
  std::optional<double> best;
  for (std::size_t i = 0; i < Room().size(); ++i) {
    const Patch& patch = Room()[i];
    Eigen::Matrix3d m;
    m << patch.u, patch.v, -ray;
    if (std::abs(m.determinant()) < 1e-9) continue;
    const Eigen::Vector3d s = m.inverse() * (origin - patch.corner);
    const bool hit = s(0) >= 0 && s(0) <= 1 && s(1) >= 0 && s(1) <= 1 && s(2) > 1e-3;
    if (!hit || (best && s(2) >= *best)) continue;
    best = s(2);
    if (surface) *surface = static_cast<int>(i);
  }
  return best;
}

std::optional<double> SyntheticMap::Raycast(const Eigen::Vector3d& origin,
                                            const Eigen::Vector3d& ray) const {
  return Hit(origin, ray, nullptr);
}

int SyntheticMap::NeighboursOnSurface(const Rigid3& true_pose, const Eigen::Vector2d& pixel,
                                      double radius_px) const {
  int clicked = -1, count = 0;
  Hit(true_pose.translation, true_pose.rotation * *camera_->Unproject(pixel), &clicked);
  for (const Feature& feature : features_) {
    const Eigen::Vector3d to = feature.truth - true_pose.translation;
    const std::optional<double> wall = Raycast(true_pose.translation, to.normalized());
    const std::optional<Eigen::Vector2d> at = camera_->Project(true_pose.Inverse() * feature.truth);
    const bool hidden = wall && *wall < to.norm() - 0.01;
    if (at && !hidden && (*at - pixel).norm() < radius_px && feature.surface == clicked) ++count;
  }
  return count;
}

std::shared_ptr<const MapSnapshot> SyntheticMap::Snapshot(const Rigid3& true_pose) {
  auto snapshot = std::make_shared<MapSnapshot>();
  snapshot->frame_id = next_frame++;
  snapshot->capture_time_ns = static_cast<Timestamp>(snapshot->frame_id) * 33'333'333;
  snapshot->status = status;
  snapshot->metric = metric_;
  snapshot->map_revision = revision_;
  snapshot->map_generation = generation_;
  const Rigid3 exact = estimate_from_truth_ * true_pose;
  snapshot->world_from_camera = {
      (exact.rotation * ExpQuaternion(Noise(options_.pose_sigma_rad))).normalized(),
      exact.translation + Noise(options_.pose_sigma_m)};
  snapshot->pose_covariance.diagonal()
      << Eigen::Vector3d::Constant(std::pow(options_.pose_sigma_m, 2)),
      Eigen::Vector3d::Constant(std::pow(options_.pose_sigma_rad, 2));
  const Rigid3 camera_from_world = snapshot->world_from_camera.Inverse();
  const Eigen::Matrix3d r = camera_from_world.RotationMatrix();
  for (const Feature& feature : features_) {
    FeatureSnapshot out;
    out.id = feature.id;
    out.point_in_world = feature.estimate;
    out.covariance_in_world = feature.covariance;
    const Eigen::Vector3d in_camera = camera_from_world * feature.estimate;
    Eigen::Matrix<double, 3, 6> j;
    j << -r, Skew(in_camera);
    out.covariance_in_camera =
        r * feature.covariance * r.transpose() + j * snapshot->pose_covariance * j.transpose();
    out.depth_known = std::sqrt(feature.covariance.trace()) < 0.1 * in_camera.norm();
    out.matched_count = feature.matched;
    const Eigen::Vector3d to = feature.truth - true_pose.translation;
    const std::optional<double> wall = Raycast(true_pose.translation, to.normalized());
    const bool hidden = wall && *wall < to.norm() - 0.01;
    const std::optional<Eigen::Vector2d> pixel = camera_->Project(in_camera);
    if (pixel && camera_->InImage(*pixel) && !hidden) {
      out.pixel = pixel;
      out.state = FeatureState::kMeasured;
    }
    snapshot->features.push_back(out);
  }
  last_ = snapshot;
  return last_;
}

void SyntheticMap::PushTo(FrameRing& ring) const {
  auto frame = std::make_shared<Frame>();
  frame->id = last_->frame_id;
  frame->capture_time_ns = last_->capture_time_ns;
  frame->grey = cv::Mat(8, 8, CV_8UC1);
  frame->camera = camera_;
  ring.Push({frame, last_});
}

void SyntheticMap::Correct(const Rigid3& new_from_old, double feature_sigma_m) {
  for (Feature& feature : features_) {
    feature.estimate = new_from_old * feature.estimate + Noise(feature_sigma_m);
  }
  estimate_from_truth_ = new_from_old * estimate_from_truth_;
  ++revision_;
}

void SyntheticMap::Reset(bool metric) {
  features_.clear();
  ++generation_;
  metric_ = metric;
  estimate_from_truth_ = Rigid3();
  Populate();
}

void SyntheticMap::Remove(FeatureId id) {
  std::erase_if(features_, [id](const Feature& feature) { return feature.id == id; });
}

FeatureId SyntheticMap::Add(const Eigen::Vector3d& true_point, double sigma_m) {
  const FeatureId id = next_id_++;
  features_.push_back(
      {id, true_point, true_point, sigma_m * sigma_m * Eigen::Matrix3d::Identity(), 0});
  Improve(id, sigma_m);
  return id;
}

void SyntheticMap::Improve(FeatureId id, double sigma_m) {
  for (Feature& feature : features_) {
    if (feature.id != id) continue;
    const Eigen::Vector3d ray = feature.truth.normalized();
    const double across = std::min(sigma_m, 0.002);
    const Eigen::Matrix3d projector = ray * ray.transpose();
    feature.covariance =
        sigma_m * sigma_m * projector + across * across * (Eigen::Matrix3d::Identity() - projector);
    const Eigen::Matrix3d root = feature.covariance.llt().matrixL();
    feature.estimate = estimate_from_truth_ * (feature.truth + root * Noise(1.0));
    feature.matched += 10;
  }
}

Eigen::Vector3d SyntheticMap::estimate(FeatureId id) const {
  for (const Feature& feature : features_) {
    if (feature.id == id) return feature.estimate;
  }
  return Eigen::Vector3d::Constant(std::nan(""));
}

}  // namespace saccade::testing
