#pragma once

#include <absl/status/status.h>

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "server/capture/camera_files/camera_draft.hpp"

namespace saccade {

/// Whether this can be a camera: numbers that are each possible, but not together, or not for a
/// lens that anybody makes. InvalidArgument says where, what is likely wrong, and what to write.
/// What is odd but could be true goes to `warnings`, in the same words.
absl::Status CheckPlausible(const CameraDraft& draft, std::vector<std::string>& warnings);

/// Not the FOV lens, or its w is an angle.
bool FovAngleIsPossible(const CameraIntrinsics& lens);

/// The three parts of it.
absl::Status CheckSizeAndView(const CameraDraft& draft, std::vector<std::string>& warnings);
absl::Status CheckCentre(const CameraDraft& draft, std::vector<std::string>& warnings);
absl::Status CheckDistortion(const CameraDraft& draft, std::vector<std::string>& warnings);

/// The same camera on pictures of another size; meaningful if the sides have the same ratio.
CameraIntrinsics Scaled(const CameraIntrinsics& lens, cv::Size size);

/// What to do about pictures of `size` where the camera file says another one.
std::string SizeRemedy(const CameraIntrinsics& lens, cv::Size size);

}  // namespace saccade
