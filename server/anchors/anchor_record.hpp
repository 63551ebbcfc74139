#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/anchors/anchor_place.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

/// One annotation with its place in the map. The live one is mutable and on the tracker thread;
/// copies of it, held until an edit is on disk, are RecordPtr.
struct AnchorRecord {
  Annotation annotation;
  AnchorPlace place;
  std::string owner;  // the session that made it; empty: made before this run
  /// Names the edited content: undoing an edit restores the id too, so that a session can tell
  /// whether somebody else changed the annotation since.
  std::uint64_t content_id = 0;
  /// As last handed to the store.
  Eigen::Vector3d stored_point = Eigen::Vector3d::Zero();
  double stored_error_m = 0.0;
  Timestamp stored_time_ns = 0;
};
using RecordPtr = std::shared_ptr<const AnchorRecord>;

}  // namespace saccade
