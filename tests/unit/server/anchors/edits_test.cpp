#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/server/anchors/rig.hpp"

namespace saccade::edits_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::LookFrom;
using testing::Rig;
using ::testing::SizeIs;

class Edits : public ::testing::Test {
 protected:
  Edits() { rig_.Show(pose_); }
  std::string Create(const std::string& session) {
    const absl::StatusOr<AnnotationEdit> edit = rig_.PlaceAt({0, 0, 2}, session);
    EXPECT_TRUE(edit.ok()) << edit.status();
    return edit->annotation.id;
  }
  absl::Status SetText(const std::string& id, const std::string& text, const std::string& session) {
    AnnotationPatch patch;
    patch.id = id;
    patch.text = text;
    return manager_.Update(patch, session).status();
  }

  const Rigid3 pose_ = LookFrom({0, 0, 0}, 0, 0.2);
  Rig rig_;
  AnchorManager& manager_ = rig_.manager;
};

TEST_F(Edits, UndoAndRedoWalkThroughOwnEdits) {
  const std::string id = Create("a");
  ASSERT_TRUE(SetText(id, "oil", "a").ok());
  ASSERT_TRUE(manager_.Delete(id, "a").ok());
  EXPECT_THAT(*manager_.Latest(), IsEmpty());
  const absl::StatusOr<AnnotationEdit> undone = manager_.Undo("a");
  ASSERT_TRUE(undone.ok());
  EXPECT_THAT(undone->change.description, HasSubstr("took back: deleted cube"));
  ASSERT_TRUE(undone->change.after);
  EXPECT_EQ(rig_.Only().text, "oil");
  ASSERT_TRUE(manager_.Undo("a").ok());
  EXPECT_EQ(rig_.Only().text, "");
  const absl::StatusOr<AnnotationEdit> gone = manager_.Undo("a");
  ASSERT_TRUE(gone.ok());
  EXPECT_FALSE(gone->change.after);
  EXPECT_EQ(gone->annotation.anchor.state, AnchorState::kStopped);
  EXPECT_EQ(manager_.Undo("a").status().code(), absl::StatusCode::kFailedPrecondition);
  ASSERT_TRUE(manager_.Redo("a").ok());
  ASSERT_TRUE(manager_.Redo("a").ok());
  EXPECT_EQ(rig_.Only().text, "oil");
  EXPECT_EQ(rig_.Only().id, id);
  ASSERT_TRUE(manager_.Redo("a").ok());
  EXPECT_THAT(*manager_.Latest(), IsEmpty());
  EXPECT_FALSE(manager_.Redo("a").ok());
}

TEST_F(Edits, NobodyUndoesAnothersWork) {
  const std::string id = Create("a");
  EXPECT_FALSE(manager_.Undo("b").ok());
  ASSERT_TRUE(SetText(id, "by b", "b").ok());
  const absl::Status status = manager_.Undo("a").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(status.message(), HasSubstr("somebody else changed it"));
  EXPECT_EQ(rig_.Only().text, "by b");
}

TEST_F(Edits, UndoWorksAgainOnceTheOtherTookTheirsBack) {
  const std::string id = Create("a");
  ASSERT_TRUE(SetText(id, "by b", "b").ok());
  ASSERT_TRUE(manager_.Undo("b").ok());
  EXPECT_TRUE(manager_.Undo("a").ok());
  EXPECT_THAT(*manager_.Latest(), IsEmpty());
}

TEST_F(Edits, RevisionRisesWithEveryEdit) {
  const std::string id = Create("a");
  std::uint64_t last = rig_.Only().revision;
  const auto rises = [&] {
    const bool higher = rig_.Only().revision > last;
    last = rig_.Only().revision;
    return higher;
  };
  ASSERT_TRUE(SetText(id, "1", "a").ok());
  EXPECT_TRUE(rises());
  ASSERT_TRUE(manager_.Undo("a").ok());
  EXPECT_TRUE(rises());
  ASSERT_TRUE(manager_.Redo("a").ok());
  EXPECT_TRUE(rises());
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(manager_.Delete(id, "a").ok());
    ASSERT_TRUE(manager_.Undo("a").ok());
    EXPECT_TRUE(rises());
  }
}

