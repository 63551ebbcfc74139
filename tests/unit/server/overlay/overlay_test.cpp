#include "server/overlay/overlay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "server/overlay/painter.hpp"
#include "tests/unit/server/anchors/synthetic_map.hpp"

namespace saccade::overlay_test {
namespace {

using testing::LookFrom;
using testing::SyntheticMap;

Frame GreyFrame(const std::shared_ptr<const CameraModel>& camera) {
  Frame frame;
  frame.grey = cv::Mat(camera->height(), camera->width(), CV_8UC1, cv::Scalar(120));
  frame.camera = camera;
  return frame;
}

OverlayOptions FeaturesOnly() {
  OverlayOptions options;
  options.annotations = options.world_axes = options.status_line = false;
  return options;
}

double Distance(const cv::Vec3b& pixel, const cv::Scalar& color) {
  return std::hypot(pixel[0] - color[0], pixel[1] - color[1], pixel[2] - color[2]);
}

/// Which of the four colours of features is painted round a pixel, if any.
std::optional<cv::Scalar> ColorAt(const cv::Mat& picture, const Eigen::Vector2d& at) {
  for (const cv::Scalar& color :
       {kMeasuredColor, kFailedColor, kNotAttemptedColor, kFixatedColor}) {
    int hits = 0;
    for (int dy = -6; dy <= 6; ++dy) {
      for (int dx = -6; dx <= 6; ++dx) {
        const cv::Point p(static_cast<int>(std::lround(at.x())) + dx,
                          static_cast<int>(std::lround(at.y())) + dy);
        if (p.x < 0 || p.y < 0 || p.x >= picture.cols || p.y >= picture.rows) continue;
        hits += Distance(picture.at<cv::Vec3b>(p), color) < 40 ? 1 : 0;
      }
    }
    if (hits >= 3) return color;
  }
  return std::nullopt;
}

TEST(Overlay, T32ColoursEqualTheSnapshotInEveryFrame) {
  SyntheticMap map(SyntheticMap::Options{.features = 90, .seed = 3});
  std::uniform_int_distribution<int> dice(0, 2);
  int checked = 0;
  for (int n = 0; n < 200; ++n) {
    MapSnapshot snapshot = *map.Snapshot(LookFrom({0.3 * std::sin(0.1 * n), 0, 0}, 0.02 * n, 0.2));
    for (FeatureSnapshot& feature : snapshot.features) {
      feature.state = static_cast<FeatureState>(dice(map.random()));
    }
    OverlayOptions options = FeaturesOnly();
    if (!snapshot.features.empty()) options.fixated_feature = snapshot.features[n % 90].id;
    const cv::Mat picture = Augment(GreyFrame(map.camera()), snapshot, {}, options);
    for (const FeatureSnapshot& feature : snapshot.features) {
      if (!feature.pixel || !map.camera()->InImage(*feature.pixel, 8)) continue;
      const auto overlaps = [&feature](const FeatureSnapshot& other) {
        return other.id != feature.id && other.pixel && (*other.pixel - *feature.pixel).norm() < 18;
      };
      if (std::any_of(snapshot.features.begin(), snapshot.features.end(), overlaps)) continue;
      const cv::Scalar expected = options.fixated_feature == feature.id      ? kFixatedColor
                                  : feature.state == FeatureState::kMeasured ? kMeasuredColor
                                  : feature.state == FeatureState::kFailed   ? kFailedColor
                                                                             : kNotAttemptedColor;
      const std::optional<cv::Scalar> painted = ColorAt(picture, *feature.pixel);
      ASSERT_TRUE(painted) << "frame " << n << " feature " << feature.id << " is not drawn";
      EXPECT_EQ(*painted, expected) << "frame " << n << " feature " << feature.id;
      ++checked;
    }
  }
  std::printf("T32: %d features in 200 frames\n", checked);
  EXPECT_GT(checked, 1000);
}

TEST(Overlay, CubeIsPaintedWhereItsCornersProject) {
  SyntheticMap map(SyntheticMap::Options{.features = 0});
  const Rigid3 pose = LookFrom({0.1, -0.1, 0}, 0.1, 0.1);
  MapSnapshot snapshot = *map.Snapshot(pose);
  Annotation cube;
  cube.id = "c";
  cube.size_m = 0.2;
  cube.color_rgba = 0xff00ffff;
  cube.anchor.state = AnchorState::kTracking;
  cube.anchor.point_in_world = {0.3, 0.2, 1.5};
  OverlayOptions options;
  options.status_line = options.world_axes = false;
  const cv::Mat picture = Augment(GreyFrame(map.camera()), snapshot, {cube}, options);
  const cv::Scalar magenta(255, 0, 255);
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d offset((corner & 1 ? 0.1 : -0.1), (corner & 2 ? 0.1 : -0.1),
                                 (corner & 4 ? 0.1 : -0.1));
    const std::optional<Eigen::Vector2d> pixel = map.camera()->Project(
        snapshot.world_from_camera.Inverse() * (cube.anchor.point_in_world + offset));
    ASSERT_TRUE(pixel);
    const cv::Point p(static_cast<int>(std::lround(pixel->x())),
                      static_cast<int>(std::lround(pixel->y())));
    EXPECT_LT(Distance(picture.at<cv::Vec3b>(p), magenta), 60) << corner;
  }
  // And nothing where a lost tracker could not know its place.
  snapshot.status = TrackingStatus::kLost;
  const cv::Mat lost = Augment(GreyFrame(map.camera()), snapshot, {cube}, options);
  cv::Mat grey;
  cv::cvtColor(GreyFrame(map.camera()).grey, grey, cv::COLOR_GRAY2BGR);
  EXPECT_EQ(cv::norm(lost, grey, cv::NORM_INF), 0);
}

TEST(Overlay, NonsenseNeverCrashesOrHangs) {
  SyntheticMap map(SyntheticMap::Options{.features = 30});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const std::vector<double> numbers = {0, 1, -1, 1e-300, 1e9, -1e9, 1e300, nan, inf, -inf, 0.02};
  std::mt19937 random(5);
  const auto any = [&] { return numbers[random() % numbers.size()]; };
  const auto point = [&] { return Eigen::Vector3d(any(), any(), any()); };
  const auto start = std::chrono::steady_clock::now();
  for (int run = 0; run < 300; ++run) {
    MapSnapshot snapshot = *map.Snapshot(LookFrom({0, 0, 0}, 0.1 * run, 0));
    if (run % 7 == 0) snapshot.world_from_camera.translation = point();
    if (run % 11 == 0) snapshot.world_from_camera.rotation.coeffs().setConstant(any());
    for (FeatureSnapshot& feature : snapshot.features) {
      if (random() % 3 == 0) feature.pixel = Eigen::Vector2d(any(), any());
    }
    std::vector<Annotation> annotations(4);
    for (int i = 0; i < 4; ++i) {
      annotations[i].shape = static_cast<AnnotationShape>(i);
      annotations[i].size_m = any();
      annotations[i].text = std::string("a\xc3\xb6\n\xff") + std::string(run, 'x');
      annotations[i].anchor.point_in_world = point();
      annotations[i].anchor.state = static_cast<AnchorState>(random() % 4);
      InkStroke::Points ink;
      for (int k = 0; k < 20; ++k) ink.push_back(point());
      annotations[i].ink_offset_m = std::move(ink);
    }
    snapshot.advice = std::string(run, 'w');
    const cv::Mat picture =
        Augment(GreyFrame(map.camera()), snapshot, annotations, OverlayOptions());
    ASSERT_EQ(picture.size(), cv::Size(640, 480));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST(Overlay, ABusyPictureTakesBelowTwoMilliseconds) {
  SyntheticMap map(SyntheticMap::Options{.features = 200});
  const MapSnapshot snapshot = *map.Snapshot(LookFrom({0, 0, 0}, 0, 0.2));
  std::vector<Annotation> annotations;
  for (int i = 0; i < 20; ++i) {
    Annotation annotation;
    annotation.id = std::to_string(i);
    annotation.shape = static_cast<AnnotationShape>(i % 3);
    annotation.text = annotation.shape == AnnotationShape::kNote ? "check the oil" : "";
    annotation.anchor.state = AnchorState::kTracking;
    annotation.anchor.point_in_world = {-0.8 + 0.08 * i, 0.3, 1.6};
    annotations.push_back(annotation);
  }
  const Frame frame = GreyFrame(map.camera());
  std::vector<double> times;
  for (int run = 0; run < 60; ++run) {
    const auto start = std::chrono::steady_clock::now();
    const cv::Mat picture = Augment(frame, snapshot, annotations, OverlayOptions());
    times.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
  }
  std::sort(times.begin(), times.end());
  std::printf("overlay of 200 features and 20 annotations: p50 %.2f ms, best %.2f ms\n", times[30],
              times[0]);
  EXPECT_LT(times[0], 4.0);  // the best of 60: 2 ms with room for a busy machine
}

// Notes in six scripts, in view all the time: what the wearer's picture costs once they are known.
TEST(Overlay, ThirtySixLabelsTakeBelowTwoMilliseconds) {
  SyntheticMap map(SyntheticMap::Options{.features = 0});
  const MapSnapshot snapshot = *map.Snapshot(LookFrom({0, 0, 0}, 0, 0));
  const char* const words[] = {"check the oil level", "Größe prüfen ≈ 5 mm", "Sprawdź śrubę",
                               "בדוק את מפלס השמן",   "افحص مستوى الزيت",    "检查油位 🔧"};
  std::vector<Annotation> annotations(36);
  for (int i = 0; i < 36; ++i) {
    annotations[i].id = std::to_string(i);
    annotations[i].shape = AnnotationShape::kNote;
    annotations[i].text = words[i % 6];
    annotations[i].anchor.state = AnchorState::kTracking;
    annotations[i].anchor.point_in_world = {-0.8 + 0.25 * (i % 6), -0.5 + 0.2 * (i / 6), 1.6};
  }
  OverlayOptions options;
  options.world_axes = false;
  const Frame frame = GreyFrame(map.camera());
  std::vector<double> times;
  for (int run = 0; run < 100; ++run) {
    const auto start = std::chrono::steady_clock::now();
    const cv::Mat picture = Augment(frame, snapshot, annotations, options);
    times.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
  }
  std::printf("overlay of 36 labels: first %.2f ms", times[0]);
  std::sort(times.begin(), times.end());
  std::printf(", then p50 %.2f ms, best %.2f ms\n", times[50], times[0]);
  EXPECT_LT(times[0], 2.0);
}

// What is inked of the boxes: letters of a colour that nothing else has.
int InkedRows(const cv::Mat& picture, const cv::Scalar& color) {
  cv::Mat ink;
  cv::inRange(picture, color - cv::Scalar::all(30), color + cv::Scalar::all(30), ink);
  int rows = 0;
  for (int y = 0; y < ink.rows; ++y) rows += cv::countNonZero(ink.row(y)) > 0 ? 1 : 0;
  return rows;
}

TEST(Overlay, AllFiveHundredBytesOfTheNoteInTheMiddleAreInThePicture) {
  SyntheticMap map(SyntheticMap::Options{.features = 0});
  const std::string words = "loosen the four screws, then lift the lid and look for oil; ";
  std::vector<Annotation> notes(5);
  for (int i = 0; i < 5; ++i) {
    notes[i].id = std::to_string(i);
    notes[i].shape = AnnotationShape::kNote;
    while (notes[i].text.size() + words.size() <= 500) notes[i].text += words;
    notes[i].anchor.state = AnchorState::kTracking;
    notes[i].anchor.point_in_world = {-0.5 + 0.22 * i, i == 4 ? 0.4 : 0.02 * i, 1.5};
  }
  notes[4].color_rgba = 0xff00ffff;
  const auto draw = [&](double yaw, double pitch) {
    const MapSnapshot turned = *map.Snapshot(LookFrom({0, 0, 0}, yaw, pitch));
    OverlayOptions options;
    options.world_axes = false;
    const cv::Mat picture = Augment(GreyFrame(map.camera()), turned, notes, options);
    if (const char* file = std::getenv("SACCADE_SHOW_LABELS")) cv::imwrite(file, picture);
    return InkedRows(picture, {255, 0, 255});
  };
  const int beside = draw(0, 0);
  EXPECT_GT(beside, 40);
  EXPECT_LT(beside, 100) << "beside the middle it is short";
  const int whole = draw(0.25, 0.25);
  EXPECT_GT(whole, 150) << "wearers who turn to it can read all of it";
  EXPECT_LT(whole, 300) << "and still see what they do";
  notes = {notes[4]};
  EXPECT_LT(draw(0, 0), 100) << "alone, but nobody looks at it";
}

TEST(Overlay, ALabelIsInThePictureAsAWholeAndBesideItsMark) {
  SyntheticMap map(SyntheticMap::Options{.features = 0, .pose_sigma_m = 0, .pose_sigma_rad = 0});
  Annotation mark;
  mark.id = "m";
  mark.shape = AnnotationShape::kArrow;
  mark.text = "check the oil level";
  mark.color_rgba = 0xff00ffff;
  mark.anchor.state = AnchorState::kTracking;
  mark.size_m = 0.001;  // the label alone
  OverlayOptions options;
  options.world_axes = options.status_line = false;
  int in_the_middle = 0;
  for (const auto& [x, y] : {std::pair(0.0, 0.0), std::pair(0.9, 0.0), std::pair(-0.9, 0.0),
                             std::pair(0.0, -0.69), std::pair(0.9, -0.69), std::pair(0.9, 0.65)}) {
    mark.anchor.point_in_world = {x, y, 1.5};
    const MapSnapshot snapshot = *map.Snapshot(Rigid3());
    const cv::Mat picture = Augment(GreyFrame(map.camera()), snapshot, {mark}, options);
    cv::Mat ink;
    cv::inRange(picture, cv::Scalar(200, 0, 200), cv::Scalar(255, 60, 255), ink);
    const int inked = cv::countNonZero(ink);
    if (in_the_middle == 0) in_the_middle = inked;
    EXPECT_GT(inked, 0.9 * in_the_middle) << x << ", " << y << ": the picture's edge cuts it";
    const std::optional<Eigen::Vector2d> at = map.camera()->Project({x, y, 1.5});
    ASSERT_TRUE(at && map.camera()->InImage(*at)) << x << ", " << y;
    const cv::Vec3b there = picture.at<cv::Vec3b>(static_cast<int>(std::lround(at->y())),
                                                  static_cast<int>(std::lround(at->x())));
    EXPECT_NE(there, cv::Vec3b(18, 17, 16)) << x << ", " << y << ": the label lies on its mark";
  }
  EXPECT_GT(in_the_middle, 500);
}

TEST(StatusLine, SaysStateAndWhatToDo) {
  MapSnapshot snapshot;
  EXPECT_EQ(StatusLine(snapshot), "starting: move the camera sideways, slowly");
  snapshot.status = TrackingStatus::kTracking;
  snapshot.quality = TrackingQuality::kGood;
  EXPECT_EQ(StatusLine(snapshot), "tracking good");
  snapshot.advice = "move more slowly";
  EXPECT_EQ(StatusLine(snapshot), "tracking good: move more slowly");
  snapshot.status = TrackingStatus::kLost;
  snapshot.advice.clear();
  EXPECT_EQ(StatusLine(snapshot), "lost: show a place seen before");
}

}  // namespace
}  // namespace saccade::overlay_test
