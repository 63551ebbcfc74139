#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>

#include "shared/camera/camera_model.hpp"

namespace saccade {

/// Asked for the size of the source's pictures where a file does not tell it.
using PictureSize = std::function<std::optional<cv::Size>()>;

/// Reads a camera file: `camera.yaml` (architecture, section 4), or what other programs write, by
/// what is in it (camera_files/forms.hpp): Kalibr, ROS, ORB-SLAM, OpenCV, EuRoC, COLMAP. Of several
/// cameras the first, or `FILE#NAME`. A line in the log says what was read, as a whole camera.yaml,
/// and what is odd but could be true.
///   NotFound         no such file
///   InvalidArgument  a lens that is none of ours, a number that is missing, not finite or not
///                    plausible, an unknown field, a key that comes twice, no picture size: file,
///                    line, field and remedy; of another program's file also what there is of a
///                    camera.yaml
absl::StatusOr<CameraIntrinsics> LoadCamera(const std::filesystem::path& file,
                                            const PictureSize& picture_size = nullptr);

}  // namespace saccade