TEST_F(Edits, UndoOfATextDoesNotMoveTheAnchorBack) {
  const std::string id = Create("a");
  ASSERT_TRUE(SetText(id, "oil", "a").ok());
  rig_.map.Correct({Eigen::Quaterniond::Identity(), {0.3, 0, 0}}, 0);
  rig_.Show(pose_);
  const Eigen::Vector3d corrected = rig_.Only().anchor.point_in_world;
  ASSERT_TRUE(manager_.Undo("a").ok());
  EXPECT_LT((rig_.Only().anchor.point_in_world - corrected).norm(), 1e-9);
}

TEST_F(Edits, UndoOfADeleteFindsThePlaceInTheCorrectedMap) {
  const std::string id = Create("a");
  rig_.Show(pose_);
  const Eigen::Vector3d before = rig_.Only().anchor.point_in_world;
  ASSERT_TRUE(manager_.Delete(id, "a").ok());
  const Rigid3 correction{ExpQuaternion({0, 0.2, 0}), {0.3, 0, 0}};
  rig_.map.Correct(correction, 0);
  rig_.Show(pose_);
  ASSERT_TRUE(manager_.Undo("a").ok());
  EXPECT_LT((rig_.Only().anchor.point_in_world - correction * before).norm(), 0.005);
}

TEST_F(Edits, RollBackRestoresMemoryAndHistory) {
  const std::string kept = Create("a");
  manager_.Committed(1);
  ASSERT_TRUE(SetText(kept, "lost", "b").ok());
  Create("a");
  ASSERT_TRUE(manager_.Undo("a").ok());
  ASSERT_TRUE(manager_.Delete(kept, "b").ok());
  manager_.RollBack(1);
  ASSERT_THAT(*manager_.Latest(), SizeIs(1));
  EXPECT_EQ(rig_.Only().id, kept);
  EXPECT_EQ(rig_.Only().text, "");
  EXPECT_FALSE(manager_.Undo("b").ok()) << "b's edits never were";
  EXPECT_TRUE(manager_.Undo("a").ok());
  EXPECT_THAT(*manager_.Latest(), IsEmpty());
}

TEST_F(Edits, StoredAnnotationsComeBackPausedAndThenAtTheirPoint) {
  const absl::StatusOr<AnnotationEdit> edit = rig_.PlaceAt({0.1, 0.2, 1.9}, "a");
  ASSERT_TRUE(edit.ok() && edit->change.after);
  Rig restarted;
  restarted.manager.Load({*edit->change.after});
  EXPECT_EQ(restarted.Only().anchor.state, AnchorState::kPaused);
  EXPECT_THAT(restarted.Only().anchor.reason, HasSubstr("not known in this map yet"));
  EXPECT_THAT(restarted.Only().anchor.reason, HasSubstr("show the target"));
  restarted.Show(pose_);
  EXPECT_EQ(restarted.Only().anchor.state, AnchorState::kTracking)
      << restarted.Only().anchor.reason;
  EXPECT_LT((restarted.Only().anchor.point_in_world - Eigen::Vector3d(0.1, 0.2, 1.9)).norm(), 1e-6);
}

TEST_F(Edits, RefinementsAreHandedOutSparingly) {
  Create("a");
  rig_.Show(pose_);
  EXPECT_THAT(manager_.TakeRefinements(), IsEmpty());
  rig_.map.Correct({Eigen::Quaterniond::Identity(), {0.3, 0, 0}}, 0);
  for (int i = 0; i < 30; ++i) rig_.Show(pose_);
  EXPECT_THAT(manager_.TakeRefinements(), IsEmpty()) << "not within two seconds";
  for (int i = 0; i < 40; ++i) rig_.Show(pose_);
  const std::vector<AnnotationChange> changes = manager_.TakeRefinements();
  ASSERT_THAT(changes, SizeIs(1));
  EXPECT_EQ(changes[0].kind, EditKind::kRefine);
  EXPECT_THAT(manager_.TakeRefinements(), IsEmpty());
}

TEST_F(Edits, UnknownIdsAndEmptyPatchesAreNamed) {
  EXPECT_EQ(manager_.Delete("nope", "a").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(SetText("nope", "x", "a").code(), absl::StatusCode::kNotFound);
  AnnotationPatch patch;
  patch.id = Create("a");
  EXPECT_EQ(manager_.Update(patch, "a").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(SetText(patch.id, std::string(501, 'x'), "a").code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace saccade::edits_test
