#include "server/store/sqlite.hpp"

#include <absl/strings/str_cat.h>
#include <sqlite3.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace saccade {

SqliteStatement::SqliteStatement(SqliteStatement&& other) noexcept
    : statement_(std::exchange(other.statement_, nullptr)), database_(other.database_) {}

SqliteStatement::~SqliteStatement() { sqlite3_finalize(statement_); }

void SqliteStatement::Bind(int parameter, std::int64_t value) {
  sqlite3_bind_int64(statement_, parameter + 1, value);
}
void SqliteStatement::Bind(int parameter, double value) {
  sqlite3_bind_double(statement_, parameter + 1, value);
}
void SqliteStatement::Bind(int parameter, std::string_view text) {
  // A null pointer would bind NULL.
  const char* data = text.empty() ? "" : text.data();
  sqlite3_bind_text(statement_, parameter + 1, data, static_cast<int>(text.size()),
                    SQLITE_TRANSIENT);
}
void SqliteStatement::Bind(int parameter, const std::vector<double>& numbers) {
  const void* data = numbers.empty() ? static_cast<const void*>("") : numbers.data();
  sqlite3_bind_blob(statement_, parameter + 1, data,
                    static_cast<int>(numbers.size() * sizeof(double)), SQLITE_TRANSIENT);
}
void SqliteStatement::BindBytes(int parameter, std::string_view bytes) {
  sqlite3_bind_blob(statement_, parameter + 1, bytes.empty() ? "" : bytes.data(),
                    static_cast<int>(bytes.size()), SQLITE_TRANSIENT);
}

absl::StatusOr<bool> SqliteStatement::Step() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  absl::Status status = database_->Error(code);
  sqlite3_reset(statement_);
  return status;
}

absl::Status SqliteStatement::Run() {
  for (;;) {
    const absl::StatusOr<bool> row = Step();
    if (!row.ok()) return row.status();
    if (!*row) break;
  }
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
  return absl::OkStatus();
}

std::int64_t SqliteStatement::Int(int column) const {
  return sqlite3_column_int64(statement_, column);
}
double SqliteStatement::Double(int column) const {
  return sqlite3_column_double(statement_, column);
}
std::string SqliteStatement::Text(int column) const {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
  return text ? std::string(text, sqlite3_column_bytes(statement_, column)) : std::string();
}
std::vector<double> SqliteStatement::Numbers(int column) const {
  const void* data = sqlite3_column_blob(statement_, column);
  std::vector<double> numbers(sqlite3_column_bytes(statement_, column) / sizeof(double));
  if (!numbers.empty()) std::memcpy(numbers.data(), data, numbers.size() * sizeof(double));
  return numbers;
}
std::string SqliteStatement::Bytes(int column) const {
  const auto* data = static_cast<const char*>(sqlite3_column_blob(statement_, column));
  return data ? std::string(data, sqlite3_column_bytes(statement_, column)) : std::string();
}

absl::StatusOr<std::unique_ptr<SqliteDatabase>> SqliteDatabase::Open(
    const std::filesystem::path& file) {
  sqlite3* db = nullptr;
  const int code =
      sqlite3_open_v2(file.c_str(), &db,
                      SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX, nullptr);
  // Even a failed open may leave a handle, which knows the reason.
  std::unique_ptr<SqliteDatabase> database(new SqliteDatabase(db, file));
  if (code != SQLITE_OK) return database->Error(code);
  sqlite3_extended_result_codes(db, 1);
  return database;
}

SqliteDatabase::~SqliteDatabase() { sqlite3_close_v2(db_); }

absl::Status SqliteDatabase::Execute(const char* sql) {
  const int code = sqlite3_exec(db_, sql, nullptr, nullptr, nullptr);
  return code == SQLITE_OK ? absl::OkStatus() : Error(code);
}

absl::StatusOr<SqliteStatement> SqliteDatabase::Prepare(const char* sql) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v2(db_, sql, -1, &statement, nullptr);
  if (code != SQLITE_OK) return Error(code);
  return SqliteStatement(statement, this);
}

absl::StatusOr<std::string> SqliteDatabase::Query(const char* sql) {
  absl::StatusOr<SqliteStatement> statement = Prepare(sql);
  if (!statement.ok()) return statement.status();
  const absl::StatusOr<bool> row = statement->Step();
  if (!row.ok()) return row.status();
  if (!*row) return absl::NotFoundError(absl::StrCat("no row: ", sql));
  return statement->Text(0);
}

absl::Status SqliteDatabase::CopyInto(const std::filesystem::path& file) {
  absl::StatusOr<SqliteStatement> copy = Prepare("VACUUM INTO ?");
  if (!copy.ok()) return copy.status();
  copy->Bind(0, std::string_view(file.native()));
  return copy->Run();
}

void SqliteDatabase::KeepFilesOnClose() {
  int keep = 1;
  sqlite3_file_control(db_, "main", SQLITE_FCNTL_PERSIST_WAL, &keep);
}

bool SqliteDatabase::InTransaction() const { return sqlite3_get_autocommit(db_) == 0; }

absl::Status SqliteDatabase::Error(int code) const {
  const std::string what =
      absl::StrCat(file_.string(), ": ", db_ ? sqlite3_errmsg(db_) : sqlite3_errstr(code));
  const int system_error = db_ ? sqlite3_system_errno(db_) : 0;
  const int primary = code & 0xff;
  const bool no_room = primary == SQLITE_FULL || code == SQLITE_IOERR_SHMSIZE ||
                       ((primary == SQLITE_IOERR || primary == SQLITE_CANTOPEN) &&
                        (system_error == ENOSPC || system_error == EDQUOT));
  if (no_room) {
    return absl::ResourceExhaustedError(
        absl::StrCat(what, "; the disk is full: make room and try again"));
  }
  switch (primary) {
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
    case SQLITE_AUTH:
      return absl::PermissionDeniedError(absl::StrCat(
          what, "; make the directory and the file writable or choose another --data-dir"));
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return absl::DataLossError(
          absl::StrCat(what, "; move the file away, or salvage it with: sqlite3 FILE .recover"));
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return absl::FailedPreconditionError(
          absl::StrCat(what, "; another process holds it: end that one first"));
    default:
      return absl::InternalError(absl::StrCat(what, " (SQLite code ", code, ")"));
  }
}

}  // namespace saccade
