#include "tests/integration/support/small_dataset.hpp"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace saccade::testing {
namespace {

// Noise with detail of a few pixels, so that there are corners to find.
cv::Mat Texture(int width, int height, cv::RNG& random) {
  cv::Mat coarse((height + 5) / 6, (width + 5) / 6, CV_8UC1);
  random.fill(coarse, cv::RNG::UNIFORM, 20, 236);
  cv::Mat texture;
  cv::resize(coarse, texture, {width, height}, 0, 0, cv::INTER_NEAREST);
  cv::GaussianBlur(texture, texture, {0, 0}, 0.8);
  return texture;
}

}  // namespace

void WriteSmallDataset(const std::string& folder, const SmallDatasetOptions& options) {
  namespace fs = std::filesystem;
  constexpr double kWallM = 1.5, kBoxM = 0.9, kSwayM = 0.1, kPeriodS = 2.0, kFps = 30.0;
  const double focal_px = 0.9 * options.width;
  const int margin = static_cast<int>(focal_px * kSwayM / kBoxM) + 4;
  fs::create_directories(fs::path(folder) / "rgb");
  std::ofstream(fs::path(folder) / "camera.yaml")
      << "model: pinhole\nwidth: " << options.width << "\nheight: " << options.height
      << "\nfx: " << focal_px << "\nfy: " << focal_px << "\ncx: " << 0.5 * (options.width - 1)
      << "\ncy: " << 0.5 * (options.height - 1) << "\nfps: 30\n";
  cv::RNG random(options.seed);
  const cv::Mat wall = Texture(options.width + 2 * margin, options.height, random);
  const cv::Mat box = Texture(options.width / 4, options.height / 3, random);
  std::ofstream list(fs::path(folder) / "rgb.txt");
  list << "# timestamp filename\n";
  for (int i = 0; i < options.frames; ++i) {
    const double t = i / kFps;
    const double x_m = kSwayM * std::sin(2 * std::numbers::pi * t / kPeriodS);
    // Sub-pixel shifts: a camera that moves to the right sees things move to the left.
    const auto shift = [&](double depth_m) {
      return static_cast<float>(-focal_px * x_m / depth_m);
    };
    cv::Mat frame;
    cv::getRectSubPix(wall, {options.width, options.height},
                      {static_cast<float>(0.5 * (wall.cols - 1)) - shift(kWallM),
                       0.5f * static_cast<float>(options.height - 1)},
                      frame);
    const int left = static_cast<int>(std::lround(0.375 * options.width + shift(kBoxM)));
    box.copyTo(frame(cv::Rect(left, options.height / 3, box.cols, box.rows)));
    char name[32];
    std::snprintf(name, sizeof name, "%.6f", t);
    cv::imwrite((fs::path(folder) / "rgb" / (std::string(name) + ".png")).string(), frame);
    list << name << " rgb/" << name << ".png\n";
  }
}

}  // namespace saccade::testing
