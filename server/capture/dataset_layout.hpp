#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <string>
#include <vector>

#include "server/capture/image_list.hpp"
#include "server/capture/source.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade {

/// What a folder on disk says, whatever its layout.
struct DatasetLayout {
  std::filesystem::path list;      // where the times come from, for messages
  std::filesystem::path pictures;  // that the entries' files are relative to
  std::vector<ImageEntry> entries;
  CameraIntrinsics camera;
  std::string camera_file;  // its name, for messages
  std::string remark;       // for SourceInfo
  bool lens_assumed = false;
};

/// Reads the folder's lists and camera, by what it holds:
///   rgb.txt               TUM RGB-D, with camera.yaml
///   mav0/ (or cam0/)      EuRoC: cam0/data.csv and cam0/sensor.yaml
///   pictures alone        in the order of their names, numbers in them by value, `options.fps` a
///                         second; with camera.yaml, or an assumed lens
/// `options.camera_file` wins over the folder's own, `options.view_deg` over both.
///   NotFound         no folder, no list, no camera file
///   InvalidArgument  a line or field that is wrong; `fps` missing, or given beside time stamps
absl::StatusOr<DatasetLayout> ReadDatasetLayout(const std::filesystem::path& folder,
                                                const SourceOptions& options);

}  // namespace saccade
