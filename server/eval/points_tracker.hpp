#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "server/eval/points_front_end.hpp"
#include "server/eval/points_world.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade {

/// What one frame came to, against the truth.
struct PointsStep {
  double nees = 0;           // of the 6-D pose
  double position_nees = 0;  // of its 3-D position
  double nis = 0;  // of all matches together: chi-square with 2 * matches degrees of freedom
  int matches = 0;
  double position_error_m = 0;
  double rotation_error_rad = 0;
};

/// How a points run is tracked.
struct PointsSetup {
  TrackerOptions tracker;
  bool known_map = false;  // every point is given, as those of a target: localisation only (T39)
};

/// The product's settings, less what a points world does not have: its noise is the same all over
/// the picture, its shutter is global, and it has fewer points than a picture has corners.
PointsSetup MakePointsSetup(const PointsOptions& options);
/// The same for NEES and NIS: errors are counted from the start, where the truth is; no match is
/// weighted, so that NIS is an honest chi-square (cut at the gate); and nothing is adjusted, which
/// moves estimates but not their covariance.
PointsSetup MakeConsistencySetup(const PointsOptions& options);

/// The tracker on a points world: search, robust pose, filter, map, and all rules are the
/// product's; only pictures are missing, and with them recognition: what is lost stays so.
class PointsTracker {
 public:
  /// `first`: the camera starts near it, off by what its covariance says, so that a consistent
  /// filter is consistent from the first frame on. `world`, `options`: kept by the caller.
  /// InvalidArgument: as Tracker::Create.
  static absl::StatusOr<PointsTracker> Create(const PointsWorld& world,
                                              const PointsOptions& options,
                                              const PointsSetup& setup, const PointsFrame& first);

  /// Frames in order; `frame` is kept by the caller until the next. An error is the filter's own: a
  /// covariance that broke.
  absl::StatusOr<PointsStep> Step(const PointsFrame& frame);

  const Tracker& tracker() const { return *tracker_; }

 private:
  PointsTracker(const PointsWorld& world, std::unique_ptr<Tracker> tracker,
                PointsFrontEnd& front_end, const SourceInfo& source);

  const PointsWorld* world_;
  PointsFrontEnd* front_end_;  // the tracker's
  std::unique_ptr<Tracker> tracker_;
  Frame frame_;
  std::int64_t steps_ = 0;
};

}  // namespace saccade
