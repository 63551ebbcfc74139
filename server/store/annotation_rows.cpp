#include "server/store/annotation_rows.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "server/store/annotation_parts.hpp"

namespace saccade {
namespace {

constexpr int kApplicationId = 0x53414343;  // "SACC"
constexpr int kKeptAudit = 100'000;         // rows
constexpr int kKeptRequests = 10'000;

/// Schema changes by version; never edit one that was released, add the next.
constexpr const char* kMigrations[kSchemaVersion] = {
    R"(
CREATE TABLE annotations(
  id TEXT PRIMARY KEY, shape INTEGER NOT NULL, text TEXT NOT NULL, author TEXT NOT NULL,
  size_m REAL NOT NULL, color_rgba INTEGER NOT NULL, created_unix_ns INTEGER NOT NULL,
  revision INTEGER NOT NULL, method INTEGER NOT NULL,
  x_m REAL NOT NULL, y_m REAL NOT NULL, z_m REAL NOT NULL, error_m REAL NOT NULL,
  covariance_m2 BLOB NOT NULL, ink_offset_m BLOB NOT NULL, world_key TEXT NOT NULL) STRICT;
CREATE TABLE audit(
  number INTEGER PRIMARY KEY AUTOINCREMENT, unix_ns INTEGER NOT NULL, session_id TEXT NOT NULL,
  action TEXT NOT NULL, annotation_id TEXT NOT NULL, request_id TEXT NOT NULL,
  description TEXT NOT NULL) STRICT;
CREATE INDEX audit_by_request ON audit(number) WHERE request_id <> '';
)",
    R"(
ALTER TABLE annotations ADD COLUMN author_person_id TEXT NOT NULL DEFAULT '';
ALTER TABLE annotations ADD COLUMN locked INTEGER NOT NULL DEFAULT 0;
ALTER TABLE annotations ADD COLUMN locked_by TEXT NOT NULL DEFAULT '';
ALTER TABLE annotations ADD COLUMN world_from_mark_xyzw BLOB NOT NULL DEFAULT x'';
ALTER TABLE annotations ADD COLUMN extent_m BLOB NOT NULL DEFAULT x'';
ALTER TABLE annotations ADD COLUMN pin_number INTEGER NOT NULL DEFAULT 0;
ALTER TABLE annotations ADD COLUMN length_m REAL NOT NULL DEFAULT 0;
ALTER TABLE annotations ADD COLUMN length_sigma_m REAL NOT NULL DEFAULT 0;
ALTER TABLE annotations ADD COLUMN end_covariance_m2 BLOB NOT NULL DEFAULT x'';
ALTER TABLE annotations ADD COLUMN picture_sha256 TEXT NOT NULL DEFAULT '';
ALTER TABLE audit ADD COLUMN person_id TEXT NOT NULL DEFAULT '';
CREATE INDEX annotations_by_picture ON annotations(picture_sha256) WHERE picture_sha256 <> '';
CREATE TABLE pictures(
  sha256 TEXT PRIMARY KEY, media_type TEXT NOT NULL, width INTEGER NOT NULL, height INTEGER NOT NULL,
  bytes BLOB NOT NULL) STRICT;
CREATE TABLE check_items(
  annotation_id TEXT NOT NULL, position INTEGER NOT NULL, text TEXT NOT NULL, done INTEGER NOT NULL,
  done_by TEXT NOT NULL, done_unix_ns INTEGER NOT NULL,
  PRIMARY KEY(annotation_id, position)) STRICT;
CREATE TABLE counters(name TEXT PRIMARY KEY, value INTEGER NOT NULL) STRICT;
)"};

const char* ActionName(EditKind kind) {
  switch (kind) {
    case EditKind::kCreate:
      return "create";
    case EditKind::kUpdate:
      return "update";
    case EditKind::kDelete:
      return "delete";
    case EditKind::kUndo:
      return "undo";
    case EditKind::kRedo:
      return "redo";
    case EditKind::kRefine:
      return "refine";
  }
  return "unknown";
}

std::vector<double> UpperTriangle(const Eigen::Matrix3d& c) {
  return {c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2)};
}

