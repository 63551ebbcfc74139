#include "client/view/picture_file.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <system_error>
#include <vector>

#include "client/view/pdf_page.hpp"

namespace saccade::view {
namespace {

constexpr std::size_t kMostBytes = 1 << 20;  // annotation.proto
constexpr int kMostSide = 4096;              // annotation.proto
constexpr std::uintmax_t kMostFileBytes = 64 << 20;

/// Of 8 bits a channel; empty: it cannot be decoded.
cv::Mat Decoded(const std::string& bytes) {
  const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
  const bool png = absl::StartsWith(bytes, "\x89PNG\r\n\x1a\n");
  try {
    cv::Mat picture = cv::imdecode(raw, png ? cv::IMREAD_UNCHANGED : cv::IMREAD_COLOR);
    if (picture.depth() == CV_16U) picture.convertTo(picture, CV_8U, 1.0 / 257);
    return picture;
  } catch (const cv::Exception&) {
    return {};  // too large for OpenCV
  }
}

/// JPEG has no transparency: what is seen through becomes paper.
cv::Mat OnPaper(const cv::Mat& picture) {
  if (picture.channels() != 4) return picture;
  cv::Mat out(picture.size(), CV_8UC3);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const auto& from = picture.at<cv::Vec4b>(y, x);
      for (int c = 0; c < 3; ++c) {
        out.at<cv::Vec3b>(y, x)[c] =
            static_cast<unsigned char>((from[c] * from[3] + 255 * (255 - from[3])) / 255);
      }
    }
  }
  return out;
}

PicturePtr Made(const std::vector<unsigned char>& bytes, const char* media_type,
                const cv::Mat& picture) {
  return std::make_shared<const Picture>(
      Picture{"", media_type, picture.cols, picture.rows, std::string(bytes.begin(), bytes.end())});
}

PicturePtr Fitted(cv::Mat picture) {
  double scale =
      std::min(1.0, static_cast<double>(kMostSide) / std::max(picture.cols, picture.rows));
  for (;; scale *= 0.75) {
    cv::Mat scaled = picture;
    if (scale < 1) {
      const cv::Size size(std::max(1, static_cast<int>(picture.cols * scale)),
                          std::max(1, static_cast<int>(picture.rows * scale)));
      cv::resize(picture, scaled, size, 0, 0, cv::INTER_AREA);
    }
    std::vector<unsigned char> bytes;
    if (cv::imencode(".png", scaled, bytes) && bytes.size() <= kMostBytes) {
      return Made(bytes, "image/png", scaled);
    }
    for (const int quality : {90, 75}) {
      if (cv::imencode(".jpg", OnPaper(scaled), bytes, {cv::IMWRITE_JPEG_QUALITY, quality}) &&
          bytes.size() <= kMostBytes) {
        return Made(bytes, "image/jpeg", scaled);
      }
    }
  }
}

}  // namespace

absl::StatusOr<PicturePtr> LoadPicture(const std::string& file, int page) {
  namespace fs = std::filesystem;
  if (file.empty()) return absl::InvalidArgumentError("name a PNG, JPEG or PDF file.");
  std::error_code failed;
  if (!fs::is_regular_file(file, failed)) {
    return absl::NotFoundError(absl::StrCat("there is no file ", file, "."));
  }
  if (fs::file_size(file, failed) > kMostFileBytes) {
    return absl::InvalidArgumentError(absl::StrCat(file, " is larger than 64 MiB."));
  }
  std::ifstream in(file, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  if (!in) return absl::NotFoundError(absl::StrCat(file, " cannot be read."));
  if (absl::StartsWith(bytes, "%PDF-")) {
    absl::StatusOr<std::string> drawn = DrawPdfPage(file, page);
    if (!drawn.ok()) return drawn.status();
    bytes = *std::move(drawn);
  }
  const bool known =
      absl::StartsWith(bytes, "\x89PNG\r\n\x1a\n") || absl::StartsWith(bytes, "\xff\xd8\xff");
  if (!known)
    return absl::InvalidArgumentError(absl::StrCat(file, " is no PNG, no JPEG and no PDF."));
  const cv::Mat picture = Decoded(bytes);
  if (picture.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(file, " is damaged: it cannot be decoded."));
  }
  return Fitted(picture);
}

}  // namespace saccade::view
