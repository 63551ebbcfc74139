// Folders that are not in TUM layout: EuRoC, and pictures alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/capture/dataset.hpp"
#include "tests/unit/server/capture/dataset_fixture.hpp"

namespace saccade::layout_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Layout : public DatasetFixture {
 protected:
  absl::StatusOr<std::unique_ptr<FrameSource>> Open(const std::string& query = "") {
    return OpenSource("dataset:" + folder_.string() + query, {});
  }
  std::string Error(const std::string& query = "") {
    return std::string(Open(query).status().message());
  }
  static std::vector<Frame> Frames(FrameSource& source) {
    std::vector<Frame> frames;
    while (true) {
      const auto frame = source.Next();
      if (!frame.ok() || !*frame) return frames;
      frames.push_back(**frame);
    }
  }
  /// The fixture's pictures as EuRoC has them.
  void MakeEuroc() {
    std::filesystem::create_directories(folder_ / "mav0/cam0/data");
    std::string list = "#timestamp [ns],filename\r\n";
    for (int i = 0; i < kFrames; ++i) {
      const std::string stamp = "140363657976355558" + std::to_string(i);
      cv::imwrite((folder_ / "mav0/cam0/data" / (stamp + ".png")).string(), PictureOf(i));
      list += stamp + "," + stamp + ".png\r\n";
    }
    Write("mav0/cam0/data.csv", list);
    Write("mav0/cam0/sensor.yaml", kSensor);
    std::filesystem::remove(folder_ / "rgb.txt");
    std::filesystem::remove(folder_ / "camera.yaml");
  }
  /// Pictures alone: 0.png, 1.png, ... without leading zeros.
  void MakePlain(int count) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directory(folder_);
    for (int i = 0; i < count; ++i) {
      cv::imwrite((folder_ / ("shot" + std::to_string(i) + ".png")).string(), PictureOf(i));
    }
    Write("notes.txt", "not a picture");
  }

  // As the EuRoC MAV data set writes it, for smaller pictures.
  static constexpr char kSensor[] =
      "# General sensor definitions.\nsensor_type: camera\ncomment: VI-Sensor cam0 (MT9M034)\n"
      "# Sensor extrinsics wrt. the body-frame.\nT_BS:\n  cols: 4\n  rows: 4\n"
      "  data: [1, 0, 0, 0,\n         0, 1, 0, 0,\n         0, 0, 1, 0,\n         0, 0, 0, 1]\n"
      "# Camera specific definitions.\nrate_hz: 20\nresolution: [64, 48]\n"
      "camera_model: pinhole\nintrinsics: [58.5, 57.5, 31.25, 24.5] #fu, fv, cu, cv\n"
      "distortion_model: radial-tangential\n"
      "distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n";
};

TEST_F(Layout, EurocIsReadWithItsLensAndItsNanoseconds) {
  MakeEuroc();
  const auto source = Open();
  ASSERT_TRUE(source.ok()) << source.status();
  const CameraIntrinsics& lens = (*source)->info().camera->intrinsics();
  EXPECT_EQ(lens.model, LensModel::kBrownConrady);
  EXPECT_THAT(lens.distortion, ElementsAre(-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0));
  EXPECT_EQ(lens.fx, 58.5);
  EXPECT_EQ(lens.fy, 57.5);
  EXPECT_EQ(lens.cx, 31.25);
  EXPECT_EQ(lens.cy, 24.5);
  EXPECT_EQ(lens.fps, 20);
  const std::vector<Frame> frames = Frames(**source);
  ASSERT_EQ(frames.size(), std::size_t{kFrames});
  EXPECT_EQ(frames[3].id, 3u);
  EXPECT_EQ(frames[3].capture_time_ns, 1403636579763555583);
  EXPECT_EQ(frames[3].source_timestamp, "1403636579.763555583");
  EXPECT_EQ(cv::norm(frames[3].grey, PictureOf(3), cv::NORM_INF), 0);
  // Also by its own folder.
  EXPECT_TRUE(OpenSource("dataset:" + (folder_ / "mav0").string(), {}).ok());
}