absl::Status Upsert(SqliteDatabase& database, const StoredAnnotation& stored) {
  absl::StatusOr<SqliteStatement> statement = database.Prepare(
      "INSERT OR REPLACE INTO annotations "
      "VALUES(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
  if (!statement.ok()) return statement.status();
  const Annotation& annotation = stored.annotation;
  const Anchor& anchor = annotation.anchor;
  std::vector<double> ink;
  ink.reserve(3 * annotation.ink_offset_m.size());
  for (const Eigen::Vector3d& offset : annotation.ink_offset_m) {
    ink.insert(ink.end(), {offset.x(), offset.y(), offset.z()});
  }
  statement->Bind(0, annotation.id);
  statement->Bind(1, static_cast<std::int64_t>(annotation.shape));
  statement->Bind(2, annotation.text);
  statement->Bind(3, annotation.author);
  statement->Bind(4, annotation.size_m);
  statement->Bind(5, static_cast<std::int64_t>(annotation.color_rgba));
  statement->Bind(6, annotation.created_unix_ns);
  statement->Bind(7, static_cast<std::int64_t>(annotation.revision));
  statement->Bind(8, static_cast<std::int64_t>(anchor.method));
  for (int axis = 0; axis < 3; ++axis) statement->Bind(9 + axis, anchor.point_in_world(axis));
  statement->Bind(12, anchor.error_m);
  statement->Bind(13, UpperTriangle(anchor.covariance_in_world));
  statement->Bind(14, ink);
  statement->Bind(15, stored.world_key);
  statement->Bind(16, annotation.author_person_id);
  statement->Bind(17, std::int64_t{annotation.locked});
  statement->Bind(18, annotation.locked_by);
  std::vector<double> rotation, extent, end;
  if (const auto& q = annotation.world_from_mark) rotation = {q->x(), q->y(), q->z(), q->w()};
  const Eigen::Vector3d& e = annotation.extent_m;
  if (annotation.shape == AnnotationShape::kBox) extent = {e.x(), e.y(), e.z()};
  if (annotation.shape == AnnotationShape::kMeasure) {
    end = UpperTriangle(stored.end_covariance_in_world);
  }
  statement->Bind(19, rotation);
  statement->Bind(20, extent);
  statement->Bind(21, std::int64_t{annotation.number});
  statement->Bind(22, annotation.length_m);
  statement->Bind(23, annotation.length_sigma_m);
  statement->Bind(24, end);
  statement->Bind(25, annotation.picture ? annotation.picture->sha256 : std::string());
  return statement->Run();
}

absl::Status Erase(SqliteDatabase& database, const std::string& id) {
  absl::StatusOr<SqliteStatement> statement =
      database.Prepare("DELETE FROM annotations WHERE id = ?");
  if (!statement.ok()) return statement.status();
  statement->Bind(0, id);
  return statement->Run();
}

absl::Status Audit(SqliteDatabase& database, const AnnotationChange& change) {
  absl::StatusOr<SqliteStatement> statement = database.Prepare(
      "INSERT INTO audit(unix_ns, session_id, action, annotation_id, request_id, description, "
      "person_id) VALUES(?,?,?,?,?,?,?)");
  if (!statement.ok()) return statement.status();
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  statement->Bind(0, static_cast<std::int64_t>(
                         std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()));
  statement->Bind(1, change.session_id);
  statement->Bind(2, std::string_view(ActionName(change.kind)));
  statement->Bind(3, change.id);
  statement->Bind(4, change.request_id);
  statement->Bind(5, change.description);
  statement->Bind(6, change.person_id);
  return statement->Run();
}

bool AllFinite(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(),
                     [](double number) { return std::isfinite(number); });
}

Eigen::Matrix3d Symmetric(const std::vector<double>& c) {
  Eigen::Matrix3d matrix;
  matrix << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  return matrix;
}

