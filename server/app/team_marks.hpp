#pragma once

#include <optional>
#include <string>

#include "server/pipeline/events.hpp"
#include "shared/geometry/similarity3.hpp"

namespace saccade {

/// Whether there is nothing to tell of the second that the first does not say: the same marks, of
/// the same revisions, within 5 mm of where they were.
bool SameMarks(const AnnotationList& a, const AnnotationList& b);

/// Another wearer's mark as one of this map; by the name of its author. Nothing: of a kind that
/// needs more than a place (pinned pictures; check lists).
std::optional<AnnotationDraft> CopyOf(const Annotation& mark, const Similarity3& own_from_member,
                                      const std::string& device_id);

}  // namespace saccade
