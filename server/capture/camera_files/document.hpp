#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <string>
#include <utility>

#include "server/capture/yaml_reader.hpp"

namespace saccade {

/// A camera file as it was read from the disk, not yet understood.
struct CameraDocument {
  std::string file;    // for messages
  std::string camera;  // which of several is asked for, "" for the first
  std::string text;
  YamlReader yaml;  // of a file that is no YAML: with that error
};

/// Reads FILE, or FILE#CAMERA where several are in it. OpenCV's XML is turned into YAML line by
/// line, its `%YAML:1.0` into the YAML it means.
/// Errors as ReadRegularFile.
absl::StatusOr<CameraDocument> LoadCameraDocument(const std::filesystem::path& file);

}  // namespace saccade
