#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include "saccade/v1/gaze.pb.h"
#include "shared/scene/gaze.hpp"

/// Gaze over the wire, both ways; rules as in from_proto.hpp and to_proto.hpp.
namespace saccade::wire {

v1::GazeTarget ToProto(const GazeTarget& target);
v1::GazePilot ToProto(const GazePilot& pilot);
v1::GazeState ToProto(const GazeSnapshot& state);
v1::MountCalibration ToProto(const MountCalibrationReport& report);

/// InvalidArgument starts with the path of the field.
absl::StatusOr<GazeTarget> FromProto(const v1::GazeTarget& message, absl::string_view field);
absl::StatusOr<GazeSnapshot> FromProto(const v1::GazeState& message, absl::string_view field);
absl::StatusOr<MountCalibrationReport> FromProto(const v1::MountCalibration& message,
                                                 absl::string_view field);

}  // namespace saccade::wire
