#include "server/capture/image_file.hpp"

#include <absl/strings/str_cat.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <span>
#include <vector>

namespace saccade {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kMaxBytes = std::size_t{256} << 20;

bool StartsWith(Bytes data, Bytes magic) {
  return data.size() >= magic.size() && std::memcmp(data.data(), magic.data(), magic.size()) == 0;
}

/// JPEG: the end-of-image marker must be there, but for trailing zero bytes.
bool JpegIsWhole(Bytes data) {
  std::size_t end = data.size();
  while (end > 2 && data[end - 1] == 0) --end;
  return data[end - 2] == 0xFF && data[end - 1] == 0xD9;
}

/// PNG: chunks must follow each other up to IEND.
bool PngIsWhole(Bytes data) {
  std::size_t at = 8;
  while (at + 12 <= data.size()) {
    const std::uint32_t length =
        (std::uint32_t{data[at]} << 24) | (data[at + 1] << 16) | (data[at + 2] << 8) | data[at + 3];
    if (std::memcmp(&data[at + 4], "IEND", 4) == 0) return true;
    at += std::size_t{12} + length;
  }
  return false;
}

absl::Status CheckWhole(Bytes data) {
  constexpr std::uint8_t kJpeg[] = {0xFF, 0xD8, 0xFF};
  constexpr std::uint8_t kPng[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  if (data.empty()) return absl::DataLossError("the file is empty");
  if (StartsWith(data, kJpeg) && !JpegIsWhole(data)) {
    return absl::DataLossError("the JPEG is truncated");
  }
  if (StartsWith(data, kPng) && !PngIsWhole(data)) {
    return absl::DataLossError("the PNG is truncated");
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::uint8_t>> ReadBytes(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error) return absl::NotFoundError(error.message());
  if (size > kMaxBytes) return absl::DataLossError("the file is too large for a picture");
  std::vector<std::uint8_t> bytes(size);
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!stream) return absl::DataLossError("the file cannot be read");
  return bytes;
}

absl::StatusOr<Picture> Decode(const std::vector<std::uint8_t>& bytes) {
  cv::Mat decoded;
  try {
    decoded = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& e) {
    return absl::DataLossError(absl::StrCat("the decoder refused it (", e.err, ")"));
  }
  if (decoded.empty()) return absl::DataLossError("it is damaged or not a picture");
  if (decoded.depth() != CV_8U) {
    return absl::DataLossError("it has more than 8 bits a channel; convert it to 8 bits");
  }
  Picture picture;
  if (decoded.channels() == 1) {
    picture.grey = decoded;
  } else if (decoded.channels() == 3 || decoded.channels() == 4) {
    if (decoded.channels() == 4) cv::cvtColor(decoded, decoded, cv::COLOR_BGRA2BGR);
    picture.color = decoded;
    cv::cvtColor(decoded, picture.grey, cv::COLOR_BGR2GRAY);
  } else {
    return absl::DataLossError(absl::StrCat("it has ", decoded.channels(), " channels"));
  }
  return picture;
}

}  // namespace

absl::StatusOr<Picture> LoadPicture(const std::filesystem::path& file) {
  const auto named = [&file](const absl::Status& status) {
    return absl::Status(status.code(), absl::StrCat(file.string(), ": ", status.message()));
  };
  const auto bytes = ReadBytes(file);
  if (!bytes.ok()) return named(bytes.status());
  if (const absl::Status whole = CheckWhole(*bytes); !whole.ok()) return named(whole);
  absl::StatusOr<Picture> picture = Decode(*bytes);
  if (!picture.ok()) return named(picture.status());
  return picture;
}

}  // namespace saccade
