// What one session and the whole server may hold, and what somebody is told who wants more.
#include "server/anchors/quota.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/server/anchors/rig.hpp"

namespace saccade::quota_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::LookFrom;
using testing::Rig;
using ::testing::SizeIs;

const Rigid3 kPose = LookFrom({0, 0, 0}, 0, 0.2);

AnchorOptions Few() {
  AnchorOptions options = testing::RigOptions();
  options.max_annotations = 5;
  options.max_session_annotations = 3;
  options.max_ink_points = 500;
  options.max_session_ink_points = 300;
  options.max_bytes = 11'000;
  return options;
}

class Quotas : public ::testing::Test {
 protected:
  explicit Quotas(AnchorOptions options = Few()) : rig_({}, nullptr, std::move(options)) {
    rig_.Show(kPose);
  }
  absl::StatusOr<AnnotationEdit> Mark(const std::string& session, std::size_t text_bytes = 0) {
    AnnotationDraft draft;
    draft.target = PointTarget{{0, 0, 2}};
    draft.text.assign(text_bytes, 'x');
    return rig_.manager.Create(draft, session);
  }
  Rig rig_;
};

void ExpectRefused(const absl::Status& status, const std::string& quota, const std::string& amount,
                   const std::string& remedy) {
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr(quota), HasSubstr(amount), HasSubstr(remedy)));
}

TEST_F(Quotas, OneSessionLeavesRoomForTheOthers) {
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(Mark("a").ok());
  ExpectRefused(Mark("a").status(), "quota of one person", "3 of 3 annotations",
                "delete some of yours");
  const absl::StatusOr<AnnotationEdit> other = Mark("b");
  ASSERT_TRUE(other.ok()) << other.status();
  // What is deleted, by whomever, no longer counts.
  ASSERT_TRUE(rig_.manager.Delete(rig_.Only().id, "b").ok());
  EXPECT_TRUE(Mark("a").ok());
}

TEST_F(Quotas, TheServerHoldsSoManyAnnotations) {
  for (const char* session : {"a", "a", "b", "b", "c"}) ASSERT_TRUE(Mark(session).ok());
  ExpectRefused(Mark("c").status(), "quota of this server", "5 of 5 annotations", "delete some");
}

TEST_F(Quotas, InkIsCountedInPoints) {
  ASSERT_TRUE(rig_.Draw(200, "a").ok());
  ExpectRefused(rig_.Draw(101, "a").status(), "quota of one person", "200 of 300 points of ink",
                "draw a shorter one");
  ASSERT_TRUE(rig_.Draw(100, "a").ok());
  ASSERT_TRUE(Mark("a").ok()) << "a mark without ink is not a stroke";
  ExpectRefused(rig_.Draw(201, "b").status(), "quota of this server", "300 of 500 points of ink",
                "delete some strokes");
  EXPECT_TRUE(rig_.Draw(150, "b").ok());
}

TEST_F(Quotas, TextsAndStrokesAreCountedInBytes) {
  ASSERT_TRUE(rig_.Draw(250, "a").ok());  // 6000 bytes
  ASSERT_TRUE(rig_.Draw(200, "b").ok());  // 4800
  const absl::StatusOr<AnnotationEdit> note = Mark("c", 150);
  ASSERT_TRUE(note.ok()) << note.status();
  ExpectRefused(Mark("c", 100).status(), "quota of this server",
                "10950 of 11000 bytes of texts and ink are taken and this needs 100",
                "shorten this one");
  AnnotationPatch patch;
  patch.id = note->annotation.id;
  patch.text = std::string(300, 'y');
  ExpectRefused(rig_.manager.Update(patch, "c").status(), "quota of this server", "needs 150",
                "shorten");
  patch.text = std::string(140, 'y');
  EXPECT_TRUE(rig_.manager.Update(patch, "c").ok()) << "what does not grow is allowed";
}

TEST_F(Quotas, UndoDoesNotGoRoundThem) {
  std::vector<std::string> ids;
  for (const char* session : {"a", "a", "b", "b", "b"}) {
    const absl::StatusOr<AnnotationEdit> mark = Mark(session);
    ASSERT_TRUE(mark.ok());
    ids.push_back(mark->annotation.id);
  }
  ASSERT_TRUE(rig_.manager.Delete(ids[2], "a").ok());
  ASSERT_TRUE(Mark("c").ok());
  ExpectRefused(rig_.manager.Undo("a").status(), "quota of this server", "5 of 5", "delete some");
  ASSERT_TRUE(rig_.manager.Delete(ids[3], "b").ok());
  EXPECT_TRUE(rig_.manager.Undo("a").ok()) << "the refused step was kept";
  EXPECT_THAT(*rig_.manager.Latest(), SizeIs(5));
}

TEST_F(Quotas, AnOlderStoreAboveThemIsLoadedWholeAndCanBeEdited) {
  std::vector<StoredAnnotation> stored(9);
  for (std::size_t i = 0; i < stored.size(); ++i) {
    stored[i].annotation.id = "old " + std::to_string(i);
    stored[i].annotation.shape = AnnotationShape::kInk;
    stored[i].annotation.ink_offset_m = InkStroke::Points(200, Eigen::Vector3d::Zero());
    stored[i].annotation.created_unix_ns = static_cast<std::int64_t>(i) + 1;
  }
  rig_.manager.Load(stored);
  EXPECT_THAT(*rig_.manager.Latest(), SizeIs(9));
  EXPECT_EQ(Mark("a").status().code(), absl::StatusCode::kResourceExhausted);
  AnnotationPatch patch;
  patch.id = "old 3";
  patch.color_rgba = 0xff0000ff;
  EXPECT_TRUE(rig_.manager.Update(patch, "a").ok());
  EXPECT_TRUE(rig_.manager.Undo("a").ok());
  for (int i = 0; i < 8; ++i) {
    ASSERT_TRUE(rig_.manager.Delete("old " + std::to_string(i), "a").ok());
  }
  EXPECT_TRUE(Mark("a").ok());
}

TEST(DefaultQuotas, HoldNinetyStrokesOf2000PointsAndAThousandMarks) {
  Rig rig;
  rig.Show(kPose);
  for (int i = 0; i < 90; ++i) ASSERT_TRUE(rig.Draw(2000, "a").ok()) << i;
  EXPECT_FALSE(rig.Draw(2000, "a").ok());
  Rig marks;
  marks.Show(kPose);
  const AnchorOptions options;
  for (std::size_t i = 0; i < options.max_annotations; ++i) {
    ASSERT_TRUE(marks.PlaceAt({0, 0, 2}, i < options.max_session_annotations ? "a" : "b").ok());
  }
  EXPECT_FALSE(marks.PlaceAt({0, 0, 2}, "b").ok());
}

}  // namespace
}  // namespace saccade::quota_test
