#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

namespace saccade {

/// A prepared statement; columns and parameters count from 0.
class SqliteStatement {
 public:
  SqliteStatement(sqlite3_stmt* statement, const class SqliteDatabase* database)
      : statement_(statement), database_(database) {}
  SqliteStatement(SqliteStatement&& other) noexcept;
  SqliteStatement& operator=(SqliteStatement&&) = delete;
  ~SqliteStatement();

  void Bind(int parameter, std::int64_t value);
  void Bind(int parameter, double value);
  void Bind(int parameter, std::string_view text);
  void Bind(int parameter, const std::vector<double>& numbers);  // as a blob, little endian
  void BindBytes(int parameter, std::string_view bytes);         // as a blob

  /// True if there is a row, false at the end.
  absl::StatusOr<bool> Step();
  /// Runs to the end, ignoring rows, and makes the statement ready to be used again.
  absl::Status Run();

  std::int64_t Int(int column) const;
  double Double(int column) const;
  std::string Text(int column) const;
  std::vector<double> Numbers(int column) const;
  std::string Bytes(int column) const;

 private:
  sqlite3_stmt* statement_;
  const SqliteDatabase* database_;
};

/// One connection. Errors name the file and the remedy:
///   ResourceExhausted   disk full, or the file's size limit reached
///   PermissionDenied    read-only or not accessible
///   DataLoss            damaged, or not a database
///   FailedPrecondition  locked by another process
///   Internal            anything else, with SQLite's own words
class SqliteDatabase {
 public:
  static absl::StatusOr<std::unique_ptr<SqliteDatabase>> Open(const std::filesystem::path& file);
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;
  ~SqliteDatabase();

  absl::Status Execute(const char* sql);
  absl::StatusOr<SqliteStatement> Prepare(const char* sql);
  /// First column of the first row; NotFound if there is none.
  absl::StatusOr<std::string> Query(const char* sql);

  /// The last error of this connection as a status.
  absl::Status Error(int code) const;
  bool InTransaction() const;

  /// Writes all that this connection sees into `file`, which is empty. Outside a transaction.
  absl::Status CopyInto(const std::filesystem::path& file);
  /// Closing would delete the log and its index by their names, whosever they are by then.
  void KeepFilesOnClose();

 private:
  SqliteDatabase(sqlite3* db, std::filesystem::path file) : db_(db), file_(std::move(file)) {}

  sqlite3* db_;
  std::filesystem::path file_;
};

}  // namespace saccade
