#include "server/anchors/pointer_placer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>

#include "tests/unit/server/anchors/rig.hpp"

namespace saccade::pointer_placer_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::LookFrom;
using testing::Rig;
using ::testing::StartsWith;

class Placer : public ::testing::Test {
 protected:
  Placer() {
    for (int i = 0; i < 8; ++i) placer_.OnSnapshot(rig_.Show(pose_));
    rig_.ring.WaitUntilPacked();
  }
  const Rigid3 pose_ = LookFrom({0, 0, 0}, 0, 0.35);
  Rig rig_;
  PointerPlacer placer_{[this](FrameId id) { return rig_.ring.Find(id, FrameRing::Want::kPose); },
                        {}};
};

TEST_F(Placer, APixelIsWhereAClickWouldPutItNearly) {
  for (const FrameId frame : {FrameId{2}, rig_.map.next_frame - 1}) {
    const AnnotationTarget target = PixelTarget{frame, {330, 300}};
    const auto points = placer_.Locate({&target, 1});
    ASSERT_TRUE(points.ok()) << points.status();
    const Vector3d truth = rig_.Truth(pose_, {330, 300});
    EXPECT_LT(((*points)[0] - truth).norm(), 0.05 * truth.norm());
  }
}

TEST_F(Placer, AStrokeLiesOnOneSurface) {
  std::optional<StrokeSurface> surface;
  std::vector<AnnotationTarget> targets;
  for (int i = 0; i < 20; ++i) {
    targets.push_back(PixelTarget{rig_.map.next_frame - 1, Vector2d(300 + 3 * i, 300)});
  }
  const auto first = placer_.Trace(absl::MakeSpan(targets).subspan(0, 1), surface);
  ASSERT_TRUE(first.ok()) << first.status();
  ASSERT_TRUE(surface.has_value());
  const auto rest = placer_.Trace(absl::MakeSpan(targets).subspan(1), surface);
  ASSERT_TRUE(rest.ok());
  for (const Vector3d& point : *rest) {
    EXPECT_NEAR((point - surface->point_in_world).dot(surface->normal_in_world), 0, 1e-9);
  }
  // As the ink that it becomes.
  AnnotationDraft ink;
  ink.shape = AnnotationShape::kInk;
  ink.target = targets[0];
  for (const AnnotationTarget& one : targets)
    ink.ink_px.push_back(std::get<PixelTarget>(one).pixel);
  const auto made = rig_.manager.Create(ink, "ann");
  ASSERT_TRUE(made.ok());
  const Vector3d end = made->annotation.anchor.point_in_world + made->annotation.ink_offset_m[19];
  EXPECT_LT((end - rest->back()).norm(), 0.01);
}

TEST_F(Placer, RefusalsNameThePoint) {
  const AnnotationTarget targets[] = {PixelTarget{rig_.map.next_frame - 1, {330, 300}},
                                      PixelTarget{987654, {330, 300}}};
  const absl::Status unknown = placer_.Locate(targets).status();
  EXPECT_EQ(unknown.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(unknown.message()), StartsWith("points[1]"));
  PointerPlacer before({}, {});
  EXPECT_EQ(before.Locate(targets).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(Placer, IsQuick) {
  std::vector<AnnotationTarget> targets(64, PixelTarget{3, {330, 300}});
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(placer_.Locate(targets).ok());
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  std::printf("pointer: %.3f ms a point\n", ms / 64);
  EXPECT_LT(ms / 64, 5.0);
}

}  // namespace
}  // namespace saccade::pointer_placer_test
