#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/features/patch.hpp"
#include "shared/geometry/rigid3.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

/// What the map keeps of a feature beside its state: looks and history. Position and covariance are
/// the filter's alone.
struct Landmark {
  FeatureId id = 0;
  PatchTemplate patch;
  /// A point of a known target: constant, outside the state. Then also where its patch was seen.
  struct Known {
    Eigen::Vector3d point_in_world;  // [m]
    Rigid3 world_from_birth;
  };
  std::optional<Known> known;
  bool seeded = false;  // started at a click: something may hang on it
  bool waits = false;   // for its range, until when it is not searched for (`classic` start)

  std::uint32_t attempted = 0;      // frames in which it was searched for
  std::uint32_t matched = 0;        // of these, accepted by the filter
  std::uint32_t failed_in_row = 0;  // newest attempts without success
  std::int64_t last_matched_frame = -1;
  std::int64_t last_in_view_frame = -1;  // hidden or not
  double recent = 1.0;  // smoothed share of attempts that succeeded, about the last 20
  /// Since it was last woken (DormantLandmarks); nothing: it never slept.
  struct Probation {
    std::uint32_t attempted = 0, matched = 0;
    int failures = 0;  // earlier times that it was not found
  };
  std::optional<Probation> woken;

  /// Books one attempt.
  void Record(bool success, std::int64_t frame) {
    ++attempted;
    matched += success ? 1 : 0;
    failed_in_row = success ? 0 : failed_in_row + 1;
    recent += 0.05 * ((success ? 1.0 : 0.0) - recent);
    if (success) last_matched_frame = frame;
    if (woken) {
      ++woken->attempted;
      woken->matched += success ? 1 : 0;
    }
  }
};

/// Landmarks by rising id.
class LandmarkMap {
 public:
  /// The next free id; ids are never used twice, not even after Clear().
  FeatureId NextId() { return next_id_++; }
  /// Ids up to this one are taken, by landmarks elsewhere.
  void SkipIds(FeatureId newest) { next_id_ = std::max(next_id_, newest + 1); }
  void Add(Landmark landmark);
  void Remove(std::span<const FeatureId> ids);
  void Clear() { landmarks_.clear(); }

  Landmark* Find(FeatureId id);
  const Landmark* Find(FeatureId id) const;
  std::vector<Landmark>& all() { return landmarks_; }
  const std::vector<Landmark>& all() const { return landmarks_; }

 private:
  std::vector<Landmark> landmarks_;
  FeatureId next_id_ = 1;
};

/// When features leave the map (slam-spec 5.6, findings).
struct RetirementOptions {
  std::uint32_t min_attempts = 10;     // before a young one is judged
  double min_success = 0.5;            // of a young one's attempts
  std::uint32_t mature_after = 40;     // matches; old landmarks are the treasure
  std::uint32_t mature_failures = 60;  // in a row that a mature one may have
};

/// Ids of landmarks that fail too often. Known and seeded ones stay (seeded: twice as long).
std::vector<FeatureId> Unreliable(const LandmarkMap& map, const RetirementOptions& options);

/// Ids of the `count` landmarks least worth keeping: of those not seen lately the ones matched
/// least, then the young in view. Never known ones.
std::vector<FeatureId> LeastWorth(const LandmarkMap& map, int count, std::int64_t frame);

}  // namespace saccade
