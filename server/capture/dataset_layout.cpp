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

/// A lens for pictures that come with none, by the first that can be read.
absl::Status AssumeLens(double fps, const SourceOptions& options, DatasetLayout& layout) {
  constexpr std::size_t kTries = 50;
  absl::Status last;
  for (std::size_t i = 0; i < std::min(kTries, layout.entries.size()); ++i) {
    const absl::StatusOr<DecodedPicture> picture =
        LoadPicture(layout.pictures / layout.entries[i].file);
    last = picture.status();
    if (!picture.ok()) continue;
    const double view_deg = options.view_deg.value_or(kAssumedView_deg);
    layout.camera = AssumedLens(picture->grey.size(), /*turned=*/false, fps, view_deg);
    layout.camera_file = "the first picture";
    layout.remark = AssumedLensWords(view_deg);
    layout.lens_assumed = true;
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("no picture can be decoded; ", last.message()));
}

/// Pictures a second, by the times of the list; 0: it has too few.
double RateOf(const std::vector<ImageEntry>& entries) {
  if (entries.size() < 2) return 0.0;
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < entries.size(); ++i) {
    steps_s.push_back(1e-9 * static_cast<double>(entries[i].time_ns - entries[i - 1].time_ns));
  }
  std::nth_element(steps_s.begin(), steps_s.begin() + std::ssize(steps_s) / 2, steps_s.end());
  const double middle_s = steps_s[steps_s.size() / 2];
  return middle_s > 0.0 ? 1.0 / middle_s : 0.0;
}

/// The recording's lens: as it is said to be, or assumed where `options` allow it.
absl::Status ReadLens(const std::filesystem::path& own, const SourceOptions& options,
                      DatasetLayout& layout) {
  const bool missing = options.camera_file.empty() && !MayExist(own);
  if (options.view_deg || (missing && options.lens_may_be_missing)) {
    return AssumeLens(RateOf(layout.entries), options, layout);
  }
  const absl::StatusOr<CameraIntrinsics> camera = LoadCamera(
      options.camera_file.empty() ? own : options.camera_file,
      [&] { return SizeOfFirstPicture(layout.pictures, layout.entries, options.first_frame); });
  if (!camera.ok()) return camera.status();
  layout.camera = *camera;
  return absl::OkStatus();
}

absl::StatusOr<DatasetLayout> ReadTum(const std::filesystem::path& folder,
                                      const SourceOptions& options) {
  DatasetLayout layout{.list = folder / "rgb.txt",
                       .pictures = folder,
                       .entries = {},
                       .camera = {},
                       .camera_file = "camera.yaml",
                       .remark = "",
                       .lens_assumed = false};
  if (options.fps) return NoRate(folder, layout.list);
  absl::StatusOr<std::vector<ImageEntry>> entries = LoadImageList(layout.list);
  if (!entries.ok()) return entries.status();
  layout.entries = *std::move(entries);
  if (const absl::Status status = ReadLens(folder / "camera.yaml", options, layout); !status.ok()) {
    return status;
  }
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
                       .remark = "",
                       .lens_assumed = false};
  if (options.fps) return NoRate(folder, layout.list);
  absl::StatusOr<std::vector<ImageEntry>> entries = LoadEurocList(layout.list);
  if (!entries.ok()) return entries.status();
  layout.entries = *std::move(entries);
  if (const absl::Status status = ReadLens(cam0 / "sensor.yaml", options, layout); !status.ok()) {
    return status;
  }
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
                       .remark = "",
                       .lens_assumed = false};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto time_ns =
        static_cast<Timestamp>(std::llround(1e9 * static_cast<double>(i) / *options.fps));
    layout.entries.push_back({EurocSeconds(time_ns), time_ns, names[i], static_cast<int>(i + 1)});
  }
  SourceOptions lens = options;
  lens.lens_may_be_missing = true;
  if (const absl::Status status = ReadLens(folder / "camera.yaml", lens, layout); !status.ok()) {
    return status;
  }
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
