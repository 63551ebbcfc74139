#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "shared/scene/annotation.hpp"

namespace saccade {

/// What outlives the process of one annotation. Its point is in the world named by `world_key`;
/// empty: the map had no frame that a later run could find again.
struct StoredAnnotation {
  Annotation annotation;
  std::string world_key;
  /// kMeasure: of its other end, whose place the annotation tells.
  Eigen::Matrix3d end_covariance_in_world = Eigen::Matrix3d::Zero();  // [m^2]
};

enum class EditKind { kCreate, kUpdate, kDelete, kUndo, kRedo, kRefine };

/// One change for the store: the new row of annotation `id`, or nothing if it is deleted.
struct AnnotationChange {
  std::uint64_t sequence = 0;  // rises by one with each change of one manager
  EditKind kind = EditKind::kCreate;
  std::string id;
  std::string session_id;   // who, as a participant_id...
  std::string person_id;    // ...and as the person behind it
  std::string request_id;   // of the Create; empty otherwise
  std::string description;  // in words, e.g. "moved note 6f1c..."
  std::optional<StoredAnnotation> after;
};

}  // namespace saccade
