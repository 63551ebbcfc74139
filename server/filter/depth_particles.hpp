#pragma once

#include <absl/status/status.h>

#include <Eigen/Dense>
#include <optional>
#include <span>
#include <vector>

#include "server/filter/point_model.hpp"

namespace saccade {

/// Delayed initialisation, `classic` (slam-spec 5.3; Davison, Mayol, Murray 2003).
struct DepthParticleOptions {
  int count = 100;  // hypotheses at first, evenly spaced
  double min_range_m = 0.5, max_range_m = 5.0;
  double least_weight = 0.05;    // of 1 / count; lighter particles are dropped [SL2]
  double known_below = 0.3;      // sigma / mean at which the range is known...
  int fewest = 20;               // ...if more particles than this are left; else deleted
  int max_attempts = 10;         // frames in which it is looked for
  double least_speed_m_s = 0.2;  // slower, nothing is learnt: no attempt [SL2]
  /// InvalidArgument names the field and its range.
  absl::Status Validate() const;
};

/// What the filter knows of a line of sight whose range it does not know: a bearing in a pose
/// clone.
struct DepthLine {
  PointFromClone line;  // its inverse_range is not looked at
  Rigid3 world_from_camera;
  /// Joint covariance of [camera position, rotation | clone position, rotation | bearing tangent].
  Eigen::Matrix<double, 14, 14> covariance = Eigen::Matrix<double, 14, 14>::Zero();
};

/// One hypothesis of the range, and where the feature would then be seen.
struct DepthParticle {
  double range_m = 0.0;
  double weight = 0.0;                                       // all add up to 1
  std::optional<Eigen::Vector2d> pixel;                      // [px]; nothing: not in view
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();  // S, match noise included [px^2]
};

enum class DepthVerdict {
  kPartial,  // go on
  kKnown,    // the range is known well enough for the filter
  kGone,     // no match, too few hypotheses left, or too many attempts: forget the feature
};

/// The range of one new feature as weighted particles on its line of sight, until it is known.
///
/// Each frame (from the one after birth, while the camera moves): Predict(), search in the union of
/// the particles' ellipses with scores kept per pixel, Update() with each particle's own best
/// match. While partial, the line gives no update of the pose.
class DepthParticles {
 public:
  /// `options` must be valid.
  explicit DepthParticles(const DepthParticleOptions& options);

  /// Whether the camera moves enough for an attempt.
  bool WorthAttempt(const Eigen::Vector3d& velocity_m_s) const;

  /// Where each particle is seen now. `noise`: R of one match [px^2].
  void Predict(const CameraModel& camera, const DepthLine& line, const Eigen::Matrix2d& noise);
  std::span<const DepthParticle> particles() const { return particles_; }

  /// One attempt: `matches[k]` is where the patch was found within the ellipse of particle k, or
  /// nothing. A frame whose view misses most of the line is no attempt.
  DepthVerdict Update(std::span<const std::optional<Eigen::Vector2d>> matches);

  int attempts() const { return attempts_; }
  double range_m() const;        // weighted mean
  double range_sigma_m() const;  // the spacing of the particles counts in
  /// The same for 1 / range, as PointFromClone has it.
  double inverse_range() const;
  double inverse_range_sigma() const;

 private:
  template <typename Function>
  std::pair<double, double> Moments(const Function& of_range) const;

  DepthParticleOptions options_;
  std::vector<DepthParticle> particles_;
  int attempts_ = 0;
};

}  // namespace saccade
