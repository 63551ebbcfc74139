#include "server/app/picture_reader.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstdint>
#include <exception>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <span>
#include <utility>

#include "server/capture/picture_header.hpp"
#include "server/identity/secret.hpp"
#include "shared/scene/limits.hpp"

namespace saccade {
namespace {

using Bytes = std::span<const std::uint8_t>;

// Of a progressive JPEG; each passes over the whole picture. Encoders write some ten.
constexpr int kMostScans = 64;

Bytes BytesOf(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

absl::Status Bad(absl::string_view problem) {
  return absl::InvalidArgumentError(absl::StrCat("draft.picture: ", problem));
}

/// Empty: neither.
std::string MediaType(Bytes data) {
  static constexpr std::uint8_t kPng[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  static constexpr std::uint8_t kJpeg[] = {0xff, 0xd8, 0xff};
  const auto begins = [data](Bytes magic) {
    return data.size() > magic.size() && std::equal(magic.begin(), magic.end(), data.begin());
  };
  return begins(kPng) ? "image/png" : begins(kJpeg) ? "image/jpeg" : "";
}

/// Decoders draw half a picture without a word.
bool PngIsWhole(Bytes data) {
  for (std::size_t at = 8; data.size() - at >= 12;) {
    const std::size_t length = std::size_t{data[at]} << 24 | std::size_t{data[at + 1]} << 16 |
                               std::size_t{data[at + 2]} << 8 | data[at + 3];
    if (length > data.size() - at - 12) return false;
    const std::uint8_t* type = &data[at + 4];
    if (std::equal(type, type + 4, "IEND")) return true;
    at += 12 + length;
  }
  return false;
}

/// The number of its passes; 0: it has no end.
int JpegScans(Bytes data) {
  int scans = 0;
  bool ended = false;
  for (std::size_t i = 0; i + 1 < data.size(); ++i) {
    if (data[i] != 0xff) continue;
    if (data[i + 1] == 0xda) {
      ++scans;
      ended = false;
    }
    if (data[i + 1] == 0xd9) ended = true;
  }
  return ended ? scans : 0;
}

cv::Mat Decode(const std::string& bytes) {
  try {
    const cv::Mat data(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
    return cv::imdecode(data, cv::IMREAD_COLOR);
  } catch (const std::exception&) {  // OpenCV throws at what it will not read
    return {};
  }
}

}  // namespace

absl::StatusOr<PicturePtr> ReadPictureFile(std::string bytes) {
  const Bytes data = BytesOf(bytes);
  if (data.size() > kMaxPictureBytes) {
    return Bad(absl::StrCat("at most ", kMaxPictureBytes, " bytes, not ", data.size(),
                            ": make it smaller"));
  }
  const std::string media_type = MediaType(data);
  if (media_type.empty()) return Bad("is neither PNG nor JPEG");
  const absl::StatusOr<cv::Size> size = ReadPictureSize(data);
  if (!size.ok()) return Bad(size.status().message());
  if (size->width > kMaxPictureSide || size->height > kMaxPictureSide) {
    return Bad(absl::StrCat("is ", size->width, " x ", size->height, " px; at most ",
                            kMaxPictureSide, " a side: make it smaller"));
  }
  const bool png = media_type == "image/png";
  const int scans = png ? 1 : JpegScans(data);
  if (scans == 0 || (png && !PngIsWhole(data))) return Bad("is cut off: it has no end");
  if (scans > kMostScans) return Bad("has more passes than any picture needs");
  const cv::Mat decoded = Decode(bytes);
  if (decoded.empty()) return Bad("is damaged: it cannot be decoded");
  auto picture = std::make_shared<Picture>();
  picture->sha256 = Sha256Hex(bytes);
  picture->media_type = media_type;
  picture->width = decoded.cols;  // as it is shown: a JPEG may say that it lies on its side
  picture->height = decoded.rows;
  picture->bytes = std::move(bytes);
  return PicturePtr(std::move(picture));
}

cv::Mat DecodePicture(const Picture& picture, int max_side) {
  cv::Mat decoded = Decode(picture.bytes);
  const int side = std::max(decoded.cols, decoded.rows);
  if (side <= max_side) return decoded;
  const double share = static_cast<double>(max_side) / side;
  const cv::Size size(std::max(1, cvRound(share * decoded.cols)),
                      std::max(1, cvRound(share * decoded.rows)));
  cv::Mat small;
  cv::resize(decoded, small, size, 0, 0, cv::INTER_AREA);
  return small;
}

}  // namespace saccade
