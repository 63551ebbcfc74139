// What version 2 of the tables holds, and files of version 1.
#include <sqlite3.h>

#include <memory>

#include "server/store/sqlite.hpp"
#include "tests/unit/server/store/store_fixture.hpp"

namespace saccade::marks_store_test {
namespace {

using ::testing::SizeIs;
using testing::StoreTest;

class MarksStore : public StoreTest {
 protected:
  static AnnotationChange Of(std::uint64_t sequence, const std::string& id, AnnotationShape shape) {
    AnnotationChange change = Change(sequence, id);
    change.person_id = "person";
    Annotation& annotation = change.after->annotation;
    annotation.shape = shape;
    annotation.author_person_id = "author";
    annotation.locked = true;
    annotation.locked_by = "Ann";
    if (shape != AnnotationShape::kInk) annotation.ink_offset_m = {};
    if (shape == AnnotationShape::kBox) annotation.extent_m = {0.1, 0.2, 0.3};
    if (shape == AnnotationShape::kArrow)
      annotation.world_from_mark = Eigen::Quaterniond(0, 0, 1, 0);
    if (shape == AnnotationShape::kMeasure) {
      annotation.ink_offset_m = {{0.3, 0.4, 0}};
      annotation.length_m = 0.5;
      annotation.length_sigma_m = 0.01;
      change.after->end_covariance_in_world = 2e-4 * Eigen::Matrix3d::Identity();
    }
    if (shape == AnnotationShape::kPin) annotation.number = 12;
    if (shape == AnnotationShape::kPicture) {
      annotation.picture = std::make_shared<Picture>(
          Picture{"abcd", "image/jpeg", 40, 30, std::string("\xff\xd8\0\xff", 4)});
    }
    if (shape == AnnotationShape::kCheckList) {
      annotation.check_items = std::make_shared<std::vector<CheckItem>>(
          std::vector<CheckItem>{{"oil", true, "Bob", 77}, {"lid", false, "", 0}});
    }
    return change;
  }

