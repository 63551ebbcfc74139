#include "server/rpc/session_table.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <random>

#include "shared/wire/from_proto.hpp"

namespace saccade {
namespace {

// RFC 4122 version 4, from the system's entropy.
std::string NewUuid() {
  std::random_device entropy;
  const std::uint32_t a = entropy(), b = entropy(), c = entropy(), d = entropy();
  return absl::StrFormat("%08x-%04x-4%03x-%04x-%04x%08x", a, b >> 16, b & 0xfff,
                         0x8000 | (c >> 16 & 0x3fff), c & 0xffff, d);
}

}  // namespace

absl::StatusOr<Session> SessionTable::Join(const v1::JoinRequest& request) {
  absl::Status name = wire::CheckText(request.display_name(), wire::kMaxNameBytes, "display_name");
  if (!name.ok()) return name;
  if (!v1::Role_IsValid(request.role())) {
    return absl::InvalidArgumentError(
        absl::StrCat("role: unknown role ", static_cast<int>(request.role())));
  }
  Session session;
  session.id = NewUuid();
  session.participant_id = NewUuid();
  session.display_name = request.display_name().empty() ? "guest" : request.display_name();
  if (request.role() != v1::ROLE_UNSPECIFIED) session.role = request.role();
  const std::lock_guard lock(mutex_);
  MakeRoom();
  sessions_[session.id] = {session, MonotonicNow()};
  return session;
}

void SessionTable::MakeRoom() {
  if (sessions_.size() < max_sessions_) return;
  const auto oldest = std::min_element(
      sessions_.begin(), sessions_.end(),
      [](const auto& a, const auto& b) { return a.second.used_ns < b.second.used_ns; });
  gone_.push_back(oldest->second.session.participant_id);
  sessions_.erase(oldest);
  std::erase_if(gone_, [this](const std::string& id) { return !on_gone_ || on_gone_(id); });
}

absl::StatusOr<Session> SessionTable::Find(const std::string& session_id) {
  absl::Status uuid = wire::CheckUuid(session_id, "session_id");
  if (!uuid.ok()) return uuid;
  const std::lock_guard lock(mutex_);
  const auto at = sessions_.find(session_id);
  if (at == sessions_.end()) {
    return absl::NotFoundError("session_id: unknown to this server: call Join again");
  }
  at->second.used_ns = MonotonicNow();
  return at->second.session;
}

absl::StatusOr<Session> SessionTable::FindEditor(const std::string& session_id) {
  absl::StatusOr<Session> session = Find(session_id);
  if (session.ok() && session->role == v1::ROLE_VIEWER) {
    return absl::PermissionDeniedError("session_id: a viewer changes nothing: join as expert");
  }
  return session;
}

}  // namespace saccade
