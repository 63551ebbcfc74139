#include "server/store/annotation_rows.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

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

absl::Status Upsert(SqliteDatabase& database, const StoredAnnotation& stored) {
  absl::StatusOr<SqliteStatement> statement = database.Prepare(
      "INSERT OR REPLACE INTO annotations VALUES(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
  if (!statement.ok()) return statement.status();
  const Annotation& annotation = stored.annotation;
  const Anchor& anchor = annotation.anchor;
  std::vector<double> ink;
  ink.reserve(3 * annotation.ink_offset_m.size());
  for (const Eigen::Vector3d& offset : annotation.ink_offset_m) {
    ink.insert(ink.end(), {offset.x(), offset.y(), offset.z()});
  }
  const Eigen::Matrix3d& c = anchor.covariance_in_world;
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
  statement->Bind(13, std::vector<double>{c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2)});
  statement->Bind(14, ink);
  statement->Bind(15, stored.world_key);
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
      "INSERT INTO audit(unix_ns, session_id, action, annotation_id, request_id, description) "
      "VALUES(?,?,?,?,?,?)");
  if (!statement.ok()) return statement.status();
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  statement->Bind(0, static_cast<std::int64_t>(
                         std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()));
  statement->Bind(1, change.session_id);
  statement->Bind(2, std::string_view(ActionName(change.kind)));
  statement->Bind(3, change.id);
  statement->Bind(4, change.request_id);
  statement->Bind(5, change.description);
  return statement->Run();
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
  const auto finite = [](double number) { return std::isfinite(number); };
  const bool shape_known = row.Int(1) >= 0 && row.Int(1) <= 3;
  const bool method_known = row.Int(8) >= 0 && row.Int(8) <= 4;
  if (annotation.id.empty() || !shape_known || !method_known || c.size() != 6 ||
      ink.size() % 3 != 0 || !anchor.point_in_world.allFinite() || !(annotation.size_m > 0) ||
      !std::all_of(c.begin(), c.end(), finite) || !std::all_of(ink.begin(), ink.end(), finite)) {
    return std::nullopt;
  }
  annotation.shape = static_cast<AnnotationShape>(row.Int(1));
  anchor.method = static_cast<AnchorMethod>(row.Int(8));
  anchor.covariance_in_world << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  InkStroke::Points points;
  points.reserve(ink.size() / 3);
  for (std::size_t i = 0; i < ink.size(); i += 3) {
    points.emplace_back(ink[i], ink[i + 1], ink[i + 2]);
  }
  annotation.ink_offset_m = std::move(points);
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
  absl::Status status = change.after ? Upsert(database, *change.after) : Erase(database, change.id);
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
    if (!stored) {
      return absl::DataLossError(absl::StrCat(file, ": the row of annotation '", rows->Text(0),
                                              "' makes no sense; remove it with: sqlite3 ", file,
                                              " \"DELETE FROM annotations WHERE id='",
                                              rows->Text(0), "'\""));
    }
    all.annotations.push_back(*std::move(stored));
  }
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
