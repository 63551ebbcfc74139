#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/identity/access_book.hpp"
#include "server/store/sqlite.hpp"

namespace saccade {

/// As they are kept: with the hash of the secret.
struct InviteRow {
  InviteFacts facts;
  std::string secret_sha256;
};
enum class PassState { kIn = 0, kWaiting = 1, kRefused = 2 };  // as they are kept
struct PassRow {
  std::string id, invite_id, secret_sha256;
  std::string display_name;  // of the waiting room
  std::int64_t since_unix_s = 0;
  PassState state = PassState::kIn;
  // Of who signed in:
  std::int64_t expires_unix_s = 0;  // 0: with its invite
  std::string proof_sha256{};       // of the token that was shown; empty: none
};

/// DIR/access.sqlite. One thread at a time.
class AccessRows {
 public:
  /// Creates it if absent, for its owner alone. Errors as AnnotationStore::Open.
  static absl::StatusOr<std::unique_ptr<AccessRows>> Open(const std::filesystem::path& directory);

  /// Both empty at first. Forgets what ended before `forget_before_unix_s`.
  absl::Status Load(std::int64_t forget_before_unix_s, std::vector<InviteRow>& invites,
                    std::vector<PassRow>& passes);
  // On the disk when they return.
  absl::Status Put(const InviteRow& invite);
  absl::Status Put(const InviteRow& invite, const PassRow& pass);  // both or neither
  absl::Status Put(const PassRow& pass);
  /// Keeps `person`, and forgets the passes that they have.
  absl::Status EndPasses(const InviteRow& person);
  absl::Status Put(const std::vector<AuditFacts>& entries);  // likewise

  /// The newest `most`, oldest first.
  absl::StatusOr<std::vector<AuditFacts>> ReadAudit(int most);

 private:
  explicit AccessRows(std::unique_ptr<SqliteDatabase> database) : database_(std::move(database)) {}
  absl::Status Write(const InviteRow& invite);
  absl::Status Write(const PassRow& pass);
  absl::Status Write(const AuditFacts& entry);
  absl::Status PruneAudit();
  absl::Status DeletePasses(const std::string& invite_id, std::int64_t before_unix_s);
  template <typename WriteAll>
  absl::Status InTransaction(WriteAll write_all);

  std::unique_ptr<SqliteDatabase> database_;
  std::size_t since_pruned_ = 0;  // entries of the audit
};

}  // namespace saccade
