#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "server/eval/score.hpp"

namespace saccade {

/// A frame that is published as tracked and further off than this is a false claim.
inline constexpr double kFalseTracked_m = 0.15;

/// Frames published as tracked whose position was wrong by more than kFalseTracked_m.
///
/// A frame is false if it is off against either
/// - what was tracked before it: the alignment over all earlier poses that are not off against the
///   whole, where that alignment carries to the frame's true place. It carries if an error of 5 cm
///   in the poses before could make at most 15 cm there (`RunningAlignment::Leverage` <= 3), so a
///   few millimetres of path at the start are not extrapolated across the room; or
/// - the whole: the alignment that most of the run agrees with (least squares, again over the
///   better half, then over what lies within 15 cm, until nothing changes).
///
/// So a start at the scale that the map does not keep counts (against the whole), and does not make
/// what follows count; a jump after a gap counts for as long as it lasts; of a run torn in two by a
/// jump that stays, the smaller part counts; and what bends slowly counts against what was before.
/// Zero means: no tracked frame was more than 15 cm off by either reading.
struct FalseTracked {
  std::uint64_t frames = 0;          // against either
  std::uint64_t against_before = 0;  // against what was tracked before
  std::uint64_t against_whole = 0;
  double worst_m = 0;                      // the largest of all errors, false or not
  std::optional<Timestamp> first_time_ns;  // of the first false frame
};

/// `tracked`: poses as published, in order of time. Lengths are compared with their scale where
/// `alignment` is kSe3 (a metric map). Fewer than three poses: none is false.
FalseTracked CountFalseTracked(const std::vector<PosePair>& tracked, TrajectoryAlignment alignment);

/// The alignment that most of `pairs` agrees with, see FalseTracked. At least one pair.
Similarity ConsensusAlignment(const std::vector<PosePair>& pairs, TrajectoryAlignment alignment);

/// Least-squares alignment over a growing set of positions; every call takes constant time.
class RunningAlignment {
 public:
  explicit RunningAlignment(TrajectoryAlignment alignment) : alignment_(alignment) {}

  void Add(const Eigen::Vector3d& estimate, const Eigen::Vector3d& truth);
  std::size_t size() const { return count_; }
  /// Truth from estimate. At least one point.
  Similarity Align() const;
  /// How much larger than in the points themselves an error common to them may be at
  /// `point_in_truth`: 1 at their centre, growing with the distance over their extent.
  double Leverage(const Eigen::Vector3d& point_in_truth) const;

 private:
  TrajectoryAlignment alignment_;
  std::size_t count_ = 0;
  // Relative to the first point: large coordinates would eat the digits of the products.
  Eigen::Vector3d first_estimate_ = Eigen::Vector3d::Zero(), first_truth_ = first_estimate_;
  Eigen::Vector3d estimate_sum_ = Eigen::Vector3d::Zero(), truth_sum_ = estimate_sum_;
  Eigen::Matrix3d product_sum_ = Eigen::Matrix3d::Zero(), truth_square_sum_ = product_sum_;
  double estimate_square_sum_ = 0;
};

}  // namespace saccade
