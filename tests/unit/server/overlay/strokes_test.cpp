#include "shared/marks/strokes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/server/anchors/synthetic_map.hpp"

namespace saccade::strokes_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using testing::SyntheticMap;

class StrokesTest : public ::testing::Test {
 protected:
  Annotation At(const Eigen::Vector3d& point, AnnotationShape shape = AnnotationShape::kCube) {
    Annotation annotation;
    annotation.id = "a";
    annotation.shape = shape;
    annotation.anchor.state = AnchorState::kTracking;
    annotation.anchor.point_in_world = point;
    return annotation;
  }
  Marks Draw(const Annotation& annotation) {
    return AnnotationMarks(*map_.camera(), Rigid3(), {annotation});
  }

  SyntheticMap map_{SyntheticMap::Options{.features = 0}};
};

TEST_F(StrokesTest, PiecesFollowTheLensWithinAQuarterPixel) {
  const Polyline3 line = {{-1.1, -0.6, 1.5}, {1.1, -0.55, 1.6}};
  const std::vector<Polyline2> pieces = ProjectPolyline(*map_.camera(), Rigid3(), line);
  ASSERT_THAT(pieces, SizeIs(1));
  EXPECT_GT(pieces[0].size(), 4u) << "the lens bends this line";
  for (double t = 0.2; t < 0.8; t += 0.001) {
    const Eigen::Vector2d pixel = *map_.camera()->Project(line[0] + t * (line[1] - line[0]));
    double nearest = 1e9;
    for (std::size_t i = 1; i < pieces[0].size(); ++i) {
      const Eigen::Vector2d a = pieces[0][i - 1], d = pieces[0][i] - a;
      const double s = std::clamp((pixel - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
      nearest = std::min(nearest, (pixel - a - s * d).norm());
    }
    ASSERT_LT(nearest, 0.3) << t;
  }
}

TEST_F(StrokesTest, LinesThroughTheCameraAreCutInFrontOfIt) {
  const std::vector<Polyline2> pieces =
      ProjectPolyline(*map_.camera(), Rigid3(), {{0.1, 0.1, 2}, {0.1, 0.1, -2}});
  ASSERT_THAT(pieces, SizeIs(1));
  for (const Eigen::Vector2d& pixel : pieces[0]) EXPECT_TRUE(map_.camera()->InImage(pixel, -32));
  EXPECT_THAT(ProjectPolyline(*map_.camera(), Rigid3(), {{0, 0, -1}, {1, 0, -1}}), IsEmpty());
}

TEST_F(StrokesTest, MarksOutsideTheViewGetAnArrowTowardsThem) {
  const Marks right = Draw(At({3, 0, 1}));
  ASSERT_THAT(right.edge_arrows, SizeIs(1));
  EXPECT_NEAR(right.edge_arrows[0].direction.x(), 1, 1e-6);
  EXPECT_NEAR(right.edge_arrows[0].tip_px.x(), 639 - 26, 1.0);
  const Marks behind_left = Draw(At({-0.5, 0, -2}));
  ASSERT_THAT(behind_left.edge_arrows, SizeIs(1));
  EXPECT_NEAR(behind_left.edge_arrows[0].direction.x(), -1, 1e-6);
  EXPECT_THAT(behind_left.strokes, IsEmpty());
  EXPECT_THAT(Draw(At({0, 0, 1})).edge_arrows, IsEmpty());
}

TEST_F(StrokesTest, UntrustedIsHollowInWordsAndUnknownPlacesAreNotDrawn) {
  Annotation note = At({0, 0, 1}, AnnotationShape::kNote);
  note.text = "oil";
  EXPECT_EQ(Draw(note).labels.at(0).text, "oil");
  note.anchor.state = AnchorState::kPaused;
  const Marks paused = Draw(note);
  EXPECT_TRUE(paused.strokes.at(0).hollow);
  EXPECT_THAT(paused.labels.at(0).text, HasSubstr("do not trust"));
  note.anchor.place_known = false;
  EXPECT_THAT(Draw(note).strokes, IsEmpty());
  note.anchor.place_known = true;
  note.anchor.state = AnchorState::kStopped;
  EXPECT_THAT(Draw(note).strokes, IsEmpty());
}

TEST_F(StrokesTest, LabelsHaveAllOfTheText) {
  Annotation note = At({0, 0, 1}, AnnotationShape::kNote);
  for (int i = 0; i < 250; ++i) note.text += "ö";
  EXPECT_EQ(Draw(note).labels.at(0).text, note.text);
  note.anchor.state = AnchorState::kPaused;
  EXPECT_EQ(Draw(note).labels.at(0).words, note.text);
  EXPECT_EQ(Draw(note).labels.at(0).text, note.text + ": do not trust");
}

}  // namespace
}  // namespace saccade::strokes_test
