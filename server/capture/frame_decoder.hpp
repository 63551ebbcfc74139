#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "server/capture/frame.hpp"
#include "server/capture/image_list.hpp"

namespace saccade {

/// Decodes the frames of a data set by index; shared by both ways of delivery. One thread at a
/// time.
class FrameDecoder {
 public:
  FrameDecoder(std::filesystem::path folder, std::vector<ImageEntry> entries,
               std::shared_ptr<const CameraModel> camera, std::string camera_file = "camera.yaml");

  const std::vector<ImageEntry>& entries() const { return entries_; }

  /// Errors as LoadPicture, and InvalidArgument for a picture of another size than the camera's.
  absl::StatusOr<Frame> Decode(std::size_t index) const;

  /// How many frames to decode ahead: six, or fewer where frames are large.
  std::size_t read_ahead() const;

 private:
  absl::Status CheckSize(cv::Size size) const;

  std::filesystem::path folder_;
  std::vector<ImageEntry> entries_;
  std::shared_ptr<const CameraModel> camera_;
  std::string camera_file_;  // for messages
};

}  // namespace saccade