/// What version 2 added. False: it makes no sense.
bool ReadMark(const SqliteStatement& row, StoredAnnotation& stored) {
  Annotation& annotation = stored.annotation;
  annotation.author_person_id = row.Text(16);
  annotation.locked = row.Int(17) != 0;
  annotation.locked_by = row.Text(18);
  const std::vector<double> rotation = row.Numbers(19), extent = row.Numbers(20),
                            end = row.Numbers(24);
  annotation.number = static_cast<std::uint32_t>(row.Int(21));
  annotation.length_m = row.Double(22);
  annotation.length_sigma_m = row.Double(23);
  if (!AllFinite(rotation) || !AllFinite(extent) || !AllFinite(end)) return false;
  if (rotation.size() == 4) {
    annotation.world_from_mark.emplace(rotation[3], rotation[0], rotation[1], rotation[2]);
    if (std::abs(annotation.world_from_mark->norm() - 1.0) > 1e-6) return false;
  } else if (!rotation.empty()) {
    return false;
  }
  if (annotation.shape == AnnotationShape::kBox) {
    if (extent.size() != 3) return false;
    annotation.extent_m = {extent[0], extent[1], extent[2]};
    if (!(annotation.extent_m.minCoeff() > 0)) return false;
  }
  if (annotation.shape == AnnotationShape::kMeasure) {
    if (end.size() != 6 || annotation.ink_offset_m.size() != 1) return false;
    stored.end_covariance_in_world = Symmetric(end);
  }
  return annotation.shape != AnnotationShape::kPin || annotation.number > 0;
}

/// Nothing if the row makes no sense.
std::optional<StoredAnnotation> ReadRow(const SqliteStatement& row) {
  StoredAnnotation stored;
  Annotation& annotation = stored.annotation;
  Anchor& anchor = annotation.anchor;
  annotation.id = row.Text(0);
  annotation.text = row.Text(2);
  annotation.author = row.Text(3);
  annotation.size_m = row.Double(4);
  annotation.color_rgba = static_cast<std::uint32_t>(row.Int(5));
  annotation.created_unix_ns = row.Int(6);
  annotation.revision = static_cast<std::uint64_t>(row.Int(7));
  for (int axis = 0; axis < 3; ++axis) anchor.point_in_world(axis) = row.Double(9 + axis);
  anchor.error_m = row.Double(12);
  const std::vector<double> c = row.Numbers(13);
  const std::vector<double> ink = row.Numbers(14);
  stored.world_key = row.Text(15);
  const bool shape_known = row.Int(1) >= 0 && row.Int(1) < kAnnotationShapes;
  const bool method_known = row.Int(8) >= 0 && row.Int(8) <= 4;
  if (annotation.id.empty() || !shape_known || !method_known || c.size() != 6 ||
      ink.size() % 3 != 0 || !anchor.point_in_world.allFinite() || !(annotation.size_m > 0) ||
      !AllFinite(c) || !AllFinite(ink)) {
    return std::nullopt;
  }
  annotation.shape = static_cast<AnnotationShape>(row.Int(1));
  anchor.method = static_cast<AnchorMethod>(row.Int(8));
  anchor.covariance_in_world = Symmetric(c);
  InkStroke::Points points;
  points.reserve(ink.size() / 3);
  for (std::size_t i = 0; i < ink.size(); i += 3) {
    points.emplace_back(ink[i], ink[i + 1], ink[i + 2]);
  }
  annotation.ink_offset_m = std::move(points);
  if (!ReadMark(row, stored)) return std::nullopt;
  return stored;
}

/// Reads a number that SQLite answers to a PRAGMA.
absl::StatusOr<int> QueryInt(SqliteDatabase& database, const char* sql) {
  const absl::StatusOr<std::string> text = database.Query(sql);
  if (!text.ok()) return text.status();
  return std::atoi(text->c_str());
}

}  // namespace

