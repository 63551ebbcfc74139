#include "server/app/picture_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <random>
#include <string>

#include "shared/scene/limits.hpp"

namespace saccade::picture_reader_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string Coded(const char* ending, int width, int height, bool noise = false,
                  const std::vector<int>& options = {}) {
  cv::Mat picture(height, width, CV_8UC3, cv::Scalar(10, 200, 90));
  if (noise) cv::randu(picture, 0, 255);
  std::vector<uchar> bytes;
  EXPECT_TRUE(cv::imencode(ending, picture, bytes, options));
  return {bytes.begin(), bytes.end()};
}

std::string ErrorOf(std::string bytes) {
  const absl::StatusOr<PicturePtr> read = ReadPictureFile(std::move(bytes));
  if (read.ok()) return "";
  EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(read.status().message()), StartsWith("draft.picture: "));
  return std::string(read.status().message());
}

void PutBig(std::string& bytes, std::size_t at, std::uint32_t value) {
  for (int i = 0; i < 4; ++i)
    bytes[at + static_cast<std::size_t>(i)] = static_cast<char>(value >> (24 - 8 * i));
}

TEST(PictureReader, TakesPngAndJpegAndSaysWhatTheyAre) {
  const std::string png = Coded(".png", 64, 48), jpeg = Coded(".jpg", 40, 60);
  const absl::StatusOr<PicturePtr> one = ReadPictureFile(png), two = ReadPictureFile(jpeg);
  ASSERT_TRUE(one.ok()) << one.status();
  ASSERT_TRUE(two.ok()) << two.status();
  EXPECT_EQ((*one)->media_type, "image/png");
  EXPECT_EQ((*one)->width, 64);
  EXPECT_EQ((*one)->height, 48);
  EXPECT_EQ((*one)->bytes, png);
  EXPECT_EQ((*one)->sha256.size(), 64u);
  EXPECT_EQ((*two)->media_type, "image/jpeg");
  EXPECT_EQ((*two)->height, 60);
  EXPECT_NE((*one)->sha256, (*two)->sha256);
  EXPECT_EQ(DecodePicture(**one, 32).size(), cv::Size(32, 24));
}

TEST(PictureReader, RefusesOtherKinds) {
  EXPECT_THAT(ErrorOf(Coded(".bmp", 8, 8)), HasSubstr("neither PNG nor JPEG"));
  EXPECT_THAT(ErrorOf(Coded(".tiff", 8, 8)), HasSubstr("neither PNG nor JPEG"));
  EXPECT_THAT(ErrorOf("GIF89a......."), HasSubstr("neither PNG nor JPEG"));
  EXPECT_THAT(ErrorOf("<svg xmlns='http://www.w3.org/2000/svg'/>"), HasSubstr("neither"));
  EXPECT_THAT(ErrorOf(""), HasSubstr("neither"));
}

// Some bytes that claim gigabytes: refused by the header, before anything is allocated.
TEST(PictureReader, RefusesABombByItsHeader) {
  std::string png = Coded(".png", 64, 48);
  PutBig(png, 16, 60'000);
  PutBig(png, 20, 60'000);
  EXPECT_THAT(ErrorOf(png), HasSubstr("60000 x 60000 px; at most 4096"));
  PutBig(png, 16, 0x7fffffff);
  EXPECT_THAT(ErrorOf(png), HasSubstr("at most 4096"));
  EXPECT_THAT(ErrorOf(Coded(".png", 4097, 8)), HasSubstr("at most 4096"));
  EXPECT_THAT(ErrorOf(Coded(".jpg", 8, 5000)), HasSubstr("at most 4096"));
  EXPECT_EQ(ErrorOf(Coded(".png", 4096, 4096)), "") << "as large as may be";
  // A header that lies within the limit is found out by decoding.
  png = Coded(".png", 64, 48);
  PutBig(png, 16, 4096);
  EXPECT_THAT(ErrorOf(png), HasSubstr("damaged"));
}

TEST(PictureReader, RefusesWhatIsCutOff) {
  for (const char* ending : {".png", ".jpg"}) {
    const std::string whole = Coded(ending, 64, 48, true);
    for (const std::size_t length :
         {std::size_t{9}, std::size_t{40}, whole.size() / 2, whole.size() - 13, whole.size() - 1}) {
      EXPECT_NE(ErrorOf(whole.substr(0, length)), "") << ending << " " << length;
    }
  }
}

TEST(PictureReader, RefusesWhatIsTooLarge) {
  const std::string large = Coded(".png", 1000, 1000, true);
  ASSERT_GT(large.size(), kMaxPictureBytes);
  EXPECT_THAT(ErrorOf(large), AllOf(HasSubstr("at most 1048576 bytes"), HasSubstr("smaller")));
}

// Each pass of a progressive JPEG goes over the whole picture: a megabyte of tiny ones takes
// minutes.
TEST(PictureReader, RefusesAJpegOfManyPasses) {
  std::string jpeg =
      Coded(".jpg", 64, 48, true, {cv::IMWRITE_JPEG_PROGRESSIVE, 1, cv::IMWRITE_JPEG_QUALITY, 80});
  EXPECT_EQ(ErrorOf(jpeg), "");
  const std::size_t end = jpeg.size() - 2;
  const std::size_t scan = jpeg.rfind("\xff\xda");
  const std::string last = jpeg.substr(scan, end - scan);
  for (int i = 0; i < 100; ++i) jpeg.insert(end, last);
  EXPECT_THAT(ErrorOf(jpeg), HasSubstr("more passes"));
}

// Whatever comes: an error or a picture, never a crash.
TEST(PictureReader, SurvivesDamage) {
  std::mt19937 random(3);
  for (const char* ending : {".png", ".jpg"}) {
    const std::string whole = Coded(ending, 32, 24, true);
    for (int i = 0; i < 400; ++i) {
      std::string bytes = whole;
      for (unsigned k = 0; k < 1 + random() % 4; ++k) {
        bytes[random() % bytes.size()] = static_cast<char>(random());
      }
      const absl::StatusOr<PicturePtr> read = ReadPictureFile(bytes);
      if (read.ok()) {
        EXPECT_LE((*read)->width, kMaxPictureSide);
        EXPECT_FALSE(DecodePicture(**read, 64).empty());
      }
    }
  }
}

}  // namespace
}  // namespace saccade::picture_reader_test
