#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

namespace saccade {

/// A small, whole data set in a folder of its own, for tests to damage.
class DatasetFixture : public ::testing::Test {
 protected:
  static constexpr int kWidth = 64, kHeight = 48, kFrames = 6;

  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "saccade-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    std::filesystem::create_directory(folder_ / "rgb");
    std::string list = "# timestamp filename\n";
    for (int i = 0; i < kFrames; ++i) {
      const std::string stamp = "10.0" + std::to_string(i) + "0000";
      list += stamp + " rgb/" + std::to_string(i) + Extension(i) + "\n";
      cv::imwrite(PicturePath(i).string(), PictureOf(i));
    }
    Write("rgb.txt", list);
    Write("camera.yaml", kCamera);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static std::string Extension(int i) { return i % 2 == 0 ? ".png" : ".jpg"; }
  std::filesystem::path PicturePath(int i) const {
    return folder_ / "rgb" / (std::to_string(i) + Extension(i));
  }
  /// Grey ramp whose mean tells the frame.
  static cv::Mat PictureOf(int i) {
    cv::Mat picture(kHeight, kWidth, CV_8UC1);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) picture.at<std::uint8_t>(v, u) = 20 * i + u + v;
    }
    return picture;
  }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  void Truncate(const std::filesystem::path& file, double fraction) const {
    const auto size = std::filesystem::file_size(file);
    std::filesystem::resize_file(file, static_cast<std::uintmax_t>(size * fraction));
  }

  static constexpr char kCamera[] =
      "model: brown_conrady\nwidth: 64\nheight: 48\nfx: 60\nfy: 60\ncx: 32\ncy: 24\n"
      "distortion: [0.1, 0, 0, 0, 0]\nfps: 100\n";
  std::filesystem::path folder_;
};

}  // namespace saccade
