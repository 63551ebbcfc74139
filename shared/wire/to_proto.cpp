#include "shared/wire/to_proto.hpp"

#include <cmath>

namespace saccade::wire {
namespace {

template <int N, typename Message>
Message UpperTriangle(const Eigen::Matrix<double, N, N>& matrix) {
  Message message;
  message.mutable_upper()->Reserve(N * (N + 1) / 2);
  for (int row = 0; row < N; ++row) {
    for (int column = row; column < N; ++column) message.add_upper(matrix(row, column));
  }
  return message;
}

v1::AnchorState ToProto(AnchorState state) {
  switch (state) {
    case AnchorState::kProvisional:
      return v1::ANCHOR_STATE_PROVISIONAL;
    case AnchorState::kTracking:
      return v1::ANCHOR_STATE_TRACKING;
    case AnchorState::kPaused:
      return v1::ANCHOR_STATE_PAUSED;
    case AnchorState::kStopped:
      return v1::ANCHOR_STATE_STOPPED;
  }
  return v1::ANCHOR_STATE_UNSPECIFIED;
}

v1::AnchorMethod ToProto(AnchorMethod method) {
  switch (method) {
    case AnchorMethod::kScene:
      return v1::ANCHOR_METHOD_SCENE;
    case AnchorMethod::kFeature:
      return v1::ANCHOR_METHOD_FEATURE;
    case AnchorMethod::kPlane:
      return v1::ANCHOR_METHOD_PLANE;
    case AnchorMethod::kMedianDepth:
      return v1::ANCHOR_METHOD_MEDIAN_DEPTH;
    case AnchorMethod::kPoint:
      return v1::ANCHOR_METHOD_POINT;
  }
  return v1::ANCHOR_METHOD_UNSPECIFIED;
}

v1::FeatureState ToProto(FeatureState state) {
  switch (state) {
    case FeatureState::kNotAttempted:
      return v1::FEATURE_STATE_NOT_ATTEMPTED;
    case FeatureState::kMeasured:
      return v1::FEATURE_STATE_MEASURED;
    case FeatureState::kFailed:
      return v1::FEATURE_STATE_FAILED;
  }
  return v1::FEATURE_STATE_UNSPECIFIED;
}

v1::CameraIntrinsics::Model ToProto(LensModel model) {
  switch (model) {
    case LensModel::kPinhole:
      return v1::CameraIntrinsics::MODEL_PINHOLE;
    case LensModel::kRadial1:
      return v1::CameraIntrinsics::MODEL_RADIAL1;
    case LensModel::kBrownConrady:
      return v1::CameraIntrinsics::MODEL_BROWN_CONRADY;
    case LensModel::kKannalaBrandt:
      return v1::CameraIntrinsics::MODEL_KANNALA_BRANDT;
    case LensModel::kFov:
      return v1::CameraIntrinsics::MODEL_FOV;
  }
  return v1::CameraIntrinsics::MODEL_UNSPECIFIED;
}

int DistortionSize(LensModel model) {
  switch (model) {
    case LensModel::kPinhole:
      return 0;
    case LensModel::kRadial1:
    case LensModel::kFov:
      return 1;
    case LensModel::kBrownConrady:
      return 5;
    case LensModel::kKannalaBrandt:
      return 4;
  }
  return 0;
}

}  // namespace

v1::Vector3 ToProto(const Eigen::Vector3d& value) {
  v1::Vector3 message;
  message.set_x(value.x());
  message.set_y(value.y());
  message.set_z(value.z());
  return message;
}

v1::Pixel ToProto(const Eigen::Vector2d& pixel) {
  v1::Pixel message;
  message.set_u(pixel.x());
  message.set_v(pixel.y());
  return message;
}

v1::Quaternion ToProto(const Eigen::Quaterniond& rotation) {
  v1::Quaternion message;
  message.set_x(rotation.x());
  message.set_y(rotation.y());
  message.set_z(rotation.z());
  message.set_w(rotation.w());
  return message;
}

v1::Rigid3 ToProto(const Rigid3& target_from_source) {
  v1::Rigid3 message;
  *message.mutable_translation_m() = ToProto(target_from_source.translation);
  *message.mutable_rotation() = ToProto(target_from_source.rotation);
  return message;
}

v1::Covariance3 ToProto(const Eigen::Matrix3d& covariance) {
  return UpperTriangle<3, v1::Covariance3>(covariance);
}

v1::Covariance6 ToProto(const Matrix6d& covariance) {
  return UpperTriangle<6, v1::Covariance6>(covariance);
}

v1::CameraIntrinsics ToProto(const CameraIntrinsics& intrinsics) {
  v1::CameraIntrinsics message;
  message.set_model(ToProto(intrinsics.model));
  message.set_width_px(static_cast<std::uint32_t>(intrinsics.width));
  message.set_height_px(static_cast<std::uint32_t>(intrinsics.height));
  message.set_fx_px(intrinsics.fx);
  message.set_fy_px(intrinsics.fy);
  message.set_cx_px(intrinsics.cx);
  message.set_cy_px(intrinsics.cy);
  for (int i = 0; i < DistortionSize(intrinsics.model); ++i) {
    message.add_distortion(intrinsics.distortion[static_cast<std::size_t>(i)]);
  }
  return message;
}

v1::TrackingStatus ToProto(TrackingStatus status) {
  switch (status) {
    case TrackingStatus::kInitialising:
      return v1::TRACKING_STATUS_INITIALISING;
    case TrackingStatus::kTracking:
      return v1::TRACKING_STATUS_TRACKING;
    case TrackingStatus::kCoasting:
      return v1::TRACKING_STATUS_COASTING;
    case TrackingStatus::kLost:
      return v1::TRACKING_STATUS_LOST;
    case TrackingStatus::kRelocalising:
      return v1::TRACKING_STATUS_RELOCALISING;
  }
  return v1::TRACKING_STATUS_UNSPECIFIED;
}

v1::TrackingQuality ToProto(TrackingQuality quality) {
  switch (quality) {
    case TrackingQuality::kUnknown:
      return v1::TRACKING_QUALITY_UNSPECIFIED;
    case TrackingQuality::kBad:
      return v1::TRACKING_QUALITY_BAD;
    case TrackingQuality::kPoor:
      return v1::TRACKING_QUALITY_POOR;
    case TrackingQuality::kGood:
      return v1::TRACKING_QUALITY_GOOD;
  }
  return v1::TRACKING_QUALITY_UNSPECIFIED;
}

v1::Feature ToProto(const FeatureSnapshot& feature) {
  v1::Feature message;
  message.set_id(feature.id);
  message.set_state(ToProto(feature.state));
  *message.mutable_point_in_world_m() = ToProto(feature.point_in_world);
  *message.mutable_covariance_in_world_m2() = ToProto(feature.covariance_in_world);
  message.set_depth_known(feature.depth_known);
  if (feature.pixel) *message.mutable_pixel() = ToProto(*feature.pixel);
  message.set_matched_count(feature.matched_count);
  return message;
}

v1::PoseEvent ToProtoPose(const MapSnapshot& snapshot, Timestamp captured_ns) {
  v1::PoseEvent message;
  message.set_frame_id(snapshot.frame_id);
  message.set_capture_time_ns(captured_ns);
  message.set_status(ToProto(snapshot.status));
  message.set_quality(ToProto(snapshot.quality));
  message.set_advice(snapshot.advice);
  message.set_metric(snapshot.metric);
  *message.mutable_world_from_camera() = ToProto(snapshot.world_from_camera);
  *message.mutable_covariance() = ToProto(snapshot.pose_covariance);
  *message.mutable_velocity_in_world_m_s() = ToProto(snapshot.velocity_in_world);
  *message.mutable_angular_velocity_in_camera_rad_s() =
      ToProto(snapshot.angular_velocity_in_camera);
  message.set_features_attempted(static_cast<std::uint32_t>(snapshot.attempted));
  message.set_features_matched(static_cast<std::uint32_t>(snapshot.matched));
  message.set_map_revision(snapshot.map_revision);
  return message;
}

v1::Anchor ToProto(const Anchor& anchor) {
  v1::Anchor message;
  message.set_state(ToProto(anchor.state));
  message.set_method(ToProto(anchor.method));
  if (anchor.place_known) *message.mutable_point_in_world_m() = ToProto(anchor.point_in_world);
  *message.mutable_covariance_in_world_m2() = ToProto(anchor.covariance_in_world);
  message.set_error_mm(anchor.error_m * 1e3);
  if (anchor.error_px) message.set_error_px(*anchor.error_px);
  message.set_reason(anchor.reason);
  if (anchor.pixel) *message.mutable_pixel() = ToProto(*anchor.pixel);
  return message;
}

v1::FrameFeatures ToProtoFeatures(const MapSnapshot& snapshot) {
  const auto sixteenths = [](double px) {
    return static_cast<std::int32_t>(std::lround(16.0 * px));
  };
  v1::FrameFeatures message;
  for (const FeatureSnapshot& feature : snapshot.features) {
    if (!feature.pixel || !feature.pixel->allFinite()) continue;
    const std::int32_t u = sixteenths(feature.pixel->x());
    const std::int32_t v = sixteenths(feature.pixel->y());
    if (feature.state == FeatureState::kMeasured) {
      message.add_measured_ids(feature.id);
      message.add_measured_px16(u);
      message.add_measured_px16(v);
    } else if (feature.state == FeatureState::kFailed) {
      message.add_failed_ids(feature.id);
      message.add_failed_px16(u);
      message.add_failed_px16(v);
    }
  }
  return message;
}

}  // namespace saccade::wire