absl::Status Migrate(SqliteDatabase& database, const std::string& file) {
  const absl::StatusOr<int> version = QueryInt(database, "PRAGMA user_version");
  if (!version.ok()) return version.status();
  const absl::StatusOr<int> application = QueryInt(database, "PRAGMA application_id");
  if (!application.ok()) return application.status();
  if (*version > kSchemaVersion) {
    return absl::FailedPreconditionError(absl::StrCat(
        file, " was written by a newer version (schema ", *version, ", this program knows ",
        kSchemaVersion, "); update this program or choose another --data-dir"));
  }
  const absl::StatusOr<int> tables = QueryInt(database, "SELECT count(*) FROM sqlite_schema");
  if (!tables.ok()) return tables.status();
  if (*tables > 0 && *application != kApplicationId) {
    return absl::DataLossError(absl::StrCat(
        file, " is the database of another program; move it away or choose another --data-dir"));
  }
  if (*version == kSchemaVersion) return absl::OkStatus();
  if (absl::Status status = database.Execute("BEGIN IMMEDIATE"); !status.ok()) return status;
  absl::Status status;
  for (int next = *version; next < kSchemaVersion && status.ok(); ++next) {
    status = database.Execute(kMigrations[next]);
  }
  const std::string pragmas = absl::StrCat("PRAGMA user_version = ", kSchemaVersion,
                                           "; PRAGMA application_id = ", kApplicationId);
  if (status.ok()) status = database.Execute(pragmas.c_str());
  if (status.ok()) status = database.Execute("COMMIT");
  if (!status.ok() && database.InTransaction()) database.Execute("ROLLBACK").IgnoreError();
  return status;
}

absl::Status WriteChange(SqliteDatabase& database, const AnnotationChange& change) {
  // What only a whole change can alter: a refinement is of the place alone.
  absl::Status status;
  if (change.kind != EditKind::kRefine) status = WriteParts(database, change);
  if (!status.ok()) return status;
  status = change.after ? Upsert(database, *change.after) : Erase(database, change.id);
  if (status.ok() && change.kind != EditKind::kRefine) status = DropUnusedPictures(database);
  if (status.ok() && change.kind != EditKind::kRefine) status = Audit(database, change);
  return status;
}

absl::StatusOr<StoredAnnotations> ReadAll(SqliteDatabase& database, const std::string& file) {
  StoredAnnotations all;
  absl::StatusOr<SqliteStatement> rows =
      database.Prepare("SELECT * FROM annotations ORDER BY created_unix_ns, id");
  if (!rows.ok()) return rows.status();
  for (;;) {
    const absl::StatusOr<bool> row = rows->Step();
    if (!row.ok()) return row.status();
    if (!*row) break;
    std::optional<StoredAnnotation> stored = ReadRow(*rows);
    const std::string picture = rows->Text(25);
    if (stored) {
      absl::StatusOr<bool> whole = ReadParts(database, picture, stored->annotation);
      if (!whole.ok()) return whole.status();
      if (!*whole) stored.reset();
    }
    if (!stored) {
      return absl::DataLossError(absl::StrCat(file, ": the row of annotation '", rows->Text(0),
                                              "' makes no sense; remove it with: sqlite3 ", file,
                                              " \"DELETE FROM annotations WHERE id='",
                                              rows->Text(0), "'\""));
    }
    all.annotations.push_back(*std::move(stored));
  }
  const absl::StatusOr<std::uint32_t> last_pin = ReadLastPin(database);
  if (!last_pin.ok()) return last_pin.status();
  all.last_pin = *last_pin;
  const std::string prune = absl::StrCat(
      "DELETE FROM audit WHERE number <= (SELECT max(number) FROM audit) - ", kKeptAudit);
  if (absl::Status status = database.Execute(prune.c_str()); !status.ok()) return status;
  const std::string newest = absl::StrCat(
      "SELECT request_id, annotation_id FROM audit WHERE request_id <> '' ORDER BY number DESC "
      "LIMIT ",
      kKeptRequests);
  absl::StatusOr<SqliteStatement> requests = database.Prepare(newest.c_str());
  if (!requests.ok()) return requests.status();
  for (;;) {
    const absl::StatusOr<bool> row = requests->Step();
    if (!row.ok()) return row.status();
    if (!*row) break;
    all.requests.push_back({requests->Text(0), requests->Text(1)});
  }
  std::reverse(all.requests.begin(), all.requests.end());
  return all;
}

}  // namespace saccade
