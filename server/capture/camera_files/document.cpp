#include "server/capture/camera_files/document.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include "server/capture/camera_files/opencv_xml.hpp"
#include "server/capture/stray_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxBytes = 1 << 20;  // these files are a few lines; more is a mistake

/// FILE and CAMERA of FILE#CAMERA; a file whose name has a # in it is that file.
std::pair<std::filesystem::path, std::string> SplitName(const std::filesystem::path& name) {
  const std::string text = name.string();
  const std::size_t mark = text.rfind('#');
  if (mark == std::string::npos || mark == 0 || MayExist(name)) return {name, ""};
  return {text.substr(0, mark), text.substr(mark + 1)};
}

/// OpenCV and ORB-SLAM write the directive with a colon, which YAML does not know.
std::string WithoutDirective(std::string text) {
  if (absl::StartsWith(text, "%YAML")) text[0] = '#';
  return text;
}

}  // namespace

absl::StatusOr<CameraDocument> LoadCameraDocument(const std::filesystem::path& file) {
  auto [path, camera] = SplitName(file);
  absl::StatusOr<std::string> text = ReadRegularFile(path, kMaxBytes, "a camera file");
  if (!text.ok()) return text.status();
  const std::string name = path.string();
  if (const std::string stray = NameOfStray(*text); !stray.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": ", stray));
  }
  absl::string_view begin = *text;
  absl::ConsumePrefix(&begin, "\xEF\xBB\xBF");
  if (absl::StartsWith(absl::StripLeadingAsciiWhitespace(begin), "<")) {
    absl::StatusOr<std::string> yaml = YamlOfOpenCvXml(begin);
    if (!yaml.ok()) {
      return absl::InvalidArgumentError(absl::StrCat(name, yaml.status().message()));
    }
    return CameraDocument{name, camera, *yaml, YamlReader::FromText(name, *yaml)};
  }
  const std::string cleaned = WithoutDirective(std::string(begin));
  return CameraDocument{name, camera, cleaned, YamlReader::FromText(name, cleaned)};
}

}  // namespace saccade
