#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/identity/access.hpp"

namespace saccade {

/// Lets somebody in, so often and so long. What it is told by has no secret.
struct InviteFacts {
  std::string id;
  AccessRole role = AccessRole::kViewer;
  std::string label;
  std::int64_t created_unix_s = 0, expires_unix_s = 0;
  int uses = 1, used = 0;
  bool revoked = false;
  bool waits = false;  // who comes by it waits to be let in
  /// No invite, but somebody who signs in: `label` is their name, `used` how often they did.
  bool person = false;
};

/// Somebody whom the firm's provider vouches for (ID token).
struct SignedIn {
  std::string key;   // of the person, at this provider: 64 hexadecimal digits
  std::string name;  // one line of at most 60 bytes
  AccessRole role = AccessRole::kViewer;
  std::int64_t expires_unix_s = 0;
  std::string proof;  // of what was signed (SHA-256): taken once
};

struct InviteDraft {
  AccessRole role = AccessRole::kViewer;  // viewer to wearer
  std::int64_t life_s = 8 * 3600;         // 60 to 31'536'000
  int uses = 1;                           // 1 to 1000
  std::string label;                      // at most 60 bytes
  bool waits = false;                     // who comes by it waits to be let in
  /// InvalidArgument names the field.
  absl::Status Validate() const;
};

/// An invite or a pass with its token, told once.
struct Issued {
  InviteFacts invite;
  std::string token;
  bool waiting = false;  // of a pass: it opens nothing yet
};

/// Somebody who redeemed an invite that waits, and was not let in yet.
struct WaitingFacts {
  std::string id;  // of the pass
  std::string display_name;
  AccessRole role = AccessRole::kViewer;
  std::int64_t since_unix_s = 0;
  std::string invite_id, label;
};

/// What somebody did, or was refused.
struct AuditFacts {
  std::int64_t unix_ms = 0;
  std::string participant_id, display_name;  // empty: no session was named
  std::string access_id, invite_id;          // empty: no token; the invite is filled in by the book
  std::string call, outcome;                 // "AnnotationService/Create", "ok" or code and reason
};

/// Who may come in: invites, the passes that came of them, and the owner.
///
/// An invite is redeemed for a pass, which is one person's and ends with its invite. Of both, only
/// the SHA-256 of the secret is kept, in DIR/access.sqlite (0600). Checking a token reads memory
/// alone and compares in constant time; changes are answered after the commit, from the book's own
/// thread, which also hears when a pass expires. Thread safe.
class AccessBook {
 public:
  template <typename T>
  using Done = std::function<void(absl::StatusOr<T>)>;
  /// Passes that ended, by id, and why in words for who held them. From the book's thread.
  using OnEnded = std::function<void(const std::vector<std::string>&, const absl::Status&)>;
  using UnixClock = std::function<std::int64_t()>;  // s

  struct Options {
    bool waiting_room = false;    // every invite below the wearer's waits
    bool token_required = false;  // else who has no token may do what a wearer may
    UnixClock now_unix_s;         // null: the system's
    std::size_t max_invites = 10'000;
  };

  /// Opens or creates the file. Errors as AnnotationStore::Open.
  static absl::StatusOr<std::unique_ptr<AccessBook>> Open(const std::filesystem::path& directory,
                                                          Options options);
  /// Nothing is kept; every change is answered at once. For tests.
  static std::unique_ptr<AccessBook> InMemory(Options options);
  ~AccessBook();

  bool token_required() const;
  /// The owner's token: of this run of the server alone, never on the disk by this class.
  const std::string& owner_token() const;
  /// Before the first call.
  void SetOnEnded(OnEnded on_ended);

  /// Whose token this is. Unauthenticated says why not, with the remedy; without a token (empty):
  /// what everybody may, or the same error where one is required.
  absl::StatusOr<Access> Check(absl::string_view token) const;

  /// InvalidArgument: the draft; ResourceExhausted: too many invites.
  void CreateInvite(InviteDraft draft, Done<Issued> done);
  /// Unauthenticated: unknown, expired, revoked, or used up. `display_name` is for whom lets people
  /// in.
  void Redeem(std::string token, Done<Issued> done, std::string display_name = "");
  /// A pass for who signed in, which ends with the token; the newest sign-in says name and role.
  ///   Unauthenticated    that token was taken before, or the person was revoked
  ///   ResourceExhausted  too many at once
  void SignIn(SignedIn person, Done<Issued> done);
  /// Who waits; who came first, first.
  std::vector<WaitingFacts> Waiting() const;
  /// Lets somebody in, or ends their pass. NotFound: nobody of that id waits.
  void Admit(std::string id, bool refuse, Done<WaitingFacts> done);
  /// How many passes ended with it. NotFound: no such invite. A person stays out until LetBack.
  void Revoke(std::string invite_id, Done<int> done);
  /// A person who was revoked may sign in again. NotFound; InvalidArgument: it is an invite.
  void LetBack(std::string id, Done<int> done);
  /// Newest first.
  std::vector<InviteFacts> Invites() const;

  /// Keeps what somebody did, within half a second; never waits. Of more than a thousand at once
  /// the rest is counted. Kept where invites are: nothing in memory alone.
  void Record(AuditFacts entry);
  /// The newest `most`, oldest first.
  void ReadAudit(int most, Done<std::vector<AuditFacts>> done);

 private:
  class Impl;
  explicit AccessBook(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace saccade
