#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "saccade/v1/session.pb.h"
#include "shared/time/timestamp.hpp"

namespace saccade {

struct Session {
  std::string id;              // UUID; the credential: for no log and nobody else
  std::string participant_id;  // UUID; what others know it by
  std::string display_name;
  v1::Role role = v1::ROLE_EXPERT;
};

/// Who joined. Bounded: above `max_sessions` the one unused for longest goes. Thread safe.
class SessionTable {
 public:
  /// Told the participant_id of each session that goes, so that what is kept for it elsewhere goes
  /// too; false: not now, and it is told again with the next one. Called from Join(); must not
  /// block or call back.
  using OnGone = std::function<bool(const std::string& participant_id)>;

  explicit SessionTable(std::size_t max_sessions = 1000, OnGone on_gone = nullptr)
      : max_sessions_(max_sessions), on_gone_(std::move(on_gone)) {}

  /// InvalidArgument names the field.
  absl::StatusOr<Session> Join(const v1::JoinRequest& request);

  /// NotFound: never joined, or before this server started. Counts as use.
  absl::StatusOr<Session> Find(const std::string& session_id);

  /// As Find; PermissionDenied for those who may only look.
  absl::StatusOr<Session> FindEditor(const std::string& session_id);

 private:
  struct Slot {
    Session session;
    Timestamp used_ns = 0;
  };
  void MakeRoom();

  const std::size_t max_sessions_;
  const OnGone on_gone_;
  std::mutex mutex_;
  std::vector<std::string> gone_;  // not told yet
  absl::flat_hash_map<std::string, Slot> sessions_;
};

}  // namespace saccade
