// What a client reads from the server: poses, features, annotations, intrinsics.
#include <absl/strings/str_cat.h>

#include <cmath>
#include <utility>

#include "shared/wire/bad_field.hpp"
#include "shared/wire/from_proto.hpp"

namespace saccade::wire {
namespace {

template <int N>
absl::StatusOr<Eigen::Matrix<double, N, N>> Symmetric(
    const google::protobuf::RepeatedField<double>& upper, absl::string_view field) {
  Eigen::Matrix<double, N, N> matrix = Eigen::Matrix<double, N, N>::Zero();
  if (upper.empty()) return matrix;
  if (upper.size() != N * (N + 1) / 2) {
    return BadField(absl::StrCat(field, ".upper"),
                    absl::StrCat("needs ", N * (N + 1) / 2, " numbers, not ", upper.size()));
  }
  int next = 0;
  for (int row = 0; row < N; ++row) {
    for (int column = row; column < N; ++column) {
      const double value = upper[next++];
      if (!std::isfinite(value))
        return BadField(absl::StrCat(field, ".upper"), "must be finite numbers");
      matrix(row, column) = matrix(column, row) = value;
    }
  }
  return matrix;
}

absl::StatusOr<TrackingStatus> StatusFromProto(v1::TrackingStatus status, absl::string_view field) {
  switch (status) {
    case v1::TRACKING_STATUS_INITIALISING:
      return TrackingStatus::kInitialising;
    case v1::TRACKING_STATUS_TRACKING:
      return TrackingStatus::kTracking;
    case v1::TRACKING_STATUS_COASTING:
      return TrackingStatus::kCoasting;
    case v1::TRACKING_STATUS_LOST:
      return TrackingStatus::kLost;
    case v1::TRACKING_STATUS_RELOCALISING:
      return TrackingStatus::kRelocalising;
    default:
      return BadField(field, absl::StrCat("unknown status ", static_cast<int>(status)));
  }
}

TrackingQuality QualityFromProto(v1::TrackingQuality quality) {
  switch (quality) {
    case v1::TRACKING_QUALITY_BAD:
      return TrackingQuality::kBad;
    case v1::TRACKING_QUALITY_POOR:
      return TrackingQuality::kPoor;
    case v1::TRACKING_QUALITY_GOOD:
      return TrackingQuality::kGood;
    default:
      return TrackingQuality::kUnknown;
  }
}

absl::StatusOr<AnchorState> AnchorStateFromProto(v1::AnchorState state, absl::string_view field) {
  switch (state) {
    case v1::ANCHOR_STATE_PROVISIONAL:
      return AnchorState::kProvisional;
    case v1::ANCHOR_STATE_TRACKING:
      return AnchorState::kTracking;
    case v1::ANCHOR_STATE_PAUSED:
      return AnchorState::kPaused;
    case v1::ANCHOR_STATE_STOPPED:
      return AnchorState::kStopped;
    default:
      return BadField(field, absl::StrCat("unknown state ", static_cast<int>(state)));
  }
}

AnchorMethod AnchorMethodFromProto(v1::AnchorMethod method) {
  switch (method) {
    case v1::ANCHOR_METHOD_SCENE:
      return AnchorMethod::kScene;
    case v1::ANCHOR_METHOD_FEATURE:
      return AnchorMethod::kFeature;
    case v1::ANCHOR_METHOD_PLANE:
      return AnchorMethod::kPlane;
    case v1::ANCHOR_METHOD_POINT:
      return AnchorMethod::kPoint;
    default:
      return AnchorMethod::kMedianDepth;
  }
}

}  // namespace

absl::StatusOr<Eigen::Matrix3d> FromProto(const v1::Covariance3& message, absl::string_view field) {
  return Symmetric<3>(message.upper(), field);
}

absl::StatusOr<Matrix6d> FromProto(const v1::Covariance6& message, absl::string_view field) {
  return Symmetric<6>(message.upper(), field);
}

absl::StatusOr<Rigid3> FromProto(const v1::Rigid3& message, absl::string_view field) {
  absl::StatusOr<Eigen::Vector3d> translation =
      FromProto(message.translation_m(), absl::StrCat(field, ".translation_m"));
  if (!translation.ok()) return translation.status();
  const absl::StatusOr<Eigen::Quaterniond> rotation =
      FromProto(message.rotation(), absl::StrCat(field, ".rotation"));
  if (!rotation.ok()) return rotation.status();
  return Rigid3{*rotation, *translation};
}

absl::StatusOr<Eigen::Quaterniond> FromProto(const v1::Quaternion& message,
                                             absl::string_view field) {
  const Eigen::Quaterniond rotation(message.w(), message.x(), message.y(), message.z());
  // Not >: NaN fails too.
  if (!(std::abs(rotation.norm() - 1.0) < 1e-3))
    return BadField(field, "must be a unit quaternion");
  return rotation.normalized();
}

absl::StatusOr<CameraIntrinsics> FromProto(const v1::CameraIntrinsics& message,
                                           absl::string_view field) {
  CameraIntrinsics out;
  std::size_t coefficients = 0;
  switch (message.model()) {
    case v1::CameraIntrinsics::MODEL_PINHOLE:
      out.model = LensModel::kPinhole;
      break;
    case v1::CameraIntrinsics::MODEL_RADIAL1:
      out.model = LensModel::kRadial1, coefficients = 1;
      break;
    case v1::CameraIntrinsics::MODEL_BROWN_CONRADY:
      out.model = LensModel::kBrownConrady, coefficients = 5;
      break;
    case v1::CameraIntrinsics::MODEL_KANNALA_BRANDT:
      out.model = LensModel::kKannalaBrandt, coefficients = 4;
      break;
    case v1::CameraIntrinsics::MODEL_FOV:
      out.model = LensModel::kFov, coefficients = 1;
      break;
    default:
      return BadField(absl::StrCat(field, ".model"), "unknown lens model");
  }
  if (message.width_px() == 0 || message.height_px() == 0 || message.width_px() > 16384 ||
      message.height_px() > 16384) {
    return BadField(field, "width_px and height_px must be between 1 and 16384");
  }
  if (static_cast<std::size_t>(message.distortion_size()) != coefficients) {
    return BadField(absl::StrCat(field, ".distortion"),
                    absl::StrCat("this model has ", coefficients, " coefficients"));
  }
  out.width = static_cast<int>(message.width_px());
  out.height = static_cast<int>(message.height_px());
  out.fx = message.fx_px(), out.fy = message.fy_px();
  out.cx = message.cx_px(), out.cy = message.cy_px();
  bool finite = std::isfinite(out.cx) && std::isfinite(out.cy) && std::isfinite(out.fx) &&
                std::isfinite(out.fy) && out.fx > 0 && out.fy > 0;
  for (std::size_t i = 0; i < coefficients; ++i) {
    out.distortion[i] = message.distortion(static_cast<int>(i));
    finite = finite && std::isfinite(out.distortion[i]);
  }
  if (!finite) return BadField(field, "numbers must be finite and focal lengths above 0");
  return out;
}

absl::StatusOr<MapSnapshot> FromProto(const v1::PoseEvent& message, absl::string_view field) {
  MapSnapshot out;
  out.frame_id = message.frame_id();
  out.capture_time_ns = message.capture_time_ns();
  absl::StatusOr<TrackingStatus> status =
      StatusFromProto(message.status(), absl::StrCat(field, ".status"));
  if (!status.ok()) return status.status();
  out.status = *status;
  out.quality = QualityFromProto(message.quality());
  out.advice = message.advice();
  out.metric = message.metric();
  absl::StatusOr<Rigid3> pose =
      FromProto(message.world_from_camera(), absl::StrCat(field, ".world_from_camera"));
  if (!pose.ok()) return pose.status();
  out.world_from_camera = *pose;
  absl::StatusOr<Matrix6d> covariance =
      FromProto(message.covariance(), absl::StrCat(field, ".covariance"));
  if (!covariance.ok()) return covariance.status();
  out.pose_covariance = *covariance;
  absl::StatusOr<Eigen::Vector3d> velocity =
      FromProto(message.velocity_in_world_m_s(), absl::StrCat(field, ".velocity_in_world_m_s"));
  if (!velocity.ok()) return velocity.status();
  out.velocity_in_world = *velocity;
  absl::StatusOr<Eigen::Vector3d> turn =
      FromProto(message.angular_velocity_in_camera_rad_s(),
                absl::StrCat(field, ".angular_velocity_in_camera_rad_s"));
  if (!turn.ok()) return turn.status();
  out.angular_velocity_in_camera = *turn;
  out.attempted = static_cast<int>(message.features_attempted());
  out.matched = static_cast<int>(message.features_matched());
  out.map_revision = message.map_revision();
  return out;
}

absl::StatusOr<FeatureSnapshot> FromProto(const v1::Feature& message, absl::string_view field) {
  FeatureSnapshot out;
  out.id = message.id();
  out.state = message.state() == v1::FEATURE_STATE_MEASURED ? FeatureState::kMeasured
              : message.state() == v1::FEATURE_STATE_FAILED ? FeatureState::kFailed
                                                            : FeatureState::kNotAttempted;
  absl::StatusOr<Eigen::Vector3d> point =
      FromProto(message.point_in_world_m(), absl::StrCat(field, ".point_in_world_m"));
  if (!point.ok()) return point.status();
  out.point_in_world = *point;
  absl::StatusOr<Eigen::Matrix3d> covariance =
      FromProto(message.covariance_in_world_m2(), absl::StrCat(field, ".covariance_in_world_m2"));
  if (!covariance.ok()) return covariance.status();
  out.covariance_in_world = *covariance;
  out.depth_known = message.depth_known();
  if (message.has_pixel()) out.pixel = Eigen::Vector2d(message.pixel().u(), message.pixel().v());
  out.matched_count = message.matched_count();
  return out;
}

absl::StatusOr<Anchor> FromProto(const v1::Anchor& message, absl::string_view field) {
  Anchor out;
  absl::StatusOr<AnchorState> state =
      AnchorStateFromProto(message.state(), absl::StrCat(field, ".state"));
  if (!state.ok()) return state.status();
  out.state = *state;
  out.method = AnchorMethodFromProto(message.method());
  out.place_known = message.has_point_in_world_m();
  absl::StatusOr<Eigen::Vector3d> point =
      FromProto(message.point_in_world_m(), absl::StrCat(field, ".point_in_world_m"));
  if (!point.ok()) return point.status();
  out.point_in_world = *point;
  absl::StatusOr<Eigen::Matrix3d> covariance =
      FromProto(message.covariance_in_world_m2(), absl::StrCat(field, ".covariance_in_world_m2"));
  if (!covariance.ok()) return covariance.status();
  out.covariance_in_world = *covariance;
  out.error_m = message.error_mm() * 1e-3;
  if (message.has_error_px()) out.error_px = message.error_px();
  if (message.has_pixel()) out.pixel = Eigen::Vector2d(message.pixel().u(), message.pixel().v());
  out.reason = message.reason();
  return out;
}

}  // namespace saccade::wire
