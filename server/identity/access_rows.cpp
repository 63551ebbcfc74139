#include "server/identity/access_rows.hpp"

#include <absl/strings/str_cat.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "server/store/store_files.hpp"

namespace saccade {
namespace {

namespace fs = std::filesystem;

constexpr int kVersion = 3;
constexpr int kKeptAudit = 100'000;  // rows
constexpr std::int64_t kOld_s = 600;
constexpr std::size_t kPruneAfter = 1000;  // entries written
constexpr const char* kTables = R"(
CREATE TABLE invites(
  id TEXT PRIMARY KEY, secret_sha256 TEXT NOT NULL, role TEXT NOT NULL, label TEXT NOT NULL,
  created_unix_s INTEGER NOT NULL, expires_unix_s INTEGER NOT NULL, uses INTEGER NOT NULL,
  used INTEGER NOT NULL, revoked INTEGER NOT NULL, waits INTEGER NOT NULL DEFAULT 0) STRICT;
CREATE TABLE passes(
  id TEXT PRIMARY KEY, invite_id TEXT NOT NULL REFERENCES invites(id) ON DELETE CASCADE,
  secret_sha256 TEXT NOT NULL, display_name TEXT NOT NULL DEFAULT '',
  since_unix_s INTEGER NOT NULL DEFAULT 0, state INTEGER NOT NULL DEFAULT 0,
  expires_unix_s INTEGER NOT NULL DEFAULT 0, proof_sha256 TEXT NOT NULL DEFAULT '') STRICT;
CREATE TABLE audit(
  number INTEGER PRIMARY KEY AUTOINCREMENT, unix_ms INTEGER NOT NULL, participant_id TEXT NOT NULL,
  display_name TEXT NOT NULL, access_id TEXT NOT NULL, invite_id TEXT NOT NULL, call TEXT NOT NULL,
  outcome TEXT NOT NULL) STRICT;
PRAGMA user_version = 3;
)";
// From version 1, which had no waiting room.
constexpr const char* kFrom1 = R"(
ALTER TABLE invites ADD COLUMN waits INTEGER NOT NULL DEFAULT 0;
ALTER TABLE passes ADD COLUMN display_name TEXT NOT NULL DEFAULT '';
ALTER TABLE passes ADD COLUMN since_unix_s INTEGER NOT NULL DEFAULT 0;
ALTER TABLE passes ADD COLUMN state INTEGER NOT NULL DEFAULT 0;
PRAGMA user_version = 2;
)";
// From version 2, in which nobody signed in.
constexpr const char* kFrom2 = R"(
ALTER TABLE passes ADD COLUMN expires_unix_s INTEGER NOT NULL DEFAULT 0;
ALTER TABLE passes ADD COLUMN proof_sha256 TEXT NOT NULL DEFAULT '';
PRAGMA user_version = 3;
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
  if (*version == "1") {
    return database.Execute(absl::StrCat("BEGIN IMMEDIATE;", kFrom1, kFrom2, "COMMIT").c_str());
  }
  if (*version == "2") {
    return database.Execute(absl::StrCat("BEGIN IMMEDIATE;", kFrom2, "COMMIT").c_str());
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
  invite.facts.waits = row.Int(9) != 0;
  invite.facts.person = !invite.facts.id.empty() && invite.facts.id.front() == 's';
  return invite;
}

absl::Status CheckOurs(const fs::path& path) {
  struct stat facts {};
  if (::stat(path.c_str(), &facts) != 0) return absl::OkStatus();  // it is made, as ours
  if (facts.st_uid == ::geteuid() && (facts.st_mode & 022) == 0) return absl::OkStatus();
  return absl::PermissionDeniedError(
      absl::StrCat(path.string(),
                   ": other accounts of this machine can change it, and with it who is let in; "
                   "take it over (chown, chmod go-w), or choose another --data-dir"));
}

}  // namespace

absl::StatusOr<std::unique_ptr<AccessRows>> AccessRows::Open(const fs::path& directory) {
  if (absl::Status ready = PrepareDirectory(directory); !ready.ok()) return ready;
  const fs::path file = directory / "access.sqlite";
  // Who may write there makes invites of his own.
  for (const fs::path& path : {directory, file}) {
    if (absl::Status ours = CheckOurs(path); !ours.ok()) return ours;
  }
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
  // People who are barred stay so.
  const std::string forget =
      absl::StrCat("DELETE FROM invites WHERE expires_unix_s < ", forget_before_unix_s,
                   " AND NOT (revoked AND id GLOB 's*')");
  if (absl::Status done = database_->Execute(forget.c_str()); !done.ok()) return done;
  if (absl::Status done = PruneAudit(); !done.ok()) return done;
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
    passes.push_back({rest->Text(0), rest->Text(1), rest->Text(2), rest->Text(3), rest->Int(4),
                      static_cast<PassState>(rest->Int(5)), rest->Int(6), rest->Text(7)});
  }
}

