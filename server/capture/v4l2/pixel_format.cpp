#include "server/capture/v4l2/pixel_format.hpp"

#include <absl/strings/str_cat.h>
#include <linux/videodev2.h>

#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

/// A view of the driver's bytes; OpenCV does not write into it.
cv::Mat View(const V4l2Layout& layout, int rows, int type, std::span<const std::uint8_t> bytes) {
  return cv::Mat(rows, layout.width, type, const_cast<std::uint8_t*>(bytes.data()),
                 static_cast<std::size_t>(layout.stride));
}

DecodedPicture FromYuyv(const V4l2Layout& layout, std::span<const std::uint8_t> bytes) {
  const cv::Mat pairs = View(layout, layout.height, CV_8UC2, bytes);
  DecodedPicture picture;
  cv::extractChannel(pairs, picture.grey, 0);
  cv::cvtColor(pairs, picture.color, cv::COLOR_YUV2BGR_YUYV);
  return picture;
}

DecodedPicture FromNv12(const V4l2Layout& layout, std::span<const std::uint8_t> bytes) {
  const cv::Mat planes = View(layout, layout.height * 3 / 2, CV_8UC1, bytes);
  DecodedPicture picture;
  picture.grey = planes.rowRange(0, layout.height).clone();
  cv::cvtColor(planes, picture.color, cv::COLOR_YUV2BGR_NV12);
  return picture;
}

absl::StatusOr<DecodedPicture> FromMjpeg(const V4l2Layout& layout,
                                         std::span<const std::uint8_t> bytes) {
  const cv::Size size(layout.width, layout.height);
  return DecodePicture(bytes, [&](cv::Size is) {
    if (is == size) return absl::OkStatus();
    return absl::DataLossError(absl::StrCat("the JPEG is ", is.width, "x", is.height, " and not ",
                                            size.width, "x", size.height));
  });
}

}  // namespace

std::size_t WholeBytes(const V4l2Layout& layout) {
  const std::size_t plane = static_cast<std::size_t>(layout.stride) * layout.height;
  switch (layout.fourcc) {
    case V4L2_PIX_FMT_YUYV:
    case V4L2_PIX_FMT_GREY:
      return plane;
    case V4L2_PIX_FMT_NV12:
      return plane + plane / 2;
    default:
      return 0;
  }
}

absl::StatusOr<DecodedPicture> PictureFrom(const V4l2Layout& layout,
                                           std::span<const std::uint8_t> bytes) {
  if (const std::size_t whole = WholeBytes(layout); bytes.size() < whole) {
    return absl::DataLossError(
        absl::StrCat("the picture is torn: ", bytes.size(), " of ", whole, " bytes"));
  }
  try {
    switch (layout.fourcc) {
      case V4L2_PIX_FMT_YUYV:
        return FromYuyv(layout, bytes);
      case V4L2_PIX_FMT_NV12:
        return FromNv12(layout, bytes);
      case V4L2_PIX_FMT_GREY:
        return DecodedPicture{View(layout, layout.height, CV_8UC1, bytes).clone(), {}};
      default:
        return FromMjpeg(layout, bytes);
    }
  } catch (const std::exception& e) {  // no memory
    return absl::DataLossError(absl::StrCat("the picture cannot be read (", e.what(), ")"));
  }
}

}  // namespace saccade
