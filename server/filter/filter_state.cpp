#include "server/filter/filter_state.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

namespace saccade {

using Eigen::Matrix3d;
using Eigen::Vector3d;

FilterState::FilterState(const FilterOptions& options)
    : options_(options), form_(&ParametrisationOf(options.form)) {
  Reset(CameraMotion(), Matrix12d::Zero());
}

void FilterState::Reset(const CameraMotion& camera, const Matrix12d& covariance) {
  mark_.reset();
  head_ = HeadRate();
  camera_ = camera;
  first_pose_ = camera.world_from_camera;
  anchors_.clear();
  features_.clear();
  updates_ = judged_ = 0;
  next_anchor_ = 1;
  noise_scale_ = 1.0;
  covariance_.Assign(motion_->InState(covariance));
  readout_s_ = options_.readout_s;
  readout_offset_ = -1;
  if (options_.readout_sigma_s > 0.0) {
    readout_offset_ = covariance_.Append(1);
    covariance_.lower(readout_offset_, readout_offset_) =
        options_.readout_sigma_s * options_.readout_sigma_s;
  }
}

void FilterState::ResetCamera(const CameraMotion& camera, const Matrix12d& covariance) {
  mark_.reset();
  head_ = HeadRate();
  camera_ = camera;
  first_pose_ = camera.world_from_camera;
  covariance_.ReplaceBlock(0, motion_->InState(covariance));
}

Matrix12d FilterState::CameraCovariance() const {
  const int size = motion_->dim();
  Matrix12d covariance = Matrix12d::Zero();
  covariance.topLeftCorner(size, size) = covariance_.Block(0, 0, size, size);
  return covariance;
}

Matrix6d FilterState::PoseCovariance() const { return covariance_.Block(0, 0, kPoseDim, kPoseDim); }

std::vector<FeatureId> FilterState::FeatureIds() const {
  std::vector<FeatureId> ids;
  ids.reserve(features_.size());
  for (const Feature& feature : features_) ids.push_back(feature.id);
  return ids;
}

const FilterState::Feature* FilterState::Find(FeatureId id) const {
  const auto at = std::lower_bound(features_.begin(), features_.end(), id,
                                   [](const Feature& f, FeatureId key) { return f.id < key; });
  return at != features_.end() && at->id == id ? &*at : nullptr;
}

const FilterState::Anchor& FilterState::AnchorOf(const Feature& feature) const {
  return *std::lower_bound(anchors_.begin(), anchors_.end(), feature.anchor,
                           [](const Anchor& a, AnchorPoseId key) { return a.id < key; });
}

AnchoredPoint FilterState::Point(const Feature& feature, bool first) const {
  const Anchor& anchor = AnchorOf(feature);
  const PointInClone& in_clone = first ? feature.first : feature.point;
  return {first ? anchor.first : anchor.pose, in_clone.bearing, in_clone.basis,
          feature.point.inverse_range};
}

AnchoredPoint FilterState::Point(FeatureId id) const { return Point(*Find(id), false); }

FilterState::HeadRate FilterState::RateOf(const HeadMotion& head, double dt) const {
  Matrix6d turn = Matrix6d::Identity() / dt;
  turn.topLeftCorner<3, 3>() = camera_.world_from_camera.RotationMatrix() / dt;
  HeadRate now;
  now.rate << head.camera_from_next.translation,
      LogQuaternion(head.camera_from_next.rotation);  // its axis is the same before and after
  now.rate = (turn * now.rate).eval();
  now.covariance = turn * head.covariance * turn.transpose();
  return now;
}

void FilterState::ChangeVelocities(double sign, const HeadRate& rate) {
  if (motion_->velocities() < 0) return;
  camera_.velocity_m_s += sign * rate.rate.head<3>();
  camera_.angular_velocity_rad_s += sign * rate.rate.tail<3>();
  covariance_.AddBlock(motion_->velocities(), rate.covariance);
}

CameraMotion FilterState::WholeMotion() const {
  CameraMotion whole = camera_;
  if (head_) {
    whole.velocity_m_s += head_->rate.head<3>();
    whole.angular_velocity_rad_s += head_->rate.tail<3>();
  }
  return whole;
}

void FilterState::Follow(const MotionModel::Step& step) {
  if (mark_) mark_->journal.Add(Journal::Predicted{step.f});
  covariance_.TransformBlock(0, step.f);
  covariance_.AddBlock(0, step.q);
  camera_ = step.next;
  first_pose_ = camera_.world_from_camera;
}

void FilterState::Predict(double dt, const MotionNoise& noise, const HeadMotion* head) {
  if (head != nullptr && !head_) {
    head_ = RateOf(*head, dt);
    ChangeVelocities(-1.0, *head_);
  } else if (head == nullptr && head_) {
    ChangeVelocities(1.0, *head_);
    head_.reset();
  }
  constexpr double kLongestStep_s = 1.0 / 30.0;
  constexpr double kMostSteps = 30.0;  // a second; whoever asks for more knows nothing anyway
  const auto steps =
      static_cast<int>(std::clamp(std::ceil(dt / kLongestStep_s - 0.1), 1.0, kMostSteps));
  for (int k = 0; k < steps; ++k) {
    const Eigen::Quaterniond& first =
        Fej() ? first_pose_.rotation : camera_.world_from_camera.rotation;
    Follow(motion_->Predict(camera_, first, dt / steps, noise));
  }
  if (head == nullptr) return;
  head_ = RateOf(*head, dt);
  Follow(motion_->Turn(camera_, *head));
}

void FilterState::Inflate(const Matrix12d& extra) {
  covariance_.AddBlock(0, motion_->InState(extra));
}

AnchorPoseId FilterState::AddAnchor() {
  const Eigen::MatrixXd rows = covariance_.Block(0, 0, kPoseDim, dim());
  const int offset = covariance_.Append(kPoseDim);
  if (mark_) mark_->journal.Add(Journal::Cloned{});
  for (int c = 0; c < offset; ++c) {
    for (int r = 0; r < kPoseDim; ++r) covariance_.lower(offset + r, c) = rows(r, c);
  }
  covariance_.AddBlock(offset, rows.leftCols(kPoseDim));
  anchors_.push_back({next_anchor_, offset, 0, updates_, camera_.world_from_camera, first_pose_});
  return next_anchor_++;
}

AnchorPoseId FilterState::AddAnchor(const Rigid3& world_from_camera, const Matrix6d& covariance) {
  const int offset = covariance_.Append(kPoseDim);
  if (mark_) mark_->journal.Add(Journal::Appended{kPoseDim});
  covariance_.AddBlock(offset, covariance);
  // Not young: its features have been measured often.
  anchors_.push_back({next_anchor_, offset, 0, 0, world_from_camera, world_from_camera});
  return next_anchor_++;
}

absl::Status FilterState::AddFeature(AnchorPoseId anchor, const FeatureBirth& birth) {
  const auto at = std::find_if(anchors_.begin(), anchors_.end(),
                               [&](const Anchor& a) { return a.id == anchor; });
  if (at == anchors_.end()) {
    return absl::InvalidArgumentError(absl::StrCat("filter: no pose clone ", anchor));
  }
  if (Has(birth.id)) {
    return absl::InvalidArgumentError(absl::StrCat("filter: feature id ", birth.id, " is taken"));
  }
  if (!(birth.inverse_range >= 0.0) || !(birth.inverse_range_sigma > 0.0) ||
      !std::isfinite(birth.inverse_range_sigma) || !birth.bearing.allFinite() ||
      std::abs(birth.bearing.norm() - 1.0) > 1e-6 || !birth.bearing_covariance.allFinite()) {
    return absl::InvalidArgumentError(
        "filter: a feature needs a unit bearing, inverse range >= 0 and its "
        "sigma above 0");
  }
  Feature feature;
  feature.id = birth.id;
  feature.anchor = anchor;
  feature.point = feature.first = {birth.bearing, TangentBasis(birth.bearing), birth.inverse_range};
  const Eigen::Matrix<double, 3, 2>& basis = feature.point.basis;
  const Eigen::Matrix2d tangent = basis.transpose() * birth.bearing_covariance * basis;
  feature.offset = covariance_.Append(form_->dim());
  if (mark_) mark_->journal.Add(Journal::Appended{form_->dim()});
  feature.birth_covariance = tangent;
  covariance_.AddBlock(feature.offset, form_->BirthCovariance(tangent, birth.inverse_range_sigma));
  const auto behind =
      std::upper_bound(features_.begin(), features_.end(), birth.id,
                       [](FeatureId id, const Feature& each) { return id < each.id; });
  features_.insert(behind, feature);
  ++at->users;
  return absl::OkStatus();
}

bool FilterState::CountErrorsFrom(AnchorPoseId anchor) {
  const auto from = std::find_if(anchors_.begin(), anchors_.end(),
                                 [&](const Anchor& a) { return a.id == anchor; });
  if (from == anchors_.end() || Fej()) return false;
  Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(dim(), kPoseDim);
  motion_->ByOrigin(camera_, from->pose, moved.topRows(motion_->dim()));
  for (const Anchor& each : anchors_) {
    PoseByOrigin(each.pose, from->pose, moved.middleRows<kPoseDim>(each.offset));
  }
  covariance_.Condition(moved, from->offset);
  return true;
}

double FilterState::DirectionSigma(AnchorPoseId anchor) const {
  const auto at = std::find_if(anchors_.begin(), anchors_.end(),
                               [&](const Anchor& each) { return each.id == anchor; });
  if (at == anchors_.end()) return 0.0;
  double variance = 0.0;
  for (int k = 3; k < kPoseDim; ++k) variance += covariance_.at(at->offset + k, at->offset + k);
  return std::sqrt(std::max(0.0, variance / 3.0));
}

void FilterState::Remove(std::span<const FeatureId> ids) {
  std::vector<std::pair<int, int>> gone;
  for (const FeatureId id : ids) {
    const Feature* found = Find(id);
    if (found == nullptr) continue;
    gone.emplace_back(found->offset, form_->dim());
    for (Anchor& anchor : anchors_) anchor.users -= anchor.id == found->anchor ? 1 : 0;
    features_.erase(features_.begin() + (found - features_.data()));
  }
  for (auto anchor = anchors_.begin(); anchor != anchors_.end();) {
    if (anchor->users > 0) {
      ++anchor;
      continue;
    }
    gone.emplace_back(anchor->offset, kPoseDim);
    anchor = anchors_.erase(anchor);
  }
  if (!gone.empty()) RemoveRows(gone);
}

void FilterState::RemoveRows(const std::vector<std::pair<int, int>>& offset_and_size) {
  std::vector<char> dropped(dim(), 0);
  for (const auto& [offset, size] : offset_and_size) {
    std::fill_n(dropped.begin() + offset, size, char{1});
  }
  std::vector<int> keep, moved(dim(), 0);
  keep.reserve(dim());
  for (int k = 0; k < dim(); ++k) {
    moved[k] = static_cast<int>(keep.size());
    if (!dropped[k]) keep.push_back(k);
  }
  covariance_.Keep(keep);
  if (mark_) mark_->journal.Add(Journal::Kept{keep});
  for (Anchor& anchor : anchors_) anchor.offset = moved[anchor.offset];
  for (Feature& feature : features_) feature.offset = moved[feature.offset];
}

std::vector<FeatureId> FilterState::RemoveBehind() {
  std::vector<FeatureId> gone;
  for (const Feature& feature : features_) {
    const int at = feature.offset + form_->range();
    const double sigma = std::sqrt(std::max(0.0, covariance_.at(at, at)));
    if (feature.point.inverse_range + 2.0 * sigma < 0.0) gone.push_back(feature.id);
  }
  Remove(gone);
  return gone;
}

}  // namespace saccade
