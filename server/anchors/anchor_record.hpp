#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "server/anchors/anchor_place.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

/// The other end of a measure, which hangs in the map as the anchor does.
struct MeasureEnd {
  AnchorPlace place;
  Anchor anchor;
  Timestamp told_ns = 0;  // capture time of the frame whose length the annotation tells
};

/// One annotation with its place in the map. The live one is mutable and on the tracker thread;
/// copies of it, held until an edit is on disk, are RecordPtr.
struct AnchorRecord {
  Annotation annotation;
  AnchorPlace place;
  std::optional<MeasureEnd> end;  // kMeasure alone
  /// Names the edited content: undoing an edit restores the id too, so that a person can be told
  /// whether somebody else changed the annotation since.
  std::uint64_t content_id = 0;
  /// As last handed to the store.
  Eigen::Vector3d stored_point = Eigen::Vector3d::Zero();
  double stored_error_m = 0.0;
  Timestamp stored_time_ns = 0;
};
using RecordPtr = std::shared_ptr<const AnchorRecord>;

}  // namespace saccade
