#include "server/store/annotation_parts.hpp"

#include <memory>
#include <utility>
#include <vector>

#include "shared/scene/limits.hpp"

namespace saccade {
namespace {

absl::Status Run(SqliteDatabase& database, const char* sql, std::string_view text) {
  absl::StatusOr<SqliteStatement> statement = database.Prepare(sql);
  if (!statement.ok()) return statement.status();
  statement->Bind(0, text);
  return statement->Run();
}

absl::Status WritePicture(SqliteDatabase& database, const Picture& picture) {
  absl::StatusOr<SqliteStatement> statement =
      database.Prepare("INSERT OR IGNORE INTO pictures VALUES(?,?,?,?,?)");
  if (!statement.ok()) return statement.status();
  statement->Bind(0, picture.sha256);
  statement->Bind(1, picture.media_type);
  statement->Bind(2, std::int64_t{picture.width});
  statement->Bind(3, std::int64_t{picture.height});
  statement->BindBytes(4, picture.bytes);
  return statement->Run();
}

absl::Status WriteItems(SqliteDatabase& database, const Annotation& annotation) {
  absl::StatusOr<SqliteStatement> statement =
      database.Prepare("INSERT INTO check_items VALUES(?,?,?,?,?,?)");
  if (!statement.ok()) return statement.status();
  std::int64_t position = 0;
  for (const CheckItem& item : *annotation.check_items) {
    statement->Bind(0, annotation.id);
    statement->Bind(1, position++);
    statement->Bind(2, item.text);
    statement->Bind(3, std::int64_t{item.done});
    statement->Bind(4, item.done_by);
    statement->Bind(5, item.done_unix_ns);
    if (absl::Status status = statement->Run(); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status KeepPin(SqliteDatabase& database, std::uint32_t number) {
  absl::StatusOr<SqliteStatement> statement = database.Prepare(
      "INSERT INTO counters VALUES('last_pin', ?) "
      "ON CONFLICT(name) DO UPDATE SET value = max(value, excluded.value)");
  if (!statement.ok()) return statement.status();
  statement->Bind(0, std::int64_t{number});
  return statement->Run();
}

/// Null: there is none of that name, or it makes no sense.
absl::StatusOr<PicturePtr> ReadPicture(SqliteDatabase& database, const std::string& sha256) {
  absl::StatusOr<SqliteStatement> row =
      database.Prepare("SELECT media_type, width, height, bytes FROM pictures WHERE sha256 = ?");
  if (!row.ok()) return row.status();
  row->Bind(0, sha256);
  const absl::StatusOr<bool> there = row->Step();
  if (!there.ok()) return there.status();
  if (!*there) return PicturePtr();
  auto picture = std::make_shared<Picture>();
  picture->sha256 = sha256;
  picture->media_type = row->Text(0);
  picture->bytes = row->Bytes(3);
  const std::int64_t width = row->Int(1), height = row->Int(2);
  if (width < 1 || height < 1 || width > kMaxPictureSide || height > kMaxPictureSide ||
      picture->bytes.empty() || picture->bytes.size() > kMaxPictureBytes) {
    return PicturePtr();
  }
  picture->width = static_cast<int>(width);
  picture->height = static_cast<int>(height);
  return PicturePtr(std::move(picture));
}

absl::StatusOr<CheckItems> ReadItems(SqliteDatabase& database, const std::string& id) {
  absl::StatusOr<SqliteStatement> row = database.Prepare(
      "SELECT text, done, done_by, done_unix_ns FROM check_items WHERE annotation_id = ? "
      "ORDER BY position");
  if (!row.ok()) return row.status();
  row->Bind(0, id);
  auto items = std::make_shared<std::vector<CheckItem>>();
  for (;;) {
    const absl::StatusOr<bool> there = row->Step();
    if (!there.ok()) return there.status();
    if (!*there) break;
    items->push_back({row->Text(0), row->Int(1) != 0, row->Text(2), row->Int(3)});
  }
  return CheckItems(std::move(items));
}

}  // namespace

absl::Status WriteParts(SqliteDatabase& database, const AnnotationChange& change) {
  absl::Status status = Run(database, "DELETE FROM check_items WHERE annotation_id = ?", change.id);
  if (!status.ok() || !change.after) return status;
  const Annotation& annotation = change.after->annotation;
  if (annotation.picture) status = WritePicture(database, *annotation.picture);
  if (status.ok() && annotation.check_items) status = WriteItems(database, annotation);
  if (status.ok() && annotation.number > 0) status = KeepPin(database, annotation.number);
  return status;
}

absl::Status DropUnusedPictures(SqliteDatabase& database) {
  return database.Execute(
      "DELETE FROM pictures WHERE NOT EXISTS(SELECT 1 FROM annotations "
      "WHERE picture_sha256 <> '' AND picture_sha256 = pictures.sha256)");
}

absl::StatusOr<bool> ReadParts(SqliteDatabase& database, const std::string& picture_sha256,
                               Annotation& annotation) {
  if (annotation.shape == AnnotationShape::kPicture) {
    absl::StatusOr<PicturePtr> picture = ReadPicture(database, picture_sha256);
    if (!picture.ok()) return picture.status();
    annotation.picture = *std::move(picture);
    return annotation.picture != nullptr;
  }
  if (annotation.shape == AnnotationShape::kCheckList) {
    absl::StatusOr<CheckItems> items = ReadItems(database, annotation.id);
    if (!items.ok()) return items.status();
    annotation.check_items = *std::move(items);
    return !annotation.check_items->empty() && annotation.check_items->size() <= kMaxCheckItems;
  }
  return true;
}

absl::StatusOr<std::uint32_t> ReadLastPin(SqliteDatabase& database) {
  absl::StatusOr<SqliteStatement> row =
      database.Prepare("SELECT value FROM counters WHERE name = 'last_pin'");
  if (!row.ok()) return row.status();
  const absl::StatusOr<bool> there = row->Step();
  if (!there.ok()) return there.status();
  return *there ? static_cast<std::uint32_t>(row->Int(0)) : 0;
}

}  // namespace saccade
