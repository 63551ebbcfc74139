#include "server/capture/dataset_layout.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/capture/assumed_lens.hpp"
#include "server/capture/camera_file.hpp"
#include "server/capture/euroc_list.hpp"
#include "server/capture/image_file.hpp"
#include "server/capture/picture_size.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMostPictures = 1'000'000;

bool IsFolder(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error);
}

absl::Status NoRate(const std::filesystem::path& folder, const std::filesystem::path& list) {
  return absl::InvalidArgumentError(absl::StrCat(folder.string(),
                                                 ": fps: ", list.filename().string(),
                                                 " has time stamps of its own; leave it out"));
}

absl::StatusOr<DatasetLayout> ReadTum(const std::filesystem::path& folder,
                                      const SourceOptions& options) {
  DatasetLayout layout{.list = folder / "rgb.txt",
                       .pictures = folder,
                       .entries = {},
                       .camera = {},
                       .camera_file = "camera.yaml",
                       .remark = ""};
  if (options.fps) return NoRate(folder, layout.list);
  absl::StatusOr<std::vector<ImageEntry>> entries = LoadImageList(layout.list);
  if (!entries.ok()) return entries.status();
  layout.entries = *std::move(entries);
  const absl::StatusOr<CameraIntrinsics> camera =
      LoadCamera(options.camera_file.empty() ? folder / "camera.yaml" : options.camera_file,
                 [&] { return SizeOfFirstPicture(folder, layout.entries, options.first_frame); });
  if (!camera.ok()) return camera.status();
  layout.camera = *camera;
  return layout;
}

absl::StatusOr<DatasetLayout> ReadEuroc(const std::filesystem::path& folder,
                                        const SourceOptions& options) {
  const std::filesystem::path cam0 = folder / "cam0";
  DatasetLayout layout{.list = cam0 / "data.csv",
                       .pictures = cam0 / "data",
                       .entries = {},
                       .camera = {},
                       .camera_file = "sensor.yaml",
                       .remark = ""};
  if (options.fps) return NoRate(folder, layout.list);
  absl::StatusOr<std::vector<ImageEntry>> entries = LoadEurocList(layout.list);
  if (!entries.ok()) return entries.status();
  layout.entries = *std::move(entries);
  const absl::StatusOr<CameraIntrinsics> camera = LoadCamera(
      options.camera_file.empty() ? cam0 / "sensor.yaml" : options.camera_file,
      [&] { return SizeOfFirstPicture(layout.pictures, layout.entries, options.first_frame); });
  if (!camera.ok()) return camera.status();
  layout.camera = *camera;
  if (!options.camera_file.empty()) layout.camera_file = "the camera file";
  return layout;
}

bool IsPicture(const std::filesystem::path& file) {
  static constexpr const char* kEndings[] = {".png", ".jpg", ".jpeg", ".pgm",  ".ppm",
                                             ".pnm", ".bmp", ".tif",  ".tiff", ".webp"};
  const std::string ending = absl::AsciiStrToLower(file.extension().string());
  return std::find(std::begin(kEndings), std::end(kEndings), ending) != std::end(kEndings);
}

/// Numbers within names by value: "p2.png" before "p10.png".
bool NaturallyBefore(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!absl::ascii_isdigit(a[i]) || !absl::ascii_isdigit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const auto number = [](const std::string& text, std::size_t& at) {
      while (at < text.size() && text[at] == '0') ++at;
      const std::size_t begin = at;
      while (at < text.size() && absl::ascii_isdigit(text[at])) ++at;
      return text.substr(begin, at - begin);
    };
    const std::string one = number(a, i), other = number(b, j);
    if (one.size() != other.size()) return one.size() < other.size();
    if (one != other) return one < other;
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;  // "1" and "01": any order, but always the same
}

std::vector<std::string> PicturesIn(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (auto at = std::filesystem::directory_iterator(folder, error);
       !error && at != std::filesystem::directory_iterator(); at.increment(error)) {
    if (IsPicture(at->path()) && names.size() < kMostPictures) {
      names.push_back(at->path().filename().string());
    }
  }
  std::sort(names.begin(), names.end(), NaturallyBefore);
  return names;
}

/// A lens for pictures that come with none, by the first that can be read.
absl::StatusOr<CameraIntrinsics> AssumeLens(const DatasetLayout& layout, double fps) {
  constexpr std::size_t kTries = 50;
  absl::Status last;
  for (std::size_t i = 0; i < std::min(kTries, layout.entries.size()); ++i) {
    const absl::StatusOr<Picture> picture = LoadPicture(layout.pictures / layout.entries[i].file);
    if (picture.ok()) return AssumedLens(picture->grey.size(), /*turned=*/false, fps);
    last = picture.status();
  }
  return absl::DataLossError(absl::StrCat("no picture can be decoded; ", last.message()));
}

absl::StatusOr<DatasetLayout> ReadPictures(const std::filesystem::path& folder,
                                           const std::vector<std::string>& names,
                                           const SourceOptions& options) {
  if (!options.fps) {
    return absl::InvalidArgumentError(absl::StrCat(
        folder.string(), ": holds ", names.size(),
        " pictures and no rgb.txt that says when they were taken; write one, or give their rate: "
        "dataset:DIR?fps=30"));
  }
  DatasetLayout layout{.list = folder,
                       .pictures = folder,
                       .entries = {},
                       .camera = {},
                       .camera_file = "camera.yaml",
                       .remark = ""};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto time_ns =
        static_cast<Timestamp>(std::llround(1e9 * static_cast<double>(i) / *options.fps));
    layout.entries.push_back({EurocSeconds(time_ns), time_ns, names[i], static_cast<int>(i + 1)});
  }
  const std::filesystem::path own = folder / "camera.yaml";
  absl::StatusOr<CameraIntrinsics> camera = CameraIntrinsics();
  if (!options.camera_file.empty() || MayExist(own)) {
    camera = LoadCamera(options.camera_file.empty() ? own : options.camera_file, [&] {
      return SizeOfFirstPicture(folder, layout.entries, options.first_frame);
    });
  } else {
    camera = AssumeLens(layout, *options.fps);
    layout.camera_file = "the first picture";
    layout.remark = kAssumedLensWords;
  }
  if (!camera.ok()) return camera.status();
  layout.camera = *camera;
  layout.camera.fps = *options.fps;
  return layout;
}

}  // namespace

absl::StatusOr<DatasetLayout> ReadDatasetLayout(const std::filesystem::path& folder,
                                                const SourceOptions& options) {
  if (!IsFolder(folder)) {
    return absl::NotFoundError(absl::StrCat(
        folder.string(), ": no such folder; give the folder that holds rgb.txt and camera.yaml"));
  }
  if (IsFolder(folder / "mav0")) return ReadEuroc(folder / "mav0", options);
  if (MayExist(folder / "rgb.txt")) return ReadTum(folder, options);
  if (IsFolder(folder / "cam0")) return ReadEuroc(folder, options);
  const std::vector<std::string> names = PicturesIn(folder);
  if (!names.empty()) return ReadPictures(folder, names, options);
  return ReadTum(folder, options);  // says what is missing
}

}  // namespace saccade
