#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "saccade/v1/session.pb.h"
#include "server/identity/access.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

struct Session {
  std::string id;              // UUID; the credential: for no log and nobody else
  std::string participant_id;  // UUID; what others know it by
  std::string display_name;
  v1::Role role = v1::ROLE_EXPERT;
  std::string access_id;  // of the token that joined (Access::id); no other may use the session
  std::string person_id;  // UUID; public: who stands behind it, in this session and others
  bool has_key = false;   // the person can come back in another session
  std::uint32_t color_rgba = 0;  // the person's
  std::string invite_id;         // of whom that token came (Access::invite_id)
};

/// One line that goes into others' lists and into the log. InvalidArgument: too long, or it holds a
/// break or a mark that turns text about.
absl::Status CheckDisplayName(const std::string& name);

struct SessionTableOptions {
  std::size_t max_sessions = 1000;
  std::size_t max_sessions_of_token = 32;    // 0: no limit; where there are no tokens there is none
  std::size_t max_sessions_of_invite = 128;  // of all that came by one invite together; likewise
  // Where the table is full, these make room, and only these: who works is never put out by who
  // joins.
  Timestamp unused_ns = 5'000'000'000;  // joined so long ago, and never heard of again
  Timestamp idle_ns = 600'000'000'000;  // without a stream, and silent for so long
};

/// Who joined. Bounded. Thread safe.
class SessionTable {
 public:
  /// Told of each session that goes and was used, so that what is kept for it elsewhere goes too;
  /// false: not now, and it is told again with the next one. Called from Join(); must not block or
  /// call back.
  using OnGone = std::function<bool(const Session& session)>;

  explicit SessionTable(const SessionTableOptions& options = {}, OnGone on_gone = nullptr)
      : options_(options), on_gone_(std::move(on_gone)) {}

  /// Makes a session, or goes on with `request.resume_session_id` if there is one of that id and
  /// token. Its role is what was asked for, as far as `access` reaches: who may not be the wearer
  /// is an expert, and who may only look a viewer. The person is the one of `request.person_key`;
  /// without a key the one of the resumed session, or a new one.
  ///   InvalidArgument    names the field
  ///   ResourceExhausted  the table is full of sessions in use
  absl::StatusOr<Session> Join(const v1::JoinRequest& request, Timestamp now_ns = MonotonicNow(),
                               const Access& access = {});

  /// NotFound: never joined, or before this server started. Counts as use.
  absl::StatusOr<Session> Find(const std::string& session_id, Timestamp now_ns = MonotonicNow());

  /// As Find; PermissionDenied for those who may only look.
  absl::StatusOr<Session> FindEditor(const std::string& session_id,
                                     Timestamp now_ns = MonotonicNow());

  /// Ends every session of these tokens.
  void End(const std::vector<std::string>& access_ids);

  /// What Find answers to who names a session that is not there.
  static absl::Status UnknownSession();

  /// While what is returned lives (a stream), the session stays. It must not outlive the table.
  std::shared_ptr<void> Hold(const std::string& session_id);

 private:
  struct Slot {
    Session session;
    Timestamp used_ns = 0;
    bool used = false;  // beyond Join
    int holds = 0;
  };
  bool MakeRoom(Timestamp now_ns);
  absl::Status CheckOwn(std::string Session::*owner, const std::string& id, std::size_t most,
                        Timestamp now_ns);
  void Release(const std::string& session_id);
  void TellGone();
  void Identify(const std::string& key, Timestamp now_ns, Session& session);

  const SessionTableOptions options_;
  const OnGone on_gone_;
  std::mutex mutex_;
  std::vector<Session> gone_;                               // not told yet
  absl::flat_hash_map<std::string, std::uint32_t> colors_;  // by person
  absl::flat_hash_map<std::string, Slot> sessions_;
};

}  // namespace saccade
