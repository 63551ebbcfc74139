#include "shared/marks/ink_thinner.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/server/anchors/synthetic_map.hpp"

namespace saccade::ink_thinner_test {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;
using testing::SyntheticMap;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class Thinning : public ::testing::Test {
 protected:
  // A wave 40 cm wide, 1.5 m away: about 120 px at 640 px width.
  static Annotation Wave(std::size_t points, const Eigen::Vector3d& at = {0, 0, 1.5}) {
    Annotation stroke;
    stroke.id = "a";
    stroke.shape = AnnotationShape::kInk;
    stroke.anchor.state = AnchorState::kTracking;
    stroke.anchor.point_in_world = at;
    InkStroke::Points ink;
    for (std::size_t i = 0; i < points; ++i) {
      const double t = static_cast<double>(i) / static_cast<double>(points - 1);
      ink.emplace_back(0.4 * t - 0.2, 0.05 * std::sin(12 * t), 0.0);
    }
    stroke.ink_offset_m = std::move(ink);
    return stroke;
  }
  const CameraModel& camera() { return *map_.camera(); }
  SyntheticMap map_{SyntheticMap::Options{.features = 0}};
};

TEST_F(Thinning, NothingVisibleIsLost) {
  const Annotation stroke = Wave(2000);
  const InkThinner thinner(camera(), Rigid3(), {stroke});
  const Polyline3 line = thinner.Thin(stroke);
  EXPECT_LT(line.size(), 600u);
  EXPECT_GT(line.size(), 100u);
  const Eigen::Vector3d at = stroke.anchor.point_in_world;
  EXPECT_EQ(line.front(), at + stroke.ink_offset_m[0]);
  EXPECT_EQ(line.back(), at + stroke.ink_offset_m[1999]);
  for (const Eigen::Vector3d& offset : stroke.ink_offset_m) {
    const Eigen::Vector2d pixel = *camera().Project(at + offset);
    double nearest_px = 1e9;
    for (const Eigen::Vector3d& kept : line) {
      nearest_px = std::min(nearest_px, (*camera().Project(kept) - pixel).norm());
    }
    EXPECT_LT(nearest_px, 0.6);
  }
}

TEST_F(Thinning, WhatIsCoarseStaysAsItIs) {
  const Annotation stroke = Wave(30);
  EXPECT_THAT(InkThinner(camera(), Rigid3(), {stroke}).Thin(stroke), SizeIs(30));
}

TEST_F(Thinning, OutOfViewThereIsNothingToDo) {
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(0, 0, -2), Eigen::Vector3d(6, 0, 1)}) {
    const Annotation stroke = Wave(2000, at);
    EXPECT_THAT(InkThinner(camera(), Rigid3(), {stroke}).Thin(stroke), IsEmpty());
  }
  const Annotation beside = Wave(2000, {1.2, 0, 1.5});
  EXPECT_FALSE(InkThinner(camera(), Rigid3(), {beside}).Thin(beside).empty());
  const Annotation around = Wave(2000, {0, 0, 0.05});
  EXPECT_FALSE(InkThinner(camera(), Rigid3(), {around}).Thin(around).empty());
}

TEST_F(Thinning, APictureFullOfInkHasABoundedNumberOfSegments) {
  std::vector<Annotation> strokes;
  for (int i = 0; i < 1000; ++i) strokes.push_back(Wave(240, {0.001 * i - 0.5, 0, 1.5}));
  const Marks marks = AnnotationMarks(camera(), Rigid3(), strokes);
  double points = 0;
  for (const Stroke& stroke : marks.strokes) points += static_cast<double>(stroke.points_px.size());
  EXPECT_LT(points, 2 * InkThinner::kInkSegments) << "of 240 000";
  EXPECT_THAT(marks.strokes, SizeIs(1000)) << "every stroke is still drawn";
  std::vector<Annotation> few(strokes.begin(), strokes.begin() + 10);
  EXPECT_EQ(InkThinner(camera(), Rigid3(), few).step_px(), InkThinner::kStepPx);
}

TEST_F(Thinning, WhatIsNotANumberHurtsNobody) {
  Annotation bad = Wave(50);
  InkStroke::Points ink(bad.ink_offset_m.begin(), bad.ink_offset_m.end());
  ink[10].x() = kNan;
  bad.ink_offset_m = std::move(ink);
  Annotation nowhere = Wave(50, {kNan, 0, 1});
  const InkThinner thinner(camera(), Rigid3(), {bad, nowhere, Wave(50)});
  EXPECT_EQ(thinner.step_px(), InkThinner::kStepPx);
  EXPECT_GT(thinner.Thin(bad).size(), 40u);
  EXPECT_THAT(AnnotationMarks(camera(), Rigid3(), {bad, nowhere, Wave(50)}).strokes, SizeIs(3));
}

}  // namespace
}  // namespace saccade::ink_thinner_test
