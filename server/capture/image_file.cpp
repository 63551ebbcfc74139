#include "server/capture/image_file.hpp"

#include <absl/strings/str_cat.h>

#include <cstdint>
#include <cstring>
#include <exception>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <span>
#include <string>

#include "server/capture/picture_header.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kMaxPictureFileBytes = std::size_t{256} << 20;

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

absl::Status CheckSize(cv::Size size, const SizeCheck& check) {
  if (check) {
    if (absl::Status status = check(size); !status.ok()) return status;
  }
  const std::int64_t pixels = std::int64_t{size.width} * size.height;
  if (size.width > kMaxPictureSide_px || size.height > kMaxPictureSide_px ||
      pixels > kMaxPicturePixels) {
    return absl::DataLossError(absl::StrCat("it is ", size.width, "x", size.height, "; at most ",
                                            kMaxPictureSide_px, " a side and ", kMaxPicturePixels,
                                            " pixels are decoded: scale it down"));
  }
  return absl::OkStatus();
}

/// May throw what OpenCV and the allocator throw.
absl::StatusOr<DecodedPicture> Decode(Bytes bytes) {
  // A view of the bytes; OpenCV does not write into it.
  const cv::Mat view(1, static_cast<int>(bytes.size()), CV_8UC1,
                     const_cast<std::uint8_t*>(bytes.data()));
  cv::Mat decoded = cv::imdecode(view, cv::IMREAD_UNCHANGED);
  if (decoded.empty()) return absl::DataLossError("it is damaged or not a picture");
  if (decoded.depth() != CV_8U) {
    return absl::DataLossError("it has more than 8 bits a channel; convert it to 8 bits");
  }
  DecodedPicture picture;
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

absl::StatusOr<DecodedPicture> DecodePicture(Bytes bytes, const SizeCheck& check) {
  if (const absl::Status whole = CheckWhole(bytes); !whole.ok()) return whole;
  const absl::StatusOr<cv::Size> size = ReadPictureSize(bytes);
  if (!size.ok()) return size.status();
  if (const absl::Status fits = CheckSize(*size, check); !fits.ok()) return fits;
  try {
    return Decode(bytes);
  } catch (const cv::Exception& e) {
    return absl::DataLossError(absl::StrCat("the decoder refused it (", e.err, ")"));
  } catch (const std::exception& e) {  // no memory
    return absl::DataLossError(absl::StrCat("it cannot be decoded (", e.what(), ")"));
  }
}

absl::StatusOr<DecodedPicture> LoadPicture(const std::filesystem::path& file,
                                           const SizeCheck& check) {
  const absl::StatusOr<std::string> bytes =
      ReadRegularFile(file, kMaxPictureFileBytes, "a picture");
  if (absl::IsNotFound(bytes.status()) || absl::IsResourceExhausted(bytes.status())) {
    return bytes.status();
  }
  if (!bytes.ok()) return absl::DataLossError(bytes.status().message());
  absl::StatusOr<DecodedPicture> picture =
      DecodePicture({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()}, check);
  if (picture.ok()) return picture;
  return absl::Status(picture.status().code(),
                      absl::StrCat(file.string(), ": ", picture.status().message()));
}

}  // namespace saccade
