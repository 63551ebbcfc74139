#pragma once

#include <deque>
#include <memory>
#include <optional>

#include "server/capture/imu_feed.hpp"
#include "server/filter/inertial_start.hpp"
#include "shared/geometry/similarity3.hpp"

namespace saccade {

struct InertialGuideOptions {
  double shortest_s = 1.0;       // of poses, before a unit of length is sought
  double longest_s = 3.0;        // of those that are looked at
  double apart_s = 0.15;         // of two of them
  double good_sigma = 0.01;      // of the scale: it is taken at once
  double poor_sigma = 0.05;      // it is taken, once longest_s have been seen
  double worst_misfit = 4.0;     // chi-squared by its degrees of freedom
  double position_share = 1e-3;  // sigma of a pose by pictures, of the distance to what is in view
  double rotation_sigma_rad = 1e-3;
};

/// What the tracker has of an inertial unit: its samples, and poses until they tell a metre.
class InertialGuide {
 public:
  InertialGuide(std::shared_ptr<const ImuFeed> feed, const InertialGuideOptions& options)
      : feed_(std::move(feed)), options_(options) {}

  void Reset() { poses_.clear(); }
  /// Fetches what lies between two pictures; valid until the next call.
  ImuStep Between(Timestamp from_ns, Timestamp to_ns);
  /// Of a frame that was followed; `distance`: to what is in view, in the same unit.
  void Record(Timestamp time_ns, const Rigid3& world_from_camera, double distance);
  /// Poses go along with a map that moves.
  void Move(const Similarity3& world_from_before);
  /// How long the recorded poses go back [s].
  double seen_s() const;
  /// Whether there is use in waiting longer.
  bool patient() const { return seen_s() < options_.longest_s; }
  /// The metre, as soon as it is known well enough; of the newest pose recorded.
  std::optional<InertialSolution> Find() const;

 private:
  std::shared_ptr<const ImuFeed> feed_;
  InertialGuideOptions options_;
  std::deque<SeenPose> poses_;
  ImuTrack samples_;
};

}  // namespace saccade
