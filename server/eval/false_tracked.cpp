#include "server/eval/false_tracked.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMaxLeverage = 3.0;    // 5 cm in the poses before is 15 cm here
constexpr std::size_t kMinBefore = 10;  // poses: fewer hold nothing, whatever their extent
constexpr int kHalfRounds = 10;         // over the better half, then
constexpr int kConsensusRounds = 30;    // over what is near; both settle in about five
constexpr double kLeastExtent2_m2 =
    1e-8;  // 0.1 mm: what is turned about the line of a straight path

double ErrorOf(const PosePair& pair, const Similarity& truth_from_estimate) {
  return (truth_from_estimate * pair.estimate.translation - pair.truth.translation).norm();
}

Similarity AlignKept(const std::vector<PosePair>& pairs, const std::vector<bool>& kept,
                     TrajectoryAlignment alignment) {
  std::vector<Vector3d> estimate, truth;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!kept[i]) continue;
    estimate.push_back(pairs[i].estimate.translation);
    truth.push_back(pairs[i].truth.translation);
  }
  return AlignPoints(estimate, truth, alignment);
}

}  // namespace

Similarity ConsensusAlignment(const std::vector<PosePair>& pairs, TrajectoryAlignment alignment) {
  std::vector<bool> kept(pairs.size(), true);
  Similarity aligned = AlignKept(pairs, kept, alignment);
  for (int round = 0; round < kConsensusRounds; ++round) {
    std::vector<double> errors;
    for (const PosePair& pair : pairs) errors.push_back(ErrorOf(pair, aligned));
    std::vector<double> sorted = errors;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double limit = round < kHalfRounds ? *middle : std::max(kFalseTracked_m, *middle);
    std::vector<bool> now(pairs.size());
    for (std::size_t i = 0; i < errors.size(); ++i) now[i] = errors[i] <= limit;
    if (now == kept && round > kHalfRounds) break;
    kept = std::move(now);
    aligned = AlignKept(pairs, kept, alignment);
  }
  return aligned;
}

FalseTracked CountFalseTracked(const std::vector<PosePair>& tracked,
                               TrajectoryAlignment alignment) {
  FalseTracked result;
  if (tracked.size() < 3) return result;
  const Similarity whole = ConsensusAlignment(tracked, alignment);
  RunningAlignment before(alignment);
  for (const PosePair& pair : tracked) {
    const double of_whole = ErrorOf(pair, whole);
    const bool off_whole = !(of_whole <= kFalseTracked_m);
    bool off_before = false;
    if (before.size() >= kMinBefore && before.Leverage(pair.truth.translation) <= kMaxLeverage) {
      const double of_before = ErrorOf(pair, before.Align());
      off_before = !(of_before <= kFalseTracked_m);
      result.worst_m = std::max(result.worst_m, of_before);
    }
    result.worst_m = std::max(result.worst_m, of_whole);
    result.against_whole += off_whole ? 1 : 0;
    result.against_before += off_before ? 1 : 0;
    if (off_whole || off_before) {
      ++result.frames;
      if (!result.first_time_ns) result.first_time_ns = pair.time_ns;
    }
    if (!off_whole) before.Add(pair.estimate.translation, pair.truth.translation);
  }
  return result;
}

void RunningAlignment::Add(const Vector3d& estimate, const Vector3d& truth) {
  if (count_++ == 0) {
    first_estimate_ = estimate;
    first_truth_ = truth;
  }
  const Vector3d e = estimate - first_estimate_, t = truth - first_truth_;
  estimate_sum_ += e;
  truth_sum_ += t;
  product_sum_ += t * e.transpose();
  truth_square_sum_ += t * t.transpose();
  estimate_square_sum_ += e.squaredNorm();
}

Similarity RunningAlignment::Align() const {
  const auto count = static_cast<double>(count_);
  const Vector3d e = estimate_sum_ / count, t = truth_sum_ / count;
  return AlignMoments({.source_mean = first_estimate_ + e,
                       .target_mean = first_truth_ + t,
                       .covariance = product_sum_ / count - t * e.transpose(),
                       .source_variance = estimate_square_sum_ / count - e.squaredNorm()},
                      alignment_);
}

double RunningAlignment::Leverage(const Vector3d& point_in_truth) const {
  // Of the linearised problem, whose translation, rotation and scale do not mix once the points are
  // centred: d = translation + rotation x p + scale p.
  const auto count = static_cast<double>(count_);
  const Vector3d mean = truth_sum_ / count;
  const Matrix3d extent = truth_square_sum_ / count - mean * mean.transpose();
  const Vector3d p = point_in_truth - first_truth_ - mean;
  const Matrix3d turning = (extent.trace() + kLeastExtent2_m2) * Matrix3d::Identity() - extent;
  Matrix3d cross;
  cross << 0, -p.z(), p.y(), p.z(), 0, -p.x(), -p.y(), p.x(), 0;
  const Matrix3d moved = cross * turning.inverse() * cross.transpose();
  const double turned =
      Eigen::SelfAdjointEigenSolver<Matrix3d>(moved, Eigen::EigenvaluesOnly).eigenvalues()[2];
  const double scaled = alignment_ == TrajectoryAlignment::kSim3
                            ? p.squaredNorm() / (extent.trace() + kLeastExtent2_m2)
                            : 0.0;
  return std::sqrt(1.0 + std::max(turned, scaled));
}

}  // namespace saccade
