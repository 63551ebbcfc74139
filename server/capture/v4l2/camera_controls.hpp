#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "server/capture/v4l2/v4l2_request.hpp"
#include "shared/io/video_device.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// Exposure, gain and focus as asked for. What nobody asked for: focus is held where it is (a lens
/// that hunts changes the focal length), the exposure is the camera's own but never at the cost of
/// the frame rate.
///   FailedPrecondition  a control that the device lacks, or a value beyond its range: lists what
///                       it has
///   Unavailable         the device is gone
absl::Status SetControls(VideoDevice& device, const V4l2Request& request);

/// Exposure time now [ns]; nothing if the device does not say.
std::optional<Timestamp> ReadExposure(VideoDevice& device);

}  // namespace saccade
