#include "server/rpc/pointer_reader.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

void Name(const std::string& participant_id, PointerKind kind, const std::string& stroke_id,
          v1::Pointer& out) {
  out.set_participant_id(participant_id);
  out.set_kind(kind == PointerKind::kLaser ? v1::POINTER_KIND_LASER : v1::POINTER_KIND_SKETCH);
  out.set_stroke_id(stroke_id);
}

}  // namespace

bool PointerReader::Next(const PointerList& list, v1::PointerEvent& event) {
  std::size_t room = kPartPoints;
  complete_ = true;
  for (auto& one : told_) one.second.there = false;
  for (const LivePointer& pointer : list) {
    const std::string key = absl::StrCat(pointer.participant_id, "/",
                                         static_cast<int>(pointer.kind), "/", pointer.stroke_id);
    auto known = told_.find(key);
    if (known == told_.end()) {
      if (pointer.released) continue;
      known = told_.try_emplace(key).first;
      known->second.participant_id = pointer.participant_id;
      known->second.stroke_id = pointer.stroke_id;
      known->second.kind = pointer.kind;
    }
    Told& told = known->second;
    told.there = true;
    if (told.version == pointer.version) continue;
    const bool laser = pointer.kind == PointerKind::kLaser;
    const std::size_t first = laser ? 0 : told.points;
    const std::size_t count = std::min(room, pointer.points->size() - first);
    const bool whole = first + count == pointer.points->size();
    if (count == 0 && !whole) {
      complete_ = false;
      continue;
    }
    v1::Pointer& out = *event.add_pointers();
    Name(pointer.participant_id, pointer.kind, pointer.stroke_id, out);
    out.set_person_id(pointer.person_id);
    out.set_display_name(pointer.display_name);
    out.set_color_rgba(pointer.color_rgba);
    out.set_first(static_cast<std::uint32_t>(first));
    for (std::size_t i = first; i < first + count; ++i) {
      *out.add_points_in_world_m() = wire::ToProto((*pointer.points)[i]);
    }
    out.set_released(pointer.released && whole);
    out.set_time_ns(pointer.time_ns);
    room -= count;
    told.points = first + count;
    if (whole) {
      told.version = pointer.version;
      told.ended = pointer.released;
    } else {
      complete_ = false;
    }
  }
  // Forgotten there before this one heard of its end.
  absl::erase_if(told_, [&event](const auto& one) {
    const Told& told = one.second;
    if (told.there) return false;
    if (told.ended) return true;
    v1::Pointer& out = *event.add_pointers();
    Name(told.participant_id, told.kind, told.stroke_id, out);
    out.set_released(true);
    return true;
  });
  return event.pointers_size() > 0;
}

}  // namespace saccade
