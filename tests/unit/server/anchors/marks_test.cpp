// Locks, groups, pins, ticks, persons, and the shapes that have more than an anchor.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/unit/server/anchors/rig.hpp"

namespace saccade::marks_test {
namespace {

using ::testing::HasSubstr;
using testing::LookFrom;
using testing::Rig;
using ::testing::SizeIs;

Editor Person(const std::string& person, const std::string& tab = "tab", bool wearer = false) {
  Editor editor;
  editor.person_id = person;
  editor.participant_id = person + " " + tab;
  editor.name = "name of " + person;
  editor.wearer = wearer;
  return editor;
}

class Marks : public ::testing::Test {
 protected:
  Marks() { rig_.Show(pose_); }

  AnnotationDraft At(AnnotationShape shape, const Eigen::Vector3d& point = {0, 0, 2}) {
    AnnotationDraft draft;
    draft.shape = shape;
    draft.target = PointTarget{point};
    draft.author = "Ann";
    if (shape == AnnotationShape::kCheckList) draft.check_items = {"oil", "lid"};
    if (shape == AnnotationShape::kPicture) {
      draft.picture = std::make_shared<Picture>(Picture{"00ff", "image/png", 4, 3, "bytes"});
    }
    return draft;
  }
  std::string Make(AnnotationShape shape, const Editor& editor) {
    const absl::StatusOr<AnnotationEdit> edit = manager_.Create(At(shape), editor);
    EXPECT_TRUE(edit.ok()) << edit.status();
    return edit->annotation.id;
  }
  absl::Status Change(const std::string& id, const Editor& editor, const std::string& text) {
    AnnotationPatch patch;
    patch.id = id;
    patch.text = text;
    return manager_.Update(patch, editor).status();
  }
  absl::Status Lock(const std::string& id, const Editor& editor, bool locked) {
    AnnotationPatch patch;
    patch.id = id;
    patch.locked = locked;
    return manager_.Update(patch, editor).status();
  }
  Annotation Get(const std::string& id) { return manager_.Get(id).value(); }

