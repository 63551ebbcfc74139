// What undo costs: differences that share the stroke, bounded in bytes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include "tests/unit/server/anchors/rig.hpp"

namespace saccade::undo_memory_test {
namespace {

using testing::LookFrom;
using testing::Rig;

/// Bytes that the program has from malloc; 0 under a sanitizer, which has its own.
std::size_t Allocated() { return mallinfo2().uordblks; }

const Rigid3 kPose = LookFrom({0, 0, 0}, 0, 0.2);

class UndoMemory : public ::testing::Test {
 protected:
  void Use(AnchorOptions options) {
    rig_ = std::make_unique<Rig>(testing::SyntheticMap::Options(), nullptr, std::move(options));
    rig_->Show(kPose);
  }
  void SetUp() override { Use(testing::RigOptions()); }
  std::string Stroke(const std::string& session, std::size_t points = 2000) {
    const absl::StatusOr<AnnotationEdit> edit = rig_->Draw(points, session);
    EXPECT_TRUE(edit.ok()) << edit.status();
    manager().Committed(edit->change.sequence);
    return edit->annotation.id;
  }
  void Recolour(const std::string& id, int times, const std::string& session) {
    AnnotationPatch patch;
    patch.id = id;
    for (int i = 0; i < times; ++i) {
      patch.color_rgba = 0xff + 256 * static_cast<std::uint32_t>(i);
      const absl::StatusOr<AnnotationEdit> edit = manager().Update(patch, session);
      ASSERT_TRUE(edit.ok()) << edit.status();
      manager().Committed(edit->change.sequence);
    }
  }
  AnchorManager& manager() { return rig_->manager; }

  std::unique_ptr<Rig> rig_;
};

TEST_F(UndoMemory, AHundredRecolouringsOfALongStrokeKeepItOnce) {
  const std::string id = Stroke("a");
  const std::size_t stroke_bytes = rig_->Only().ink_offset_m.bytes();
  EXPECT_EQ(stroke_bytes, 48'000u);
  const std::size_t before = Allocated();
  Recolour(id, 100, "a");
  const std::size_t grown = Allocated() - before;
  RecordProperty("counted_bytes", static_cast<int>(manager().undo_bytes()));
  RecordProperty("allocated_bytes", static_cast<int>(grown));
  EXPECT_LT(manager().undo_bytes(), stroke_bytes + 120'000);
  EXPECT_LT(grown, 200'000u) << "whole strokes were 9.8 MB";
  // And all of it can be taken back.
  const std::uint32_t newest = rig_->Only().color_rgba;
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(manager().Undo("a").ok()) << i;
  EXPECT_EQ(rig_->Only().color_rgba, 0xffffffffu);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(manager().Redo("a").ok()) << i;
  EXPECT_EQ(rig_->Only().color_rgba, newest);
  EXPECT_THAT(rig_->Only().ink_offset_m, ::testing::SizeIs(2000));
}

TEST_F(UndoMemory, OneSessionsOldestStepsGoFirst) {
  AnchorOptions options = testing::RigOptions();
  options.max_undo_bytes = 500'000;
  Use(options);
  for (int i = 0; i < 50; ++i) {  // deleted strokes are kept by undo alone: 48 kB each
    ASSERT_TRUE(manager().Delete(Stroke("a"), "a").ok());
    ASSERT_LE(manager().undo_bytes(), options.max_undo_bytes);
  }
  int undone = 0;
  while (manager().Undo("a").ok()) ++undone;
  EXPECT_GE(undone, 16) << "two steps each share a stroke: some nine strokes fit";
  EXPECT_LE(undone, 22);
}

TEST_F(UndoMemory, AllSessionsTogetherAreBoundedAndTheOldestOfAllGoesFirst) {
  AnchorOptions options = testing::RigOptions();
  options.max_undo_bytes_all = 600'000;
  Use(options);
  std::vector<std::string> ids;
  for (int i = 0; i < 40; ++i) {
    ids.push_back(Stroke("session " + std::to_string(i)));
    ASSERT_LE(manager().undo_bytes(), options.max_undo_bytes_all);
  }
  EXPECT_FALSE(manager().Undo("session 0").ok());
  EXPECT_TRUE(manager().Undo("session 39").ok());
  EXPECT_TRUE(manager().Undo("session 33").ok());
}

TEST_F(UndoMemory, ForgettingAPersonGivesItsBytesBack) {
  Recolour(Stroke("a"), 10, "a");
  EXPECT_GT(manager().undo_bytes(), 48'000u);
  manager().ForgetPerson("a");
  EXPECT_EQ(manager().undo_bytes(), 0u);
  EXPECT_FALSE(manager().Undo("nobody").ok());
  EXPECT_EQ(manager().undo_bytes(), 0u);
}

}  // namespace
}  // namespace saccade::undo_memory_test
