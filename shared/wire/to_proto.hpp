#pragma once

#include <Eigen/Dense>
#include <optional>

#include "saccade/v1/map.pb.h"
#include "saccade/v1/session.pb.h"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/map_snapshot.hpp"

/// Domain structs to messages: proto/saccade/v1 states the units. Pure functions, any thread.
namespace saccade::wire {

v1::Vector3 ToProto(const Eigen::Vector3d& value);
v1::Pixel ToProto(const Eigen::Vector2d& pixel);
v1::Quaternion ToProto(const Eigen::Quaterniond& rotation);
v1::Rigid3 ToProto(const Rigid3& target_from_source);
v1::Covariance3 ToProto(const Eigen::Matrix3d& covariance);
v1::Covariance6 ToProto(const Matrix6d& covariance);
v1::CameraIntrinsics ToProto(const CameraIntrinsics& intrinsics);
v1::TrackingStatus ToProto(TrackingStatus status);
v1::TrackingQuality ToProto(TrackingQuality quality);
v1::Feature ToProto(const FeatureSnapshot& feature);
v1::AnnotationShape ToProto(AnnotationShape shape);

/// `captured_ns`: the frame's exposure middle on the server's monotonic clock.
v1::PoseEvent ToProtoPose(const MapSnapshot& snapshot, Timestamp captured_ns);

/// What this very frame measured, and where it searched in vain [1/16 px of the raw picture].
v1::FrameFeatures ToProtoFeatures(const MapSnapshot& snapshot);

v1::Anchor ToProto(const Anchor& anchor);
v1::Annotation ToProto(const Annotation& annotation);
/// Without its bytes.
v1::PictureFacts ToProto(const Picture& picture);

/// A target as a client asks for it.
v1::AnnotationTarget ToProto(const AnnotationTarget& target);

}  // namespace saccade::wire