  const Rigid3 pose_ = LookFrom({0, 0, 0}, 0, 0.2);
  Rig rig_;
  AnchorManager& manager_ = rig_.manager;
};

TEST_F(Marks, UndoBelongsToThePersonInWhicheverSession) {
  const std::string id = Make(AnnotationShape::kNote, Person("ann", "desk"));
  ASSERT_TRUE(Change(id, Person("ann", "tablet"), "oil").ok());
  EXPECT_EQ(Get(id).author_person_id, "ann");
  EXPECT_FALSE(manager_.Undo(Person("bob")).ok());
  ASSERT_TRUE(manager_.Undo(Person("ann", "a page loaded anew")).ok());
  EXPECT_EQ(Get(id).text, "");
  ASSERT_TRUE(manager_.Redo(Person("ann", "desk")).ok());
  EXPECT_EQ(Get(id).text, "oil");
  manager_.ForgetPerson("ann");
  EXPECT_FALSE(manager_.Undo(Person("ann", "desk")).ok());
}

TEST_F(Marks, ALockedMarkIsItsAuthorsAndTheWearers) {
  const std::string id = Make(AnnotationShape::kNote, Person("ann"));
  ASSERT_TRUE(Lock(id, Person("ann"), true).ok());
  for (const absl::Status& refused :
       {Change(id, Person("bob"), "x"), Lock(id, Person("bob"), false),
        manager_.Delete(id, Person("bob")).status()}) {
    EXPECT_EQ(refused.code(), absl::StatusCode::kPermissionDenied);
    EXPECT_THAT(std::string(refused.message()), HasSubstr("locked by name of ann"));
  }
  EXPECT_TRUE(Change(id, Person("ann", "another tab"), "oil").ok());
  EXPECT_TRUE(Change(id, Person("bob", "tab", /*wearer=*/true), "petrol").ok());
  ASSERT_TRUE(Lock(id, Person("will", "tab", true), false).ok());
  EXPECT_TRUE(Change(id, Person("bob"), "water").ok());
}

TEST_F(Marks, NobodyLocksWhatIsAnothers) {
  const std::string id = Make(AnnotationShape::kNote, Person("ann"));
  const absl::Status refused = Lock(id, Person("bob"), true);
  EXPECT_EQ(refused.code(), absl::StatusCode::kPermissionDenied);
  EXPECT_THAT(std::string(refused.message()), ::testing::StartsWith("locked: "));
  EXPECT_FALSE(Get(id).locked);
}

TEST_F(Marks, UndoDoesNotGoRoundALock) {
  const std::string id = Make(AnnotationShape::kNote, Person("ann"));
  const Editor wearer = Person("bob", "tab", true);
  ASSERT_TRUE(Lock(id, wearer, true).ok());
  ASSERT_TRUE(Change(id, wearer, "by the wearer").ok());
  // The same person, no longer the wearer.
  EXPECT_EQ(manager_.Undo(Person("bob")).status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(Get(id).text, "by the wearer");
  EXPECT_TRUE(manager_.Undo(wearer).ok());
}

TEST_F(Marks, APinsNumberIsGivenOnce) {
  const std::string first = Make(AnnotationShape::kPin, Person("ann"));
  const std::string second = Make(AnnotationShape::kPin, Person("bob"));
  EXPECT_EQ(Get(first).number, 1u);
  EXPECT_EQ(Get(second).number, 2u);
  ASSERT_TRUE(manager_.Delete(second, Person("bob")).ok());
  EXPECT_EQ(Get(Make(AnnotationShape::kPin, Person("ann"))).number, 3u);
  ASSERT_TRUE(manager_.Undo(Person("bob")).ok());
  EXPECT_EQ(Get(second).number, 2u) << "it is the same pin again";
  AnchorManager later(
      testing::RigOptions(), [this](FrameId id) { return rig_.ring.Find(id); }, nullptr);
  later.Load({}, 7);
  later.Resolve(rig_.map.Snapshot(pose_), *rig_.map.camera());
  EXPECT_EQ(later.Create(At(AnnotationShape::kPin), Person("ann"))->annotation.number, 8u);
}

TEST_F(Marks, ARefusedPinTakesNoNumber) {
  AnnotationDraft draft = At(AnnotationShape::kPin);
  draft.target = FeatureTarget{987654};
  EXPECT_FALSE(manager_.Create(draft, Person("ann")).ok());
  EXPECT_EQ(Get(Make(AnnotationShape::kPin, Person("ann"))).number, 1u);
}

TEST_F(Marks, LinesAreTickedByAnybodyLockedOrNotAndSayByWhom) {
  const std::string id = Make(AnnotationShape::kCheckList, Person("ann"));
  ASSERT_TRUE(Lock(id, Person("ann"), true).ok());
  const absl::StatusOr<AnnotationEdit> ticked = manager_.Tick(id, 1, true, Person("bob"));
  ASSERT_TRUE(ticked.ok()) << ticked.status();
  EXPECT_FALSE((*Get(id).check_items)[0].done);
  const CheckItem& lid = (*ticked->annotation.check_items)[1];
  EXPECT_TRUE(lid.done);
  EXPECT_EQ(lid.done_by, "name of bob");
  EXPECT_GT(lid.done_unix_ns, 1'600'000'000'000'000'000);
  ASSERT_TRUE(manager_.Tick(id, 1, false, Person("will")).ok());
  EXPECT_EQ((*Get(id).check_items)[1], (CheckItem{"lid", false, "", 0}));
  EXPECT_EQ(manager_.Tick(id, 2, true, Person("bob")).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(manager_.Tick(Make(AnnotationShape::kNote, Person("ann")), 0, true, Person("ann"))
                .status()
                .code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(Marks, WhatIsEditedTogetherIsUndoneTogether) {
  const std::string a = Make(AnnotationShape::kCube, Person("ann"));
  const std::string b = Make(AnnotationShape::kNote, Person("ann"));
  Editor group = Person("ann");
  group.edit_group = "drag 1";
  for (int i = 1; i <= 200; ++i) {  // more than can be undone one by one
    for (const std::string& id : {a, b}) {
      AnnotationPatch patch;
      patch.id = id;
      patch.target = PointTarget{{0.001 * i, 0, 2}};
      ASSERT_TRUE(manager_.Update(patch, group).ok());
    }
  }
  ASSERT_TRUE(Change(a, group, "moved").ok());
  const absl::StatusOr<AnnotationEdit> undone = manager_.Undo(Person("ann", "another tab"));
  ASSERT_TRUE(undone.ok()) << undone.status();
  EXPECT_THAT(undone->with, SizeIs(1)) << "one change for each mark";
  EXPECT_THAT(undone->description, HasSubstr("2 of 2 changes"));
  EXPECT_NEAR(Get(a).anchor.point_in_world.x(), 0.0, 1e-6);
  EXPECT_NEAR(Get(b).anchor.point_in_world.x(), 0.0, 1e-6);
  EXPECT_EQ(Get(a).text, "");
  ASSERT_TRUE(manager_.Redo(Person("ann")).ok());
  EXPECT_NEAR(Get(a).anchor.point_in_world.x(), 0.2, 1e-6);
  EXPECT_NEAR(Get(b).anchor.point_in_world.x(), 0.2, 1e-6);
  EXPECT_EQ(Get(a).text, "moved");
  ASSERT_TRUE(manager_.Undo(Person("ann")).ok());
  ASSERT_TRUE(manager_.Undo(Person("ann")).ok());
  EXPECT_EQ(manager_.Latest()->size(), 1u) << "the step before the group is its own";
}

TEST_F(Marks, OfAGroupWhatSomebodyElseChangedStays) {
  Editor group = Person("ann");
  group.edit_group = "paste";
  const std::string a = Make(AnnotationShape::kCube, group);
  const std::string b = Make(AnnotationShape::kCube, group);
  ASSERT_TRUE(Change(a, Person("bob"), "bob's now").ok());
  const absl::StatusOr<AnnotationEdit> undone = manager_.Undo(Person("ann"));
  ASSERT_TRUE(undone.ok()) << undone.status();
  EXPECT_THAT(undone->description, HasSubstr("1 of 2"));
  ASSERT_THAT(*manager_.Latest(), SizeIs(1));
  EXPECT_EQ(manager_.Latest()->front().id, a);
}

TEST_F(Marks, AnothersTickOnOneOfAGroupKeepsThatOneAloneFromUndo) {
  Editor group = Person("ann");
  const std::string note = Make(AnnotationShape::kNote, group);
  const std::string list = Make(AnnotationShape::kCheckList, group);
  group.edit_group = "colour";
  ASSERT_TRUE(Change(note, group, "oil").ok());
  ASSERT_TRUE(Change(list, group, "oil").ok());
  ASSERT_TRUE(manager_.Tick(list, 0, true, Person("bob")).ok());
  const absl::StatusOr<AnnotationEdit> undone = manager_.Undo(Person("ann"));
  ASSERT_TRUE(undone.ok()) << undone.status();
  EXPECT_EQ(Get(note).text, "");
  EXPECT_EQ(Get(list).text, "oil");
  EXPECT_THAT(undone->description, HasSubstr("1 of 2"));
  EXPECT_THAT(undone->description, HasSubstr("stays: check list " + list.substr(0, 8)));
  group.edit_group = "gone";
  ASSERT_TRUE(manager_.Delete(note, group).ok());
  ASSERT_TRUE(manager_.Delete(list, group).ok());
  ASSERT_TRUE(manager_.Undo(Person("ann")).ok());
  EXPECT_THAT(*manager_.Latest(), SizeIs(2));
}

TEST_F(Marks, WhatIsMadeAndDeletedWithinAGroupLeavesNoStep) {
  Editor group = Person("ann");
  group.edit_group = "g";
  const std::string kept = Make(AnnotationShape::kCube, Person("ann"));
  const std::string id = Make(AnnotationShape::kCube, group);
  ASSERT_TRUE(manager_.Delete(id, group).ok());
  ASSERT_TRUE(manager_.Undo(Person("ann")).ok());
  EXPECT_FALSE(manager_.Get(kept).has_value()) << "the step before";
}

TEST_F(Marks, TwoSessionsOfOnePersonHaveGroupsOfTheirOwn) {
  Editor one = Person("ann", "one"), two = Person("ann", "two");
  one.edit_group = two.edit_group = "1";
  Make(AnnotationShape::kCube, one);
  Make(AnnotationShape::kCube, two);
  ASSERT_TRUE(manager_.Undo(Person("ann")).ok());
  EXPECT_THAT(*manager_.Latest(), SizeIs(1));
}

TEST_F(Marks, ShapesKeepWhatIsTheirs) {
  AnnotationDraft box = At(AnnotationShape::kBox);
  box.extent_m = Eigen::Vector3d(0.1, 0.2, 0.3);
  box.world_from_mark = Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()));
  const absl::StatusOr<AnnotationEdit> made = manager_.Create(box, Person("ann"));
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->annotation.extent_m, *box.extent_m);
  AnnotationPatch turn;
  turn.id = made->annotation.id;
  turn.world_from_mark = Eigen::Quaterniond::Identity();
  turn.extent_m = Eigen::Vector3d(1, 1, 1);
  ASSERT_TRUE(manager_.Update(turn, Person("ann")).ok());
  ASSERT_TRUE(manager_.Undo(Person("ann")).ok());
  EXPECT_EQ(Get(turn.id).extent_m, *box.extent_m);
  EXPECT_EQ(Get(turn.id).world_from_mark->coeffs(), box.world_from_mark->coeffs());
  turn.id = Make(AnnotationShape::kNote, Person("ann"));
  const absl::Status status = manager_.Update(turn, Person("ann")).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), ::testing::StartsWith("extent_m: "));
}

TEST_F(Marks, InkMayBeGivenAsOffsetsFromAnyTarget) {
  AnnotationDraft ink = At(AnnotationShape::kInk);
  ink.ink_offset_m = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.1, 0}};
  const absl::StatusOr<AnnotationEdit> made = manager_.Create(ink, Person("ann"));
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->annotation.ink_offset_m, ink.ink_offset_m);
}

TEST_F(Marks, PicturesCountAndAreBounded) {
  AnchorOptions options = testing::RigOptions();
  options.max_person_picture_bytes = 8;
  Rig rig({}, nullptr, options);
  rig.Show(pose_);
  ASSERT_TRUE(rig.manager.Create(At(AnnotationShape::kPicture), Person("ann")).ok());
  const absl::Status full =
      rig.manager.Create(At(AnnotationShape::kPicture), Person("ann")).status();
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(full.message()), HasSubstr("bytes of pictures"));
  EXPECT_TRUE(rig.manager.Create(At(AnnotationShape::kPicture), Person("bob")).ok());
}

}  // namespace
}  // namespace saccade::marks_test
