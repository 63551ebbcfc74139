#include "server/encode/video_encoder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "server/encode/i420.hpp"
#include "tests/support/h264/h264_reader.hpp"

namespace saccade::video_encoder_test {
namespace {

using ::testing::ElementsAre;
using testing::H264Reader;
using ::testing::HasSubstr;
using testing::NalTypes;
using testing::Psnr;

// A textured picture that moves by a few pixels a frame, with colour and a little noise.
cv::Mat Scene(int frame, int width = 640, int height = 480) {
  cv::Mat wide(height + 64, width + 512, CV_8UC3);
  cv::RNG noise(7);
  noise.fill(wide, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(wide, wide, cv::Size(0, 0), 5.0);
  cv::normalize(wide, wide, 20, 235, cv::NORM_MINMAX);
  cv::circle(wide, {width / 2, height / 2}, 60, {40, 90, 220}, -1);
  return wide(cv::Rect(3 * frame % 500, frame % 60, width, height)).clone();
}

cv::Mat Luma(const cv::Mat& picture) {
  cv::Mat i420;
  ToI420(picture, i420);
  return i420.rowRange(0, picture.rows & ~1).clone();
}

std::unique_ptr<VideoEncoder> MakeEncoder(int width = 640, int height = 480, int bit_rate = 0) {
  VideoEncoderOptions options;
  options.width = width;
  options.height = height;
  options.bit_rate_bit_s = bit_rate;
  auto encoder = VideoEncoder::Create(options);
  EXPECT_TRUE(encoder.ok()) << encoder.status();
  return *std::move(encoder);
}

TEST(VideoEncoder, EveryPictureDecodesCloseToTheInput) {
  const auto encoder = MakeEncoder();
  H264Reader reader;
  for (int i = 0; i < 30; ++i) {
    const cv::Mat picture = Scene(i);
    const auto coded = encoder->Encode(picture, false);
    ASSERT_TRUE(coded.ok()) << coded.status();
    const cv::Mat luma = reader.DecodeLuma(*coded->data);
    ASSERT_FALSE(luma.empty()) << "picture " << i;
    EXPECT_GT(Psnr(luma, Luma(picture)), 32.0) << "picture " << i;
  }
}

TEST(VideoEncoder, AKeyFrameIsAnIdrAfterItsParameterSets) {
  const auto encoder = MakeEncoder();
  const auto first = encoder->Encode(Scene(0), false);
  ASSERT_TRUE(first.ok());
  EXPECT_TRUE(first->key_frame);
  EXPECT_THAT(NalTypes(*first->data), ElementsAre(7, 8, 5));
  // Constrained baseline: profile_idc 66, constraint_set0 and 1.
  const std::size_t sps = first->data->find(std::string("\0\0\1\x67", 4));
  ASSERT_NE(sps, std::string::npos);
  EXPECT_EQ(static_cast<unsigned char>((*first->data)[sps + 4]), 66);
  EXPECT_EQ(static_cast<unsigned char>((*first->data)[sps + 5]) & 0xc0, 0xc0);
  for (int i = 1; i < 8; ++i) {
    const auto delta = encoder->Encode(Scene(i), false);
    ASSERT_TRUE(delta.ok());
    EXPECT_FALSE(delta->key_frame);
    EXPECT_THAT(NalTypes(*delta->data), ElementsAre(1));
  }
}

TEST(VideoEncoder, AKeyFrameOnDemandStartsANewDecoderInTheMiddle) {
  const auto encoder = MakeEncoder();
  for (int i = 0; i < 6; ++i) ASSERT_TRUE(encoder->Encode(Scene(i), false).ok());
  H264Reader late;
  for (int i = 6; i < 12; ++i) {
    const auto coded = encoder->Encode(Scene(i), i == 6);
    ASSERT_TRUE(coded.ok());
    EXPECT_EQ(coded->key_frame, i == 6);
    const cv::Mat luma = late.DecodeLuma(*coded->data);
    ASSERT_FALSE(luma.empty()) << "picture " << i;
    EXPECT_GT(Psnr(luma, Luma(Scene(i))), 32.0) << "picture " << i;
  }
}

// What is kept must come out the same, to the bit, whether or not higher layers were sent.
TEST(VideoEncoder, HigherTemporalLayersMayBeLeftOut) {
  const auto encoder = MakeEncoder();
  std::vector<EncodedPicture> stream;
  for (int i = 0; i < 24; ++i) stream.push_back(*encoder->Encode(Scene(i), i == 13));
  std::vector<int> count(3, 0);
  for (const EncodedPicture& picture : stream) ++count[picture.temporal_layer];
  EXPECT_GE(count[2], 10);
  EXPECT_GE(count[1], 4);
  for (const int highest : {0, 1}) {
    H264Reader everything, part;
    for (std::size_t i = 0; i < stream.size(); ++i) {
      const cv::Mat full = everything.DecodeLuma(*stream[i].data);
      if (stream[i].temporal_layer > highest) continue;
      const cv::Mat kept = part.DecodeLuma(*stream[i].data);
      ASSERT_FALSE(kept.empty()) << "picture " << i << ", layers up to " << highest;
      EXPECT_EQ(cv::norm(full, kept, cv::NORM_INF), 0.0) << "picture " << i;
    }
  }
}

// A subscriber that shed layers takes them up again at any layer 0 or 1 picture.
TEST(VideoEncoder, LayersMayComeBackAfterAnyLowerPicture) {
  const auto encoder = MakeEncoder();
  std::vector<EncodedPicture> stream;
  for (int i = 0; i < 32; ++i) stream.push_back(*encoder->Encode(Scene(i), false));
  H264Reader everything, part;
  bool reference_kept = false;
  for (std::size_t i = 0; i < stream.size(); ++i) {
    const cv::Mat full = everything.DecodeLuma(*stream[i].data);
    const int layer = stream[i].temporal_layer;
    const bool shed_1 = i >= 8 && i < 17;
    const bool shed_2 = i >= 6 && i < 22;
    const bool kept =
        layer == 0 || (layer == 1 && !shed_1) || (layer == 2 && !shed_2 && reference_kept);
    if (layer < 2) reference_kept = kept;
    if (!kept) continue;
    const cv::Mat luma = part.DecodeLuma(*stream[i].data);
    ASSERT_FALSE(luma.empty()) << "picture " << i << " of layer " << layer;
    EXPECT_EQ(cv::norm(full, luma, cv::NORM_INF), 0.0) << "picture " << i;
  }
}

TEST(VideoEncoder, GreyAndOddSizesAreCoded) {
  const auto encoder = MakeEncoder(321, 241);
  EXPECT_EQ(encoder->coded_width(), 320);
  EXPECT_EQ(encoder->coded_height(), 240);
  H264Reader reader;
  cv::Mat grey;
  cv::cvtColor(Scene(0, 321, 241), grey, cv::COLOR_BGR2GRAY);
  const auto coded = encoder->Encode(grey, false);
  ASSERT_TRUE(coded.ok()) << coded.status();
  const cv::Mat luma = reader.DecodeLuma(*coded->data);
  ASSERT_EQ(luma.size(), cv::Size(320, 240));
  EXPECT_GT(Psnr(luma, Luma(grey)), 30.0);
}

TEST(VideoEncoder, TheBitRateIsHeld) {
  const auto encoder = MakeEncoder(640, 480, 1'000'000);
  std::size_t bytes = 0;
  for (int i = 0; i < 90; ++i) bytes += encoder->Encode(Scene(i), false)->data->size();
  const double bit_s = 8.0 * static_cast<double>(bytes) / 3.0;
  EXPECT_LT(bit_s, 1.5e6);
  EXPECT_GT(bit_s, 0.3e6);
}

// A slow computer codes every fifth picture of its camera: the same bits a second make them better.
TEST(VideoEncoder, FewerPicturesGetMoreBitsEach) {
  struct Result {
    double bytes = 0.0, worst_db = 1e9;
  };
  const auto run = [](bool told) {
    const auto encoder = MakeEncoder(640, 480, 400'000);
    if (told) {
      encoder->SetFrameRate(6.0);
      encoder->SetFrameRate(std::nan(""));  // changes nothing
    }
    H264Reader reader;
    Result result;
    for (int i = 0; i < 30; ++i) {
      const cv::Mat picture = Scene(5 * i);
      const auto coded = encoder->Encode(picture, false);
      EXPECT_TRUE(coded.ok()) << coded.status();
      const cv::Mat luma = reader.DecodeLuma(*coded->data);
      if (i < 10) continue;
      result.bytes += static_cast<double>(coded->data->size());
      result.worst_db = std::min(result.worst_db, Psnr(luma, Luma(picture)));
    }
    return result;
  };
  const Result untold = run(false), told = run(true);
  EXPECT_GT(told.bytes, 2.5 * untold.bytes);
  EXPECT_LT(8.0 * told.bytes * 6.0 / 20.0, 1.3 * 400'000);  // bits a second
  EXPECT_GT(told.worst_db, untold.worst_db + 2.0);
}

TEST(VideoEncoder, BadOptionsAndPicturesAreNamed) {
  VideoEncoderOptions options;
  options.width = 8;
  options.height = 480;
  EXPECT_THAT(VideoEncoder::Create(options).status().message(), HasSubstr("8 x 480"));
  options.width = 640;
  options.bit_rate_bit_s = 10;
  EXPECT_THAT(VideoEncoder::Create(options).status().message(), HasSubstr("bit_rate_bit_s"));
  const auto encoder = MakeEncoder();
  EXPECT_EQ(encoder->Encode(cv::Mat(), false).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(encoder->Encode(Scene(0, 320, 240), false).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(VideoEncoder, ARealDeskAtTheDefaultBitRate) {
  const std::filesystem::path folder =
      std::filesystem::path(SACCADE_SOURCE_DIR) / "../shared/data/tum_fr1_xyz/rgb";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "needs tum_fr1_xyz in ../shared/data";
  std::vector<std::filesystem::path> files(std::filesystem::directory_iterator(folder), {});
  std::sort(files.begin(), files.end());
  ASSERT_GE(files.size(), 90u);
  const auto encoder = MakeEncoder();
  H264Reader reader;
  double psnr = 0.0, milliseconds = 0.0;
  std::size_t bytes = 0;
  for (int i = 0; i < 90; ++i) {
    const cv::Mat picture = cv::imread(files[static_cast<std::size_t>(i)], cv::IMREAD_GRAYSCALE);
    const std::int64_t begin = cv::getTickCount();
    const auto coded = encoder->Encode(picture, false);
    milliseconds += 1e3 * static_cast<double>(cv::getTickCount() - begin) / cv::getTickFrequency();
    ASSERT_TRUE(coded.ok());
    bytes += coded->data->size();
    psnr += Psnr(reader.DecodeLuma(*coded->data), Luma(picture));
  }
  RecordProperty("mean_psnr_db", std::to_string(psnr / 90));
  RecordProperty("bit_s", std::to_string(8.0 * static_cast<double>(bytes) / 3.0));
  RecordProperty("mean_ms", std::to_string(milliseconds / 90));
  EXPECT_GT(psnr / 90, 36.0);
  std::printf("mean PSNR %.1f dB at %.2f Mbit/s, %.1f ms a picture\n", psnr / 90,
              8e-6 * static_cast<double>(bytes) / 3.0, milliseconds / 90);
}

}  // namespace
}  // namespace saccade::video_encoder_test
