#pragma once

#include <absl/container/flat_hash_map.h>

#include <cstdint>
#include <string>

#include "saccade/v1/session.pb.h"
#include "server/pipeline/events.hpp"

namespace saccade {

/// What one subscriber knows of the map; turns the newest snapshot into what it lacks.
class MapDeltaTracker {
 public:
  /// Fills `delta` and takes it as sent; false if there is nothing worth sending. Features count as
  /// changed when their state did, when they moved by a tenth of their sigma or half a millimetre,
  /// or when their sigma changed by a tenth. The first delta, and the first of a new map, is full.
  bool Next(const MapSnapshot& snapshot, v1::MapDelta& delta);

 private:
  struct Sent {
    Eigen::Vector3d point_in_world;
    double sigma_m;  // root of the covariance's trace
    FeatureState state;
    bool depth_known;
    std::uint64_t round;  // the last snapshot that had it
  };
  bool Upsert(const FeatureSnapshot& feature);

  absl::flat_hash_map<FeatureId, Sent> sent_;
  bool first_ = true;
  std::uint64_t generation_ = 0;
  std::uint64_t revision_ = 0;
  std::uint64_t round_ = 0;
};

/// The same for annotations. Edits and changes of state are always sent; a live estimate when it
/// moved by a quarter of a pixel, or every 200 ms when its error changed by a tenth.
class AnnotationDeltaTracker {
 public:
  bool Next(const TrackedEvent& event, Timestamp now_ns, v1::AnnotationEvent& delta);

 private:
  struct Sent {
    std::uint64_t revision;
    AnchorState state;
    Eigen::Vector3d point_in_world;
    double error_m;
    bool in_view;
    Timestamp time_ns;
    std::uint64_t round;
  };
  bool Upsert(const Annotation& annotation, const TrackedEvent& event, Timestamp now_ns);

  absl::flat_hash_map<std::string, Sent> sent_;
  bool first_ = true;
  std::uint64_t round_ = 0;
};

/// The whole map in one message.
v1::MapDelta FullMap(const MapSnapshot& snapshot);

}  // namespace saccade
