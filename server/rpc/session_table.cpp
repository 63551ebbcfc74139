#include "server/rpc/session_table.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <random>

#include "server/pipeline/busy.hpp"
#include "server/rpc/persons.hpp"
#include "shared/wire/from_proto.hpp"

namespace saccade {
namespace {

constexpr std::size_t kKeptColors = 4096;
constexpr Timestamp kPresent = 60'000'000'000;  // so long after its last word, without a stream

// RFC 4122 version 4, from the system's entropy.
std::string NewUuid() {
  std::random_device entropy;
  const std::uint32_t a = entropy(), b = entropy(), c = entropy(), d = entropy();
  return absl::StrFormat("%08x-%04x-4%03x-%04x-%04x%08x", a, b >> 16, b & 0xfff,
                         0x8000 | (c >> 16 & 0x3fff), c & 0xffff, d);
}

v1::Role RoleWithin(v1::Role asked, AccessRole access) {
  if (access < AccessRole::kAnnotator) return v1::ROLE_VIEWER;
  if (asked == v1::ROLE_UNSPECIFIED) return v1::ROLE_EXPERT;
  return asked == v1::ROLE_WEARER && access < AccessRole::kWearer ? v1::ROLE_EXPERT : asked;
}

}  // namespace

absl::Status CheckDisplayName(const std::string& name) {
  absl::Status text = wire::CheckText(name, wire::kMaxNameBytes, "display_name");
  if (!text.ok()) return text;
  // Line and paragraph separators, marks and overrides of direction, as UTF-8.
  static constexpr absl::string_view kTurning[] = {"\xe2\x80\xa8", "\xe2\x80\xa9",
                                                   "\xe2\x80\x8e", "\xe2\x80\x8f",
                                                   "\xe2\x80\xaa", "\xe2\x80\xab",
                                                   "\xe2\x80\xac", "\xe2\x80\xad",
                                                   "\xe2\x80\xae", "\xe2\x81\xa6",
                                                   "\xe2\x81\xa7", "\xe2\x81\xa8",
                                                   "\xe2\x81\xa9", "\n"};
  for (const absl::string_view one : kTurning) {
    if (absl::StrContains(name, one)) {
      return absl::InvalidArgumentError(
          "display_name: holds a line break or a mark that turns text about: leave it out");
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<Session> SessionTable::Join(const v1::JoinRequest& request, Timestamp now_ns,
                                           const Access& access) {
  absl::Status name = CheckDisplayName(request.display_name());
  if (!name.ok()) return name;
  if (!v1::Role_IsValid(request.role())) {
    return absl::InvalidArgumentError(
        absl::StrCat("role: unknown role ", static_cast<int>(request.role())));
  }
  const std::string& resumed = request.resume_session_id();
  if (!resumed.empty()) {
    absl::Status uuid = wire::CheckUuid(resumed, "resume_session_id");
    if (!uuid.ok()) return uuid;
  }
  if (const std::string& key = request.person_key(); !key.empty()) {
    if (absl::Status good = CheckPersonKey(key); !good.ok()) return good;
  }
  Session session;
  session.display_name = request.display_name().empty() ? "guest" : request.display_name();
  if (!access.person.empty())
    session.display_name = access.person;  // who signed in is who they are
  session.role = RoleWithin(request.role(), access.role);
  session.access_id = access.id;
  session.invite_id = access.invite_id;
  const std::lock_guard lock(mutex_);
  const auto known = sessions_.find(resumed);
  if (known != sessions_.end() && known->second.session.access_id == access.id) {
    Slot& slot = known->second;
    session.id = slot.session.id;
    session.participant_id = slot.session.participant_id;
    session.person_id = slot.session.person_id;
    session.has_key = slot.session.has_key;
    Identify(request.person_key(), now_ns, session);
    if (session.person_id != slot.session.person_id) gone_.push_back(slot.session);
    slot.session = session;
    slot.used_ns = now_ns;
    slot.used = true;
    return session;
  }
  const absl::Status own =
      CheckOwn(&Session::access_id, access.id, options_.max_sessions_of_token, now_ns);
  if (!own.ok()) return own;
  const absl::Status all =
      CheckOwn(&Session::invite_id, access.invite_id, options_.max_sessions_of_invite, now_ns);
  if (!all.ok()) return all;
  if (!MakeRoom(now_ns)) {
    return BusyError(absl::StrCat("sessions: ", sessions_.size(), " are in use, as many as may be"),
                     options_.unused_ns);
  }
  session.id = NewUuid();
  session.participant_id = NewUuid();
  Identify(request.person_key(), now_ns, session);
  sessions_[session.id] = {session, now_ns};
  return session;
}

/// Who it is, and in which colour.
void SessionTable::Identify(const std::string& key, Timestamp now_ns, Session& session) {
  if (!key.empty()) {
    session.person_id = PersonIdOf(key);
    session.has_key = true;
  } else if (session.person_id.empty()) {
    session.person_id = NewUuid();
  }
  const auto had = colors_.find(session.person_id);
  if (had != colors_.end()) {
    session.color_rgba = had->second;
    return;
  }
  absl::flat_hash_map<std::string, std::uint32_t> in_use;
  for (const auto& [id, slot] : sessions_) {
    if (slot.holds == 0 && now_ns - slot.used_ns > kPresent) continue;
    in_use[slot.session.person_id] = slot.session.color_rgba;
  }
  if (colors_.size() >= kKeptColors) colors_ = in_use;
  session.color_rgba = colors_[session.person_id] = ChoosePersonColor(session.person_id, in_use);
}

// Of one's own sessions, or one's invite's, those that nobody uses make room.
absl::Status SessionTable::CheckOwn(std::string Session::*owner, const std::string& id,
                                    std::size_t most, Timestamp now_ns) {
  if (id.empty() || most == 0) return absl::OkStatus();
  std::size_t count = 0;
  auto oldest = sessions_.end();
  for (auto at = sessions_.begin(); at != sessions_.end(); ++at) {
    const Slot& slot = at->second;
    if (slot.session.*owner != id) continue;
    ++count;
    if (slot.holds > 0 || now_ns - slot.used_ns < options_.unused_ns) continue;
    if (oldest == sessions_.end() || slot.used_ns < oldest->second.used_ns) oldest = at;
  }
  if (count < most) return absl::OkStatus();
  if (oldest == sessions_.end()) {
    return BusyError(
        absl::StrCat("sessions: ", count, " of this invite are in use, as many as may"),
        options_.unused_ns);
  }
  if (oldest->second.used) gone_.push_back(oldest->second.session);
  sessions_.erase(oldest);
  TellGone();
  return absl::OkStatus();
}

// Who joined and did nothing goes first.
bool SessionTable::MakeRoom(Timestamp now_ns) {
  if (sessions_.size() < options_.max_sessions) return true;
  auto chosen = sessions_.end();
  for (auto at = sessions_.begin(); at != sessions_.end(); ++at) {
    const Slot& slot = at->second;
    const Timestamp silent_ns = now_ns - slot.used_ns;
    if (slot.holds > 0 || silent_ns < (slot.used ? options_.idle_ns : options_.unused_ns)) continue;
    const auto rank = [](const Slot& one) { return std::pair(one.used, one.used_ns); };
    if (chosen == sessions_.end() || rank(slot) < rank(chosen->second)) chosen = at;
  }
  if (chosen == sessions_.end()) return false;
  if (chosen->second.used) gone_.push_back(chosen->second.session);
  sessions_.erase(chosen);
  TellGone();
  return true;
}

void SessionTable::TellGone() {
  std::erase_if(gone_, [this](const Session& gone) { return !on_gone_ || on_gone_(gone); });
}

void SessionTable::End(const std::vector<std::string>& access_ids) {
  const std::lock_guard lock(mutex_);
  absl::erase_if(sessions_, [&](const auto& entry) {
    const Slot& slot = entry.second;
    const bool ends =
        std::find(access_ids.begin(), access_ids.end(), slot.session.access_id) != access_ids.end();
    if (ends && slot.used) gone_.push_back(slot.session);
    return ends;
  });
  TellGone();
}

absl::Status SessionTable::UnknownSession() {
  return absl::NotFoundError("session_id: unknown to this server: call Join again");
}

absl::StatusOr<Session> SessionTable::Find(const std::string& session_id, Timestamp now_ns) {
  absl::Status uuid = wire::CheckUuid(session_id, "session_id");
  if (!uuid.ok()) return uuid;
  const std::lock_guard lock(mutex_);
  const auto at = sessions_.find(session_id);
  if (at == sessions_.end()) {
    return UnknownSession();
  }
  at->second.used_ns = now_ns;
  at->second.used = true;
  return at->second.session;
}

absl::StatusOr<Session> SessionTable::FindEditor(const std::string& session_id, Timestamp now_ns) {
  absl::StatusOr<Session> session = Find(session_id, now_ns);
  if (session.ok() && session->role == v1::ROLE_VIEWER) {
    return absl::PermissionDeniedError("session_id: a viewer changes nothing: join as expert");
  }
  return session;
}

std::shared_ptr<void> SessionTable::Hold(const std::string& session_id) {
  const std::lock_guard lock(mutex_);
  const auto at = sessions_.find(session_id);
  if (at == sessions_.end()) return nullptr;
  ++at->second.holds;
  return {this, [this, session_id](void*) { Release(session_id); }};
}

void SessionTable::Release(const std::string& session_id) {
  const std::lock_guard lock(mutex_);
  const auto at = sessions_.find(session_id);
  if (at == sessions_.end()) return;
  --at->second.holds;
  at->second.used_ns = MonotonicNow();
}

}  // namespace saccade
