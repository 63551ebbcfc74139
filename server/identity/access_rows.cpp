#include "server/identity/access_rows.hpp"

#include <absl/strings/str_cat.h>

#include <utility>

#include "server/store/store_files.hpp"

namespace saccade {
namespace {

namespace fs = std::filesystem;

constexpr int kVersion = 1;
constexpr const char* kTables = R"(
CREATE TABLE invites(
  id TEXT PRIMARY KEY, secret_sha256 TEXT NOT NULL, role TEXT NOT NULL, label TEXT NOT NULL,
  created_unix_s INTEGER NOT NULL, expires_unix_s INTEGER NOT NULL, uses INTEGER NOT NULL,
  used INTEGER NOT NULL, revoked INTEGER NOT NULL) STRICT;
CREATE TABLE passes(
  id TEXT PRIMARY KEY, invite_id TEXT NOT NULL REFERENCES invites(id) ON DELETE CASCADE,
  secret_sha256 TEXT NOT NULL) STRICT;
PRAGMA user_version = 1;
)";

absl::Status Prepare(SqliteDatabase& database, const fs::path& file) {
  for (const char* pragma : {"PRAGMA busy_timeout = 2000", "PRAGMA journal_mode = WAL",
                             "PRAGMA synchronous = FULL", "PRAGMA foreign_keys = ON"}) {
    if (absl::Status set = database.Execute(pragma); !set.ok()) return set;
  }
  const absl::StatusOr<std::string> version = database.Query("PRAGMA user_version");
  if (!version.ok()) return version.status();
  if (*version == "0") {
    return database.Execute(absl::StrCat("BEGIN IMMEDIATE;", kTables, "COMMIT").c_str());
  }
  if (*version == absl::StrCat(kVersion)) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat(file.string(), " was written by another version (schema ", *version,
                   "); update this program, or move the file away: every invite ends then"));
}

InviteRow ReadInvite(const SqliteStatement& row) {
  InviteRow invite;
  invite.facts.id = row.Text(0);
  invite.secret_sha256 = row.Text(1);
  invite.facts.role = AccessRoleOf(row.Text(2));
  invite.facts.label = row.Text(3);
  invite.facts.created_unix_s = row.Int(4);
  invite.facts.expires_unix_s = row.Int(5);
  invite.facts.uses = static_cast<int>(row.Int(6));
  invite.facts.used = static_cast<int>(row.Int(7));
  invite.facts.revoked = row.Int(8) != 0;
  return invite;
}

}  // namespace

absl::StatusOr<std::unique_ptr<AccessRows>> AccessRows::Open(const fs::path& directory) {
  if (absl::Status ready = PrepareDirectory(directory); !ready.ok()) return ready;
  const fs::path file = directory / "access.sqlite";
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
    if (absl::Status made = CreatePrivate(file); !made.ok()) return made;
  }
  absl::StatusOr<std::unique_ptr<SqliteDatabase>> database = SqliteDatabase::Open(file);
  if (!database.ok()) return database.status();
  if (absl::Status ready = Prepare(**database, file); !ready.ok()) return ready;
  return std::unique_ptr<AccessRows>(new AccessRows(*std::move(database)));
}

absl::Status AccessRows::Load(std::int64_t forget_before_unix_s, std::vector<InviteRow>& invites,
                              std::vector<PassRow>& passes) {
  const std::string forget =
      absl::StrCat("DELETE FROM invites WHERE expires_unix_s < ", forget_before_unix_s);
  if (absl::Status done = database_->Execute(forget.c_str()); !done.ok()) return done;
  absl::StatusOr<SqliteStatement> all = database_->Prepare("SELECT * FROM invites");
  if (!all.ok()) return all.status();
  for (;;) {
    const absl::StatusOr<bool> row = all->Step();
    if (!row.ok()) return row.status();
    if (!*row) break;
    invites.push_back(ReadInvite(*all));
  }
  absl::StatusOr<SqliteStatement> rest = database_->Prepare("SELECT * FROM passes");
  if (!rest.ok()) return rest.status();
  for (;;) {
    const absl::StatusOr<bool> row = rest->Step();
    if (!row.ok()) return row.status();
    if (!*row) return absl::OkStatus();
    passes.push_back({rest->Text(0), rest->Text(1), rest->Text(2)});
  }
}

absl::Status AccessRows::Write(const InviteRow& invite) {
  // No REPLACE: it would delete the row, and its passes with it.
  absl::StatusOr<SqliteStatement> statement = database_->Prepare(
      "INSERT INTO invites VALUES(?,?,?,?,?,?,?,?,?) "
      "ON CONFLICT(id) DO UPDATE SET used = excluded.used, revoked = excluded.revoked");
  if (!statement.ok()) return statement.status();
  const InviteFacts& facts = invite.facts;
  statement->Bind(0, std::string_view(facts.id));
  statement->Bind(1, std::string_view(invite.secret_sha256));
  const absl::string_view role = Word(facts.role);
  statement->Bind(2, std::string_view(role.data(), role.size()));
  statement->Bind(3, std::string_view(facts.label));
  statement->Bind(4, facts.created_unix_s);
  statement->Bind(5, facts.expires_unix_s);
  statement->Bind(6, static_cast<std::int64_t>(facts.uses));
  statement->Bind(7, static_cast<std::int64_t>(facts.used));
  statement->Bind(8, static_cast<std::int64_t>(facts.revoked ? 1 : 0));
  return statement->Run();
}

absl::Status AccessRows::Write(const PassRow& pass) {
  absl::StatusOr<SqliteStatement> statement =
      database_->Prepare("INSERT INTO passes VALUES(?,?,?)");
  if (!statement.ok()) return statement.status();
  statement->Bind(0, std::string_view(pass.id));
  statement->Bind(1, std::string_view(pass.invite_id));
  statement->Bind(2, std::string_view(pass.secret_sha256));
  return statement->Run();
}

absl::Status AccessRows::Put(const InviteRow& invite) { return Write(invite); }

absl::Status AccessRows::Put(const InviteRow& invite, const PassRow& pass) {
  absl::Status status = database_->Execute("BEGIN IMMEDIATE");
  if (status.ok()) status = Write(invite);
  if (status.ok()) status = Write(pass);
  if (status.ok()) status = database_->Execute("COMMIT");
  if (!status.ok() && database_->InTransaction()) database_->Execute("ROLLBACK").IgnoreError();
  return status;
}

}  // namespace saccade
