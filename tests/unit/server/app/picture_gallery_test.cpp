#include "server/app/picture_gallery.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <thread>

#include "server/app/picture_reader.hpp"

namespace saccade::picture_gallery_test {
namespace {

PicturePtr Green() {
  const cv::Mat pixels(30, 40, CV_8UC3, cv::Scalar(10, 200, 90));
  std::vector<uchar> bytes;
  EXPECT_TRUE(cv::imencode(".png", pixels, bytes));
  return *ReadPictureFile(std::string(bytes.begin(), bytes.end()));
}

TEST(PictureGallery, FindsWhatIsDecodedAndAsksForTheRest) {
  PictureGallery gallery;
  const PicturePtr picture = Green();
  cv::Mat found = gallery.Find(picture);
  EXPECT_TRUE(found.empty());  // a frame does not wait
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (found.empty() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    found = gallery.Find(picture);
  }
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.at<cv::Vec3b>(10, 10), cv::Vec3b(10, 200, 90));
}

TEST(PictureGallery, AStillHasThePictureAtOnce) {
  PictureGallery gallery;
  const PicturePtr picture = Green();
  const cv::Mat found = gallery.FindNow(picture);
  ASSERT_EQ(found.size(), cv::Size(40, 30));
  EXPECT_EQ(found.at<cv::Vec3b>(10, 10), cv::Vec3b(10, 200, 90));
  EXPECT_EQ(gallery.Find(picture).data, found.data);     // kept
  EXPECT_EQ(gallery.FindNow(picture).data, found.data);  // and not decoded again
}

}  // namespace
}  // namespace saccade::picture_gallery_test
