#pragma once

#include <absl/container/flat_hash_map.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "saccade/v1/pointer.pb.h"
#include "server/pipeline/pointers.hpp"

namespace saccade {

/// What one subscriber has been told of pointers. Of a laser it is told the newest point, of a
/// stroke every point once, in parts; that one ended it is told only of those it knows.
class PointerReader {
 public:
  /// Of one event, over all pointers.
  static constexpr std::size_t kPartPoints = 1000;

  /// Fills in what it lacks of `list`, as much as one event holds; false: nothing.
  bool Next(const PointerList& list, v1::PointerEvent& event);
  /// Whether the last event held all there was.
  bool complete() const { return complete_; }

 private:
  struct Told {
    std::string participant_id, stroke_id;
    PointerKind kind = PointerKind::kLaser;
    std::uint64_t version = 0;
    std::size_t points = 0;
    bool ended = false;
    bool there = false;  // in the newest list
  };
  absl::flat_hash_map<std::string, Told> told_;  // by participant, kind and stroke
  bool complete_ = true;
};

}  // namespace saccade
