#include "server/eval/record_source.hpp"

#include <gmock/gmock.h>

#include "server/capture/camera_file.hpp"
#include "server/capture/camera_yaml.hpp"
#include "server/capture/dataset.hpp"
#include "tests/unit/server/capture/dataset_fixture.hpp"

namespace saccade::record_source_test {
namespace {

using ::testing::HasSubstr;

class Record : public DatasetFixture {
 protected:
  std::unique_ptr<FrameSource> Open(const std::string& uri) {
    auto source = OpenSource(uri, {});
    EXPECT_TRUE(source.ok()) << source.status();
    return *std::move(source);
  }
  std::string Uri(const std::string& name) { return "dataset:" + (folder_ / name).string(); }
};

TEST_F(Record, WhatIsWrittenOpensAgainWithTheSamePicturesTimesAndLens) {
  const auto source = Open("dataset:" + folder_.string());
  const auto recorded = RecordSource(*source, folder_ / "again", {});
  ASSERT_TRUE(recorded.ok()) << recorded.status();
  EXPECT_EQ(recorded->frames, 6u);
  const auto first = Open("dataset:" + folder_.string()), again = Open(Uri("again"));
  const CameraIntrinsics& lens = again->info().camera->intrinsics();
  EXPECT_EQ(lens.distortion, first->info().camera->intrinsics().distortion);
  EXPECT_EQ(lens.fx, 60);
  EXPECT_EQ(lens.fps, 100);
  for (int i = 0; i < kFrames; ++i) {
    const auto one = first->Next(), other = again->Next();
    ASSERT_TRUE(one.ok() && *one && other.ok() && *other);
    EXPECT_EQ((*other)->source_timestamp, (*one)->source_timestamp);
    EXPECT_EQ((*other)->capture_time_ns, (*one)->capture_time_ns);
    EXPECT_EQ(cv::norm((*one)->grey, (*other)->grey, cv::NORM_INF), 0);
    EXPECT_EQ((*one)->color.empty(), (*other)->color.empty());
  }
  EXPECT_FALSE(again->Next()->has_value());
}

TEST_F(Record, EndsAtItsLimitsAndNeverWritesOverARecording) {
  const auto few = RecordSource(*Open("dataset:" + folder_.string()), folder_ / "few",
                                {.frames = 2, .seconds = {}});
  EXPECT_EQ(few->frames, 2u);
  // Frames are 10 ms apart.
  const auto brief = RecordSource(*Open("dataset:" + folder_.string()), folder_ / "brief",
                                  {.frames = {}, .seconds = 0.025});
  EXPECT_EQ(brief->frames, 3u);
  const auto over = RecordSource(*Open("dataset:" + folder_.string()), folder_ / "few", {});
  EXPECT_TRUE(absl::IsAlreadyExists(over.status()));
  EXPECT_THAT(std::string(over.status().message()), HasSubstr("give another folder as --out"));
}

TEST_F(Record, EveryLensIsReadBackToTheSameNumbers) {
  for (const LensModel model : {LensModel::kPinhole, LensModel::kRadial1, LensModel::kBrownConrady,
                                LensModel::kKannalaBrandt}) {
    CameraIntrinsics lens{.model = model,
                          .width = 641,
                          .height = 480,
                          .fx = 1.0 / 3 + 400,
                          .fy = 401.7,
                          .cx = 320.123456789,
                          .cy = 239.5,
                          .distortion = {},
                          .fps = 29.97,
                          .rolling_shutter_readout_s = 0.021};
    const std::size_t coefficients = model == LensModel::kPinhole        ? 0
                                     : model == LensModel::kRadial1      ? 1
                                     : model == LensModel::kBrownConrady ? 5
                                                                         : 4;
    for (std::size_t i = 0; i < coefficients; ++i) lens.distortion[i] = 1e-7 / 3 * (1.0 + i);
    Write("lens.yaml", CameraYaml(lens, "a remark"));
    const auto read = LoadCamera(folder_ / "lens.yaml");
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->model, model);
    EXPECT_EQ(read->fx, lens.fx);
    EXPECT_EQ(read->cx, lens.cx);
    EXPECT_EQ(read->distortion, lens.distortion);
    EXPECT_EQ(read->fps, lens.fps);
    EXPECT_EQ(read->rolling_shutter_readout_s, lens.rolling_shutter_readout_s);
  }
}

}  // namespace
}  // namespace saccade::record_source_test
