#include "tests/bench/textured_scene.hpp"

#include <cstdlib>
#include <opencv2/imgproc.hpp>

namespace saccade {

TexturedScene::TexturedScene() {
  cv::setNumThreads(1);
  cv::Mat fine(480, 640, CV_32FC1), rough(480, 640, CV_32FC1);
  cv::RNG random(1);
  random.fill(fine, cv::RNG::NORMAL, 0, 160);
  random.fill(rough, cv::RNG::NORMAL, 0, 900);
  cv::GaussianBlur(fine, fine, cv::Size(0, 0), 1.5);
  cv::GaussianBlur(rough, rough, cv::Size(0, 0), 6.0);
  cv::Mat sum = fine + rough + 128;
  sum.convertTo(image, CV_8UC1);
  CameraIntrinsics k;
  k.model = LensModel::kBrownConrady;
  k.width = 640;
  k.height = 480;
  k.fx = 517.3;
  k.fy = 516.5;
  k.cx = 318.6;
  k.cy = 255.3;
  k.distortion = {0.2624, -0.9531, -0.0054, 0.0026, 1.1633};
  camera = std::make_shared<CameraModel>(k);
  if (!pyramid.Build(image).ok()) std::abort();
  CornerDetector detector({.min_score = 1000, .border_px = 40});
  detector.DetectAll(pyramid, {}, 100, corners);
  for (const Corner& corner : corners) {
    patches.push_back(*CutPatch(image, corner.pixel, camera));
  }
}

const TexturedScene& TheScene() {
  static const TexturedScene scene;
  return scene;
}

}  // namespace saccade
