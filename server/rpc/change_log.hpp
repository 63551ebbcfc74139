#pragma once

#include <absl/container/flat_hash_map.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/pipeline/events.hpp"

namespace saccade {

/// Number of a change: they rise over everything that one log sees, and each change has its own. So
/// a reader knows where it stands by a number or two, however much there is.
using ChangeNumber = std::uint64_t;

template <typename Id>
struct Removal {
  ChangeNumber number = 0;
  Id id;
};

/// The changes of a list (features, annotations) up to one state of it; immutable.
template <typename Id>
struct Changes {
  ChangeNumber newest = 0;
  /// Of each item of the list, its newest change; and the newest that was not of its live estimate
  /// alone: when it was made or edited.
  std::vector<ChangeNumber> numbers, content_numbers;
  /// Items changed since the state before, by number: who had that state needs only these.
  ChangeNumber previous = 0;
  std::vector<std::uint32_t> changed;
  /// Lowest number first. Of those up to `forgotten` nothing is known any more.
  std::shared_ptr<const std::vector<Removal<Id>>> removed;
  ChangeNumber forgotten = 0;
};

/// What is known after one frame, with what changed in it: worked out once for all who read it.
struct NumberedState {
  TrackedEvent tracked;
  std::shared_ptr<const Changes<FeatureId>> map;            // parallel to snapshot->features
  std::shared_ptr<const Changes<std::string>> annotations;  // parallel to *tracked.annotations
};

/// Decides what of each new state is a change worth sending. Not thread safe.
///
/// Features change when their state does, when they moved by a tenth of their sigma or half a
/// millimetre, or when their sigma changed by a tenth; annotations when they were edited, their
/// state changed, the estimate moved by a quarter of a pixel or, every 200 ms, its error changed by
/// a tenth.
class ChangeLog {
 public:
  /// Removals that are remembered: a reader further behind starts anew.
  static constexpr std::size_t kKeptRemovals = 4096;

  NumberedState Next(const TrackedEvent& event, Timestamp now_ns);

 private:
  struct SentFeature {
    Eigen::Vector3d point_in_world;
    double sigma_m;  // root of the covariance's trace
    FeatureState state;
    bool depth_known;
    ChangeNumber number, content_number;
    std::uint64_t round;  // the last state that had it
  };
  struct SentAnnotation {
    Annotation annotation;
    Timestamp time_ns;
    ChangeNumber number, content_number;
    std::uint64_t round;
  };

  std::shared_ptr<const Changes<FeatureId>> NextMap(const MapSnapshot& snapshot);
  std::shared_ptr<const Changes<std::string>> NextAnnotations(const TrackedEvent& event,
                                                              Timestamp now_ns);

  std::uint64_t round_ = 0;
  ChangeNumber map_newest_ = 0, annotations_newest_ = 0;
  std::uint64_t generation_ = 0;
  absl::flat_hash_map<FeatureId, SentFeature> features_;
  absl::flat_hash_map<std::string, SentAnnotation> annotations_;
  std::shared_ptr<const Changes<FeatureId>> map_changes_;
  std::shared_ptr<const Changes<std::string>> annotation_changes_;
};

}  // namespace saccade
