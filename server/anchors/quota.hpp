#pragma once

#include <absl/status/status.h>

#include <cstddef>
#include <string>
#include <vector>

#include "server/anchors/anchor_options.hpp"
#include "server/anchors/anchor_record.hpp"

namespace saccade {

/// What annotations take of the quotas.
struct Holding {
  std::size_t annotations = 0;
  std::size_t ink_points = 0;
  std::size_t bytes = 0;  // of texts, names and strokes
  std::size_t picture_bytes = 0;
};
Holding HoldingOf(const Annotation& annotation);

/// ResourceExhausted if `person_id` (empty: nobody's) may not add so much to `records`: it says
/// which quota, how much there is and what to do. What does not grow is not held against anybody,
/// so that a store which is above a quota already (an older data base) can still be edited.
absl::Status CheckQuotas(const std::vector<AnchorRecord>& records, const AnchorOptions& options,
                         const std::string& person_id, const Holding& added);

}  // namespace saccade
