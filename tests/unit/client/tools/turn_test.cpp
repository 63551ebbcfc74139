#include "client/tools/turn.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace saccade::tools::turn_test {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

const Vector3d kAnchor(0.1, 0, 2);

View Eye() { return {PinholeOf(640, 480, 0.8), Rigid3()}; }

Annotation Arrow() {
  Annotation arrow;
  arrow.shape = AnnotationShape::kArrow;
  arrow.size_m = 0.05;
  arrow.anchor.point_in_world = kAnchor;
  return arrow;
}

TEST(Turn, TheHandleComesToLieUnderThePointer) {
  const View view = Eye();
  Annotation arrow = Arrow();
  Quaterniond turn = Quaterniond::Identity();
  const Vector2d middle = *view.Project(kAnchor);
  for (const Vector2d& away : {Vector2d(20, 0), Vector2d(0, 20), Vector2d(-12, -12)}) {
    turn = *TurnedTo(view, middle + away, kAnchor, HandleLength(arrow), turn);
    arrow.world_from_mark = turn;
    EXPECT_LT((*view.Project(HandlePoint(arrow)) - middle - away).norm(), 1e-6);
    EXPECT_NEAR((HandlePoint(arrow) - kAnchor).norm(), 0.1, 1e-9);
  }
}

TEST(Turn, BeyondItsRimTheHandlePointsTowardsThePointer) {
  const View view = Eye();
  Annotation arrow = Arrow();
  const Vector2d far = *view.Project(kAnchor) + Vector2d(200, 0);
  arrow.world_from_mark = *TurnedTo(view, far, kAnchor, 0.1, Quaterniond::Identity());
  const Vector2d handle = *view.Project(HandlePoint(arrow));
  EXPECT_GT(handle.x(), view.Project(kAnchor)->x() + 25);
  EXPECT_NEAR(handle.y(), far.y(), 1);
}

TEST(Turn, AFarHandleStaysOnTheFarSide) {
  const View view = Eye();
  const Quaterniond away(Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitX()));
  Annotation arrow = Arrow();
  arrow.world_from_mark = away;
  const bool far = HandlePoint(arrow).z() > kAnchor.z();
  arrow.world_from_mark =
      *TurnedTo(view, *view.Project(kAnchor) + Vector2d(5, 0), kAnchor, 0.1, away);
  EXPECT_EQ(HandlePoint(arrow).z() > kAnchor.z(), far);
}

TEST(Turn, AKeyTurnsInThePlaneOfThePictureOrTipsIt) {
  const View view = Eye();
  Annotation arrow = Arrow();
  arrow.world_from_mark = TurnedBy(view, Quaterniond::Identity(), std::numbers::pi / 2, false);
  EXPECT_NEAR(HandlePoint(arrow).x() - kAnchor.x(), 0.1, 1e-9);
  arrow.world_from_mark = TurnedBy(view, Quaterniond::Identity(), std::numbers::pi / 2, true);
  EXPECT_NEAR(std::abs(HandlePoint(arrow).z() - kAnchor.z()), 0.1, 1e-9);
}

TEST(Turn, ABoxHasItsHandleAboveItAndANoteNone) {
  Annotation box = Arrow();
  box.shape = AnnotationShape::kBox;
  box.extent_m = {0.3, 0.2, 0.6};
  EXPECT_NEAR(HandleLength(box), 0.1 + 0.25 * 0.7, 1e-9);
  EXPECT_LT(HandlePoint(box).y(), kAnchor.y()) << "y points down";
  EXPECT_TRUE(IsTurnable(box));
  box.shape = AnnotationShape::kNote;
  EXPECT_FALSE(IsTurnable(box));
}

}  // namespace
}  // namespace saccade::tools::turn_test