  std::string Query(const std::string& sql) {
    auto database = SqliteDatabase::Open(file());
    EXPECT_TRUE(database.ok());
    const absl::StatusOr<std::string> answer = (*database)->Query(sql.c_str());
    return answer.ok() ? *answer : std::string(answer.status().message());
  }
  StoredAnnotations Kept() {
    std::unique_ptr<AnnotationStore> store = Open();
    if (store == nullptr) return {};
    absl::StatusOr<StoredAnnotations> all = store->LoadAll();
    EXPECT_TRUE(all.ok()) << all.status();
    return all.ok() ? *std::move(all) : StoredAnnotations{};
  }
  void Write(const AnnotationChange& change) {
    std::unique_ptr<AnnotationStore> store = Open();
    ASSERT_TRUE(store->Submit(change, nullptr).ok());
    ASSERT_TRUE(store->Flush().ok());
  }
};

TEST_F(MarksStore, EveryShapeComesBackWhole) {
  {
    std::unique_ptr<AnnotationStore> store = Open();
    for (int shape = 0; shape < kAnnotationShapes; ++shape) {
      const auto sequence = static_cast<std::uint64_t>(shape + 1);
      ASSERT_TRUE(store
                      ->Submit(Of(sequence, "id-" + std::to_string(shape),
                                  static_cast<AnnotationShape>(shape)),
                               nullptr)
                      .ok());
    }
    ASSERT_TRUE(store->Flush().ok());
  }
  const StoredAnnotations all = Kept();
  ASSERT_THAT(all.annotations, SizeIs(kAnnotationShapes));
  const auto read = [&all](AnnotationShape shape) -> const StoredAnnotation& {
    return all.annotations[static_cast<std::size_t>(shape)];
  };
  for (const StoredAnnotation& one : all.annotations) {
    EXPECT_EQ(one.annotation.author_person_id, "author");
    EXPECT_TRUE(one.annotation.locked);
    EXPECT_EQ(one.annotation.locked_by, "Ann");
  }
  EXPECT_EQ(read(AnnotationShape::kBox).annotation.extent_m, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(read(AnnotationShape::kArrow).annotation.world_from_mark->y(), 1.0);
  EXPECT_FALSE(read(AnnotationShape::kBox).annotation.world_from_mark.has_value());
  const StoredAnnotation& measure = read(AnnotationShape::kMeasure);
  EXPECT_EQ(measure.annotation.ink_offset_m[0], Eigen::Vector3d(0.3, 0.4, 0));
  EXPECT_EQ(measure.annotation.length_sigma_m, 0.01);
  EXPECT_EQ(measure.end_covariance_in_world(2, 2), 2e-4);
  EXPECT_EQ(read(AnnotationShape::kPin).annotation.number, 12u);
  EXPECT_EQ(read(AnnotationShape::kPicture).annotation.picture->bytes,
            std::string("\xff\xd8\0\xff", 4));
  EXPECT_EQ(read(AnnotationShape::kPicture).annotation.picture->width, 40);
  EXPECT_EQ((*read(AnnotationShape::kCheckList).annotation.check_items)[0],
            (CheckItem{"oil", true, "Bob", 77}));
  EXPECT_THAT(*read(AnnotationShape::kCheckList).annotation.check_items, SizeIs(2));
  EXPECT_EQ(all.last_pin, 12u);
  EXPECT_EQ(Query("SELECT person_id FROM audit LIMIT 1"), "person");
}

TEST_F(MarksStore, APinsNumberIsRememberedWhenThePinIsGone) {
  Write(Of(1, "pin", AnnotationShape::kPin));
  AnnotationChange gone = Of(2, "pin", AnnotationShape::kPin);
  gone.after.reset();
  Write(gone);
  const StoredAnnotations all = Kept();
  EXPECT_TRUE(all.annotations.empty());
  EXPECT_EQ(all.last_pin, 12u);
}

TEST_F(MarksStore, APictureIsKeptOnceAndGoesWithItsLastMark) {
  Write(Of(1, "a", AnnotationShape::kPicture));
  Write(Of(2, "b", AnnotationShape::kPicture));
  EXPECT_EQ(Query("SELECT count(*) FROM pictures"), "1");
  for (const char* id : {"a", "b"}) {
    EXPECT_EQ(Query("SELECT count(*) FROM pictures"), "1");
    AnnotationChange gone = Of(3, id, AnnotationShape::kPicture);
    gone.after.reset();
    Write(gone);
  }
  EXPECT_EQ(Query("SELECT count(*) FROM pictures"), "0");
  Write(Of(4, "a", AnnotationShape::kPicture));  // undone
  EXPECT_THAT(Kept().annotations, SizeIs(1));
}

TEST_F(MarksStore, TicksReplaceAndDeletingForgetsLines) {
  Write(Of(1, "list", AnnotationShape::kCheckList));
  AnnotationChange ticked = Of(2, "list", AnnotationShape::kCheckList);
  ticked.after->annotation.check_items = std::make_shared<std::vector<CheckItem>>(
      std::vector<CheckItem>{{"oil", true, "Bob", 77}, {"lid", true, "Will", 78}});
  Write(ticked);
  EXPECT_EQ((*Kept().annotations[0].annotation.check_items)[1].done_by, "Will");
  ticked.sequence = 3;
  ticked.kind = EditKind::kRefine;  // of the place alone
  ticked.after->annotation.check_items = nullptr;
  Write(ticked);
  EXPECT_THAT(*Kept().annotations[0].annotation.check_items, SizeIs(2));
  ticked.sequence = 4;
  ticked.kind = EditKind::kDelete;
  ticked.after.reset();
  Write(ticked);
  EXPECT_EQ(Query("SELECT count(*) FROM check_items"), "0");
}

TEST_F(MarksStore, ChangesMadeTogetherAreKeptTogether) {
  std::unique_ptr<AnnotationStore> store = Open();
  ASSERT_TRUE(
      store
          ->SubmitAll({Of(1, "a", AnnotationShape::kBox), Of(2, "b", AnnotationShape::kPin)},
                      nullptr)
          .ok());
  ASSERT_TRUE(store->Flush().ok());
  EXPECT_EQ(store->committed_sequence(), 2u);
  EXPECT_THAT(store->LoadAll()->annotations, SizeIs(2));
}

TEST_F(MarksStore, ARowWithoutItsPartsIsNamed) {
  Write(Of(1, "torn", AnnotationShape::kPicture));
  {
    auto database = SqliteDatabase::Open(file());
    ASSERT_TRUE((*database)->Execute("DELETE FROM pictures").ok());
  }
  std::unique_ptr<AnnotationStore> store = Open();
  const absl::Status status = store->LoadAll().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("'torn'"));
}

// As the program before this one left it.
TEST_F(MarksStore, AFileOfVersion1IsReadAndBroughtUpToDate) {
  Open().reset();
  {
    auto database = SqliteDatabase::Open(file());
    ASSERT_TRUE(database.ok());
    for (const char* sql :
         {"DROP TABLE annotations", "DROP TABLE audit", "DROP TABLE pictures",
          "DROP TABLE check_items", "DROP TABLE counters",
          "CREATE TABLE annotations("
          "  id TEXT PRIMARY KEY, shape INTEGER NOT NULL, text TEXT NOT NULL, author TEXT NOT NULL,"
          "  size_m REAL NOT NULL, color_rgba INTEGER NOT NULL, created_unix_ns INTEGER NOT NULL,"
          "  revision INTEGER NOT NULL, method INTEGER NOT NULL,"
          "  x_m REAL NOT NULL, y_m REAL NOT NULL, z_m REAL NOT NULL, error_m REAL NOT NULL,"
          "  covariance_m2 BLOB NOT NULL, ink_offset_m BLOB NOT NULL, world_key TEXT NOT NULL) "
          "STRICT",
          "CREATE TABLE audit("
          "  number INTEGER PRIMARY KEY AUTOINCREMENT, unix_ns INTEGER NOT NULL, session_id TEXT "
          "NOT "
          "  NULL, action TEXT NOT NULL, annotation_id TEXT NOT NULL, request_id TEXT NOT NULL,"
          "  description TEXT NOT NULL) STRICT",
          "CREATE INDEX audit_by_request ON audit(number) WHERE request_id <> ''",
          "INSERT INTO annotations VALUES('old', 1, 'oil', 'anna', 0.07, 4294967295, 17, 3, 2, "
          "0.1, "
          "0.2, 1.5, 0.01, zeroblob(48), x'', 'world')",
          "INSERT INTO audit VALUES(1, 17, 's', 'create', 'old', 'request', 'created note')",
          "PRAGMA user_version = 1"}) {
      ASSERT_TRUE((*database)->Execute(sql).ok()) << sql;
    }
  }
  const StoredAnnotations all = Kept();
  ASSERT_THAT(all.annotations, SizeIs(1));
  EXPECT_EQ(all.annotations[0].annotation.text, "oil");
  EXPECT_EQ(all.annotations[0].annotation.author_person_id, "");
  EXPECT_FALSE(all.annotations[0].annotation.locked);
  EXPECT_THAT(all.requests, SizeIs(1));
  EXPECT_EQ(all.last_pin, 0u);
  EXPECT_EQ(Query("PRAGMA user_version"), "2");
  Write(Of(1, "new", AnnotationShape::kCheckList));
  EXPECT_THAT(Kept().annotations, SizeIs(2));
}

}  // namespace
}  // namespace saccade::marks_store_test