absl::Status AccessRows::Write(const InviteRow& invite) {
  // No REPLACE: it would delete the row, and its passes with it.
  absl::StatusOr<SqliteStatement> statement = database_->Prepare(
      "INSERT INTO invites VALUES(?,?,?,?,?,?,?,?,?,?) "
      "ON CONFLICT(id) DO UPDATE SET used = excluded.used, revoked = excluded.revoked, "
      "uses = excluded.uses, role = excluded.role, label = excluded.label, "
      "expires_unix_s = excluded.expires_unix_s, waits = excluded.waits");
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
  statement->Bind(9, static_cast<std::int64_t>(facts.waits ? 1 : 0));
  return statement->Run();
}

absl::Status AccessRows::Write(const PassRow& pass) {
  absl::StatusOr<SqliteStatement> statement = database_->Prepare(
      "INSERT INTO passes VALUES(?,?,?,?,?,?,?,?) "
      "ON CONFLICT(id) DO UPDATE SET state = excluded.state");
  if (!statement.ok()) return statement.status();
  statement->Bind(0, std::string_view(pass.id));
  statement->Bind(1, std::string_view(pass.invite_id));
  statement->Bind(2, std::string_view(pass.secret_sha256));
  statement->Bind(3, std::string_view(pass.display_name));
  statement->Bind(4, pass.since_unix_s);
  statement->Bind(5, static_cast<std::int64_t>(pass.state));
  statement->Bind(6, pass.expires_unix_s);
  statement->Bind(7, std::string_view(pass.proof_sha256));
  return statement->Run();
}

absl::Status AccessRows::Write(const AuditFacts& entry) {
  absl::StatusOr<SqliteStatement> statement = database_->Prepare(
      "INSERT INTO audit(unix_ms, participant_id, display_name, access_id, invite_id, call, "
      "outcome) "
      "VALUES(?,?,?,?,?,?,?)");
  if (!statement.ok()) return statement.status();
  statement->Bind(0, entry.unix_ms);
  int parameter = 0;
  for (const std::string* text : {&entry.participant_id, &entry.display_name, &entry.access_id,
                                  &entry.invite_id, &entry.call, &entry.outcome}) {
    statement->Bind(++parameter, std::string_view(*text));
  }
  return statement->Run();
}

template <typename WriteAll>
absl::Status AccessRows::InTransaction(WriteAll write_all) {
  absl::Status status = database_->Execute("BEGIN IMMEDIATE");
  if (status.ok()) status = write_all();
  if (status.ok()) status = database_->Execute("COMMIT");
  if (!status.ok() && database_->InTransaction()) database_->Execute("ROLLBACK").IgnoreError();
  return status;
}

absl::Status AccessRows::Put(const InviteRow& invite) { return Write(invite); }
absl::Status AccessRows::Put(const PassRow& pass) { return Write(pass); }

absl::Status AccessRows::Put(const InviteRow& invite, const PassRow& pass) {
  return InTransaction([&] {
    absl::Status status = Write(invite);
    // Of who signs in again and again: those whose token is too old to be shown once more.
    if (status.ok() && invite.facts.person) {
      status = DeletePasses(invite.facts.id, pass.since_unix_s - kOld_s);
    }
    return status.ok() ? Write(pass) : status;
  });
}

absl::Status AccessRows::EndPasses(const InviteRow& person) {
  return InTransaction([&] {
    const absl::Status status = Write(person);
    return status.ok() ? DeletePasses(person.facts.id, std::numeric_limits<std::int64_t>::max())
                       : status;
  });
}

absl::Status AccessRows::DeletePasses(const std::string& invite_id, std::int64_t before_unix_s) {
  absl::StatusOr<SqliteStatement> statement =
      database_->Prepare("DELETE FROM passes WHERE invite_id = ? AND expires_unix_s < ?");
  if (!statement.ok()) return statement.status();
  statement->Bind(0, std::string_view(invite_id));
  statement->Bind(1, before_unix_s);
  return statement->Run();
}

absl::Status AccessRows::Put(const std::vector<AuditFacts>& entries) {
  since_pruned_ += entries.size();
  const bool prune = since_pruned_ >= kPruneAfter;
  if (prune) since_pruned_ = 0;
  return InTransaction([&] {
    absl::Status status;
    for (auto entry = entries.begin(); status.ok() && entry != entries.end(); ++entry) {
      status = Write(*entry);
    }
    return status.ok() && prune ? PruneAudit() : status;
  });
}

absl::Status AccessRows::PruneAudit() {
  return database_->Execute(
      absl::StrCat("DELETE FROM audit WHERE number <= (SELECT max(number) FROM audit) - ",
                   kKeptAudit)
          .c_str());
}

absl::StatusOr<std::vector<AuditFacts>> AccessRows::ReadAudit(int most) {
  absl::StatusOr<SqliteStatement> rows = database_->Prepare(
      "SELECT unix_ms, participant_id, display_name, access_id, invite_id, call, outcome "
      "FROM audit ORDER BY number DESC LIMIT ?");
  if (!rows.ok()) return rows.status();
  rows->Bind(0, static_cast<std::int64_t>(most));
  std::vector<AuditFacts> all;
  for (;;) {
    const absl::StatusOr<bool> row = rows->Step();
    if (!row.ok()) return row.status();
    if (!*row) break;
    all.push_back({rows->Int(0), rows->Text(1), rows->Text(2), rows->Text(3), rows->Text(4),
                   rows->Text(5), rows->Text(6)});
  }
  std::reverse(all.begin(), all.end());
  return all;
}

}  // namespace saccade
