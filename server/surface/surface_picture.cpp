#include "server/surface/surface_picture.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace saccade {

void Rectifier::Prepare(const std::shared_ptr<const CameraModel>& camera) {
  if (lens_ == camera) return;
  lens_ = camera;
  const CameraIntrinsics& in = camera->intrinsics();
  const double scale = static_cast<double>(width_px_) / in.width;
  camera_.width = width_px_;
  camera_.height = static_cast<int>(std::lround(in.height * scale));
  camera_.focal_px = static_cast<float>(0.5 * (in.fx + in.fy) * scale);
  camera_.cx = static_cast<float>((in.cx + 0.5) * scale - 0.5);
  camera_.cy = static_cast<float>((in.cy + 0.5) * scale - 0.5);
  // Shrunk half the way before the lens is taken out, and the rest after it: neither step leaves
  // out pixels. Where the picture is not larger, it is taken as it is.
  middle_ = in.width >= 2 * width_px_ ? cv::Size(2 * camera_.width, 2 * camera_.height)
                                      : cv::Size(in.width, in.height);
  const double per_x = static_cast<double>(middle_.width) / in.width;
  const double per_y = static_cast<double>(middle_.height) / in.height;
  const cv::Size fine(2 * camera_.width, 2 * camera_.height);
  map_x_.create(fine, CV_32F);
  map_y_.create(fine, CV_32F);
  cv::Mat unseen(fine, CV_8U, cv::Scalar(0));
  for (int y = 0; y < fine.height; ++y) {
    for (int x = 0; x < fine.width; ++x) {
      const Eigen::Vector3f ray =
          camera_.Ray((static_cast<float>(x) - 0.5f) / 2.0f, (static_cast<float>(y) - 0.5f) / 2.0f);
      const auto pixel = camera->Project(ray.cast<double>());
      const bool seen = pixel && camera->InImage(*pixel, 1.0);
      unseen.at<std::uint8_t>(y, x) = seen ? 0 : 255;
      map_x_.at<float>(y, x) = seen ? static_cast<float>((pixel->x() + 0.5) * per_x - 0.5) : 0.0f;
      map_y_.at<float>(y, x) = seen ? static_cast<float>((pixel->y() + 0.5) * per_y - 0.5) : 0.0f;
    }
  }
  cv::resize(unseen, unseen_, {camera_.width, camera_.height}, 0, 0, cv::INTER_AREA);
}

SurfacePicture Rectifier::Rectify(const Frame& frame) {
  Prepare(frame.camera);
  const cv::Size small(camera_.width, camera_.height);
  const auto shrink = [&](const cv::Mat& picture) {
    cv::Mat middle, fine, out;
    cv::resize(picture, middle, middle_, 0, 0, cv::INTER_AREA);
    cv::remap(middle, fine, map_x_, map_y_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    cv::resize(fine, out, small, 0, 0, cv::INTER_AREA);
    return out;
  };
  SurfacePicture picture;
  picture.camera = camera_;
  shrink(frame.grey).convertTo(picture.grey, CV_32F);
  picture.grey.setTo(-1.0f, unseen_);
  if (frame.color.empty()) {
    cv::cvtColor(shrink(frame.grey), picture.color, cv::COLOR_GRAY2BGR);
  } else {
    picture.color = shrink(frame.color);
  }
  return picture;
}

}  // namespace saccade
