#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <string>

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// Forms in which a camera is written: camera.yaml, Kalibr's camchain, ROS' calibration
/// (camera_calibration_parsers), OpenCV's FileStorage.
enum class CameraTextForm { kSaccade, kKalibr, kRos, kOpenCv };

/// "saccade", "kalibr", "ros", "opencv". InvalidArgument: none of these.
absl::StatusOr<CameraTextForm> ParseCameraTextForm(absl::string_view name);
/// What such a file is usually called: "camchain.yaml".
absl::string_view FileNameOf(CameraTextForm form);

/// `camera` as a file of that form, which LoadCamera reads back to the same lens; frames a second
/// are in camera.yaml alone. `comment`, if any, is its first lines: all but the first begin with #.
///   FailedPrecondition  the form has no words for this camera; says which has
absl::StatusOr<std::string> CameraText(CameraTextForm form, const CameraIntrinsics& camera,
                                       const std::string& comment = "");

}  // namespace saccade
