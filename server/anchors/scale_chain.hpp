#pragma once

#include <absl/container/flat_hash_map.h>

#include <optional>

#include "shared/scene/map_snapshot.hpp"

namespace saccade {

struct ScaleChainOptions {
  /// A patch seen from elsewhere is off by so much, always the same way (server/filter, parallax):
  /// many of them, seen for long, know no better.
  double patch_error_px = 0.3;
  double least_parallax_px = 4.0;     // nothing hands on less surely than with this
  double target_parallax_px = 100.0;  // a point of the target is worth as much without any
  double lost_share = 0.1;            // of scale, where nothing known was in view to hand it on
  double frozen_after_s = 2.0;  // out of the picture: what is learnt later is not learnt of it
};

/// How surely each part of the map has the scale of the place where it began.
///
/// Scale is handed on: what is new gets its depth from the camera's path, the path its length from
/// what was known and still in view. Each hand-over adds an error that everything new has in common
/// and that no later look within the same part takes away: patch error over the parallax that it
/// has shown while what was known before was still in view. A head that turns fast shows each thing
/// for a moment: three hand-overs at 15 px are 4 % of every distance behind the wearer, while each
/// feature, seen against the others, is known to a few per mille. The filter counts errors from
/// nearby and says nothing of it.
///
/// One owner; some multiplications for each feature measured in a frame.
class ScaleChain {
 public:
  explicit ScaleChain(const ScaleChainOptions& options = {}) : options_(options) {}

  /// Once per frame. `radians_per_px` of the camera's middle.
  void Observe(const MapSnapshot& snapshot, double radians_per_px);

  /// Variance of the logarithm of the scale that what is in view has in common.
  double Now() const { return now_; }
  /// The same of a feature; of one that has not been handed a scale yet, Now().
  double Of(FeatureId id) const;

 private:
  struct Link {
    Eigen::Vector3d first_seen_from = Eigen::Vector3d::Zero();
    double parallax_px = 0;  // the largest so far
    Timestamp seen_ns = 0;
    bool frozen = false;
    std::optional<double> variance;
  };
  /// A feature that was measured and has a depth, with its parallax brought up to date, or null.
  Link* Note(const FeatureSnapshot& feature, const MapSnapshot& snapshot, double radians_per_px);

  ScaleChainOptions options_;
  absl::flat_hash_map<FeatureId, Link> links_;
  std::uint64_t generation_ = 0;
  /// Camera at the start of the map [m]. What is first seen from there has the map's own scale: the
  /// target's, or that which it defines.
  std::optional<Eigen::Vector3d> began_at_;
  double now_ = 0;
};

}  // namespace saccade
