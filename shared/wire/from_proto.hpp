#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <optional>
#include <string>

#include "saccade/v1/session.pb.h"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/annotation.hpp"
#include "shared/scene/limits.hpp"
#include "shared/scene/map_snapshot.hpp"

/// Messages to domain structs. Whatever arrives is checked here and nowhere else: finite numbers,
/// pixels inside the picture, sizes, lengths, known enums. Every error is InvalidArgument and
/// starts with the path of the field: "draft.target.frame_pixel.pixel.u: ...". Pure functions, any
/// thread.
namespace saccade::wire {

/// Bounds that depend on the camera; the rest are constants.
struct ImageSize {
  int width = 0, height = 0;  // [px]
};

// shared/scene/limits.hpp has the rest.
inline constexpr double kMinSizeM = 1e-3;
inline constexpr double kDefaultSizeM = 0.05;
inline constexpr std::size_t kMaxNameBytes = 60;

absl::StatusOr<Eigen::Vector3d> FromProto(const v1::Vector3& message, absl::string_view field);
/// To half a pixel beyond the centres of the outermost pixels.
absl::StatusOr<Eigen::Vector2d> FromProto(const v1::Pixel& message, const ImageSize& image,
                                          absl::string_view field);
/// Of length 1 to a thousandth, which the result has exactly.
absl::StatusOr<Eigen::Quaterniond> FromProto(const v1::Quaternion& message,
                                             absl::string_view field);
absl::StatusOr<Rigid3> FromProto(const v1::Rigid3& message, absl::string_view field);
absl::StatusOr<Eigen::Matrix3d> FromProto(const v1::Covariance3& message, absl::string_view field);
absl::StatusOr<Matrix6d> FromProto(const v1::Covariance6& message, absl::string_view field);
absl::StatusOr<CameraIntrinsics> FromProto(const v1::CameraIntrinsics& message,
                                           absl::string_view field);

absl::StatusOr<AnnotationTarget> FromProto(const v1::AnnotationTarget& message,
                                           const ImageSize& image, absl::string_view field);
/// The draft's defaults filled in; request_id, author and picture are the caller's to set: what the
/// bytes of a picture are, only who decodes them knows. Here it is that there are some, and not too
/// many.
absl::StatusOr<AnnotationDraft> FromProto(const v1::AnnotationDraft& message,
                                          const ImageSize& image,
                                          absl::string_view field = "draft");

/// What is to be changed, with `id`. The rest of the request is the caller's.
absl::StatusOr<AnnotationPatch> FromProto(const v1::UpdateAnnotationRequest& message,
                                          const ImageSize& image);

/// Edges above 0 and at most kMaxSizeM [m].
absl::StatusOr<Eigen::Vector3d> CheckExtent(const v1::Vector3& message, absl::string_view field);
/// Of edits that are undone together: at most kMaxEditGroupBytes of UTF-8, one line.
absl::Status CheckEditGroup(absl::string_view group);

/// 0 becomes kDefaultSizeM.
absl::StatusOr<double> CheckSize(double size_m, absl::string_view field);
/// At most `max_bytes` of UTF-8 without control characters other than line feed.
absl::Status CheckText(absl::string_view text, std::size_t max_bytes, absl::string_view field);
/// 8-4-4-4-12 hexadecimal digits.
absl::Status CheckUuid(absl::string_view id, absl::string_view field);

// What a client reads from the server.
absl::StatusOr<MapSnapshot> FromProto(const v1::PoseEvent& message, absl::string_view field);
absl::StatusOr<FeatureSnapshot> FromProto(const v1::Feature& message, absl::string_view field);
absl::StatusOr<Anchor> FromProto(const v1::Anchor& message, absl::string_view field);
absl::StatusOr<Annotation> FromProto(const v1::Annotation& message, absl::string_view field);

}  // namespace saccade::wire
