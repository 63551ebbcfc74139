#include "server/calibrate/picture_folder.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>

#include "server/capture/image_file.hpp"

namespace saccade {

absl::StatusOr<std::vector<std::filesystem::path>> PicturesIn(const std::filesystem::path& folder) {
  static constexpr std::array kEndings = {".png", ".jpg", ".jpeg", ".pgm", ".ppm",
                                          ".bmp", ".tif", ".tiff", ".webp"};
  std::error_code error;
  if (!std::filesystem::exists(folder, error)) {
    return absl::NotFoundError(absl::StrCat("--images: there is no ", folder.string()));
  }
  if (!std::filesystem::is_directory(folder, error)) {
    return absl::InvalidArgumentError(
        absl::StrCat("--images: ", folder.string(), " is a file; name the folder it is in"));
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string ending = absl::AsciiStrToLower(entry.path().extension().string());
    if (std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end()) {
      files.push_back(entry.path());
    }
  }
  if (error) {
    return absl::PermissionDeniedError(
        absl::StrCat("--images: ", folder.string(), " cannot be read (", error.message(), ")"));
  }
  if (files.empty()) {
    return absl::NotFoundError(absl::StrCat("--images: ", folder.string(),
                                            " holds no picture (PNG, JPEG, PNM, BMP, TIFF, WebP)"));
  }
  std::sort(files.begin(), files.end());
  return files;
}

absl::StatusOr<cv::Mat> LoadGrey(const std::filesystem::path& file) {
  absl::StatusOr<DecodedPicture> picture = LoadPicture(file);
  if (!picture.ok()) return picture.status();
  return picture->grey;
}

}  // namespace saccade
