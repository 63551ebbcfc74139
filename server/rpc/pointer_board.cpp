#include "server/rpc/pointer_board.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "server/pipeline/busy.hpp"
#include "shared/scene/limits.hpp"

namespace saccade {

PointerBoard::PointerBoard(Tell tell)
    : tell_(std::move(tell)), thread_([this](const std::stop_token& stop) { Run(stop); }) {}

PointerBoard::~PointerBoard() {
  thread_.request_stop();
  thread_.join();
}

std::optional<StrokeSurface> PointerBoard::SurfaceOf(const Session& session,
                                                     const std::string& stroke_id) const {
  const std::lock_guard lock(mutex_);
  for (const Held& held : held_) {
    if (held.pointer.participant_id == session.participant_id &&
        held.pointer.stroke_id == stroke_id && !held.pointer.released) {
      return held.surface;
    }
  }
  return std::nullopt;
}

void PointerBoard::Release(Held& held, Timestamp now_ns) {
  held.pointer.released = true;
  held.pointer.version = ++version_;
  held.released_ns = now_ns;
}

absl::Status PointerBoard::Say(const Session& session, PointerWord word, Timestamp now_ns) {
  const std::lock_guard lock(mutex_);
  const auto same = [&](const Held& held) {
    return held.pointer.participant_id == session.participant_id &&
           held.pointer.kind == word.kind && held.pointer.stroke_id == word.stroke_id;
  };
  auto held = std::find_if(held_.begin(), held_.end(), same);
  if (held != held_.end() && held->pointer.released) {
    if (word.points.empty()) return absl::OkStatus();
    return absl::FailedPreconditionError(
        "stroke_id: this one was released, or silent for a second; begin another");
  }
  if (held == held_.end()) {
    if (word.points.empty()) return absl::OkStatus();  // released before it began
    if (held_.size() >= kMost) {
      return BusyError(absl::StrCat("pointers: ", kMost, " live, as many as may"), kSilence);
    }
    for (Held& other : held_) {
      const bool own = other.pointer.participant_id == session.participant_id;
      if (own && other.pointer.kind == word.kind && !other.pointer.released) {
        Release(other, now_ns);
      }
    }
    held_.emplace_back();
    held = held_.end() - 1;
    held->access_id = session.access_id;
    held->surface = word.surface;
    LivePointer& pointer = held->pointer;
    pointer.participant_id = session.participant_id;
    pointer.kind = word.kind;
    pointer.stroke_id = word.stroke_id;
    pointer.points = std::make_shared<const std::vector<Eigen::Vector3d>>();
  }
  LivePointer& pointer = held->pointer;
  if (!word.points.empty()) {
    std::vector<Eigen::Vector3d> points;
    if (word.kind == PointerKind::kLaser) {
      points.push_back(word.points.back());
    } else {
      if (pointer.points->size() + word.points.size() > kMaxInkPoints) {
        return absl::ResourceExhaustedError(absl::StrCat(
            "points: a stroke has at most ", kMaxInkPoints, "; release it and begin another"));
      }
      points.reserve(pointer.points->size() + word.points.size());
      points = *pointer.points;
      points.insert(points.end(), word.points.begin(), word.points.end());
    }
    pointer.points = std::make_shared<const std::vector<Eigen::Vector3d>>(std::move(points));
  }
  pointer.person_id = session.person_id;
  pointer.display_name = session.display_name;
  pointer.color_rgba = word.color_rgba;
  pointer.time_ns = now_ns;
  pointer.version = ++version_;
  if (word.released) Release(*held, now_ns);
  Publish();
  return absl::OkStatus();
}

template <typename Whose>
void PointerBoard::End(Whose whose) {
  const std::lock_guard lock(mutex_);
  bool any = false;
  for (Held& held : held_) {
    if (held.pointer.released || !whose(held)) continue;
    Release(held, MonotonicNow());
    any = true;
  }
  if (any) Publish();
}

void PointerBoard::EndParticipant(const std::string& participant_id) {
  End([&](const Held& held) { return held.pointer.participant_id == participant_id; });
}

void PointerBoard::EndAccess(const std::vector<std::string>& access_ids) {
  End([&](const Held& held) {
    return std::find(access_ids.begin(), access_ids.end(), held.access_id) != access_ids.end();
  });
}

/// Under the lock, so that states are told in their order.
void PointerBoard::Publish() {
  auto list = std::make_shared<PointerList>();
  list->reserve(held_.size());
  for (const Held& held : held_) list->push_back(held.pointer);
  tell_(std::move(list));
  changed_.notify_one();
}

Timestamp PointerBoard::Expire(Timestamp now_ns) {
  const std::lock_guard lock(mutex_);
  bool any = false;
  for (Held& held : held_) {
    if (held.pointer.released || now_ns - held.pointer.time_ns < kSilence) continue;
    Release(held, now_ns);
    any = true;
  }
  any |= std::erase_if(held_, [now_ns](const Held& held) {
           return held.pointer.released && now_ns - held.released_ns >= kLinger;
         }) > 0;
  if (any) Publish();
  Timestamp next_ns = 0;
  for (const Held& held : held_) {
    const Timestamp due_ns =
        held.pointer.released ? held.released_ns + kLinger : held.pointer.time_ns + kSilence;
    next_ns = next_ns == 0 ? due_ns : std::min(next_ns, due_ns);
  }
  return next_ns;
}

void PointerBoard::Run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const Timestamp next_ns = Expire(MonotonicNow());
    std::unique_lock lock(mutex_);
    if (next_ns == 0) {
      changed_.wait(lock, stop, [this] { return !held_.empty(); });
    } else {
      const auto wait = std::chrono::nanoseconds(std::max<Timestamp>(0, next_ns - MonotonicNow()));
      changed_.wait_for(lock, stop, wait, [] { return false; });
    }
  }
}

}  // namespace saccade