TEST_F(Layout, EurocIsRefusedWithFileLineAndRemedy) {
  MakeEuroc();
  const auto sensor = [&](const std::string& from, const std::string& to) {
    std::string text = kSensor;
    text.replace(text.find(from), from.size(), to);
    Write("mav0/cam0/sensor.yaml", text);
    return Error();
  };
  EXPECT_EQ(sensor("radial-tangential", "equidistant"), "");
  EXPECT_THAT(sensor("radial-tangential", "cylindrical"),
              AllOf(HasSubstr("sensor.yaml:17: distortion_model"), HasSubstr("cylindrical")));
  EXPECT_THAT(sensor("camera_model: pinhole", "camera_model: omni"), HasSubstr("camera_model"));
  EXPECT_THAT(sensor(", 24.5]", "]"), HasSubstr("intrinsics"));
  EXPECT_THAT(sensor("31.25", "458.25"), HasSubstr("intrinsics[2]: 458.25"));
  EXPECT_THAT(sensor("[64, 48]", "[64, 50]"),
              AllOf(HasSubstr("is 64x48 but sensor.yaml says 64x50")));
  Write("mav0/cam0/sensor.yaml", kSensor);
  Write("mav0/cam0/data.csv", "#t\n10,a.png\n10,b.png\n");
  EXPECT_THAT(Error(), AllOf(HasSubstr("data.csv:3: time stamp 10 is not after 10 of line 2")));
  Write("mav0/cam0/data.csv", "#t\n1.5,a.png\n");
  EXPECT_THAT(Error(), AllOf(HasSubstr("data.csv:2: the time stamp is not a whole number")));
  Write("mav0/cam0/data.csv", "#t\n15\n");
  EXPECT_THAT(Error(), HasSubstr("data.csv:2: has no file name"));
  Write("mav0/cam0/data.csv", "");
  EXPECT_THAT(Error(), HasSubstr("lists no picture"));
  std::filesystem::remove(folder_ / "mav0/cam0/sensor.yaml");
  MakeEuroc();
  EXPECT_THAT(Error("?fps=30"), HasSubstr("time stamps of its own"));
}

TEST_F(Layout, PicturesAloneAreReadInTheOrderOfTheirNumbersAtTheirRate) {
  MakePlain(12);
  const auto source = Open("?fps=25");
  ASSERT_TRUE(source.ok()) << source.status();
  const std::vector<Frame> frames = Frames(**source);
  ASSERT_EQ(frames.size(), 12u);
  for (int i = 0; i < 12; ++i) {
    EXPECT_EQ(frames[i].capture_time_ns, 40'000'000 * i);
    EXPECT_EQ(cv::norm(frames[i].grey, PictureOf(i), cv::NORM_INF), 0) << i;
  }
  EXPECT_EQ(frames[2].source_timestamp, "0.080000000");
  const CameraIntrinsics& lens = (*source)->info().camera->intrinsics();
  EXPECT_NEAR(lens.fx, 32 / std::tan(std::numbers::pi / 6), 1e-9);
  EXPECT_EQ(lens.fps, 25);
  EXPECT_THAT((*source)->info().remark, AllOf(HasSubstr("60 deg"), HasSubstr("not metric")));
  Write("camera.yaml", kCamera);
  const auto measured = Open("?fps=25");
  ASSERT_TRUE(measured.ok());
  EXPECT_EQ((*measured)->info().camera->intrinsics().fx, 60);
  EXPECT_EQ((*measured)->info().remark, "");
}

TEST_F(Layout, PicturesAloneNeedARateAndListsDoNot) {
  MakePlain(3);
  EXPECT_THAT(Error(), AllOf(HasSubstr("holds 3 pictures and no rgb.txt"), HasSubstr("?fps=30")));
  EXPECT_THAT(Error("?fps=0"), HasSubstr("fps '0' is not a number from 0.1 to 1000"));
  EXPECT_THAT(Error("?rate=30"), HasSubstr("rate is not known; there are fps"));
  Write("rgb.txt", "0.0 shot0.png\n0.1 shot1.png\n");
  Write("camera.yaml", kCamera);
  EXPECT_TRUE(Open().ok());
  EXPECT_THAT(Error("?fps=30"), HasSubstr("rgb.txt has time stamps of its own"));
}

}  // namespace
}  // namespace saccade::layout_test
