#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "shared/time/timestamp.hpp"

namespace saccade {

enum class PointerKind { kLaser, kSketch };

/// What somebody points at or draws right now. Immutable once told; never kept.
struct LivePointer {
  std::string participant_id, person_id, display_name;
  PointerKind kind = PointerKind::kLaser;
  std::string stroke_id;  // UUID of theirs
  std::uint32_t color_rgba = 0xffffffff;
  /// In world [m]; of a laser its newest point alone. Never null.
  std::shared_ptr<const std::vector<Eigen::Vector3d>> points;
  bool released = false;      // or silent for too long: no longer to be drawn
  Timestamp time_ns = 0;      // of its newest word, MonotonicNow()
  std::uint64_t version = 0;  // rises with each word
};
using PointerList = std::vector<LivePointer>;

/// The plane that a stroke is drawn on: what its first point lies on.
struct StrokeSurface {
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();    // [m]
  Eigen::Vector3d normal_in_world = Eigen::Vector3d::UnitZ();  // unit
};

}  // namespace saccade
