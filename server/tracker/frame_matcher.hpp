#pragma once

#include <random>
#include <vector>

#include "server/filter/filter_state.hpp"
#include "server/filter/robust_pose.hpp"
#include "server/map/landmark.hpp"
#include "server/tracker/front_end.hpp"
#include "server/tracker/present_motion.hpp"
#include "server/tracker/tracker_options.hpp"

namespace saccade {

/// What became of one landmark in one frame.
struct LandmarkMatch {
  FeatureId id = 0;
  PredictedPixel predicted;                             // at the predicted pose
  std::variant<PointFromClone, Eigen::Vector3d> point;  // as the filter has it; known points
  bool waits = false;                                   // for its range: not searched for
  bool searched = false;
  bool found = false;
  bool hidden = false;  // nothing but blank where it should be: no attempt
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // found, else where it was expected
  /// `pixel` less this is where it would have been seen in mid-exposure [px] (rolling shutter).
  Eigen::Vector2d row_shift = Eigen::Vector2d::Zero();
  Eigen::Vector2d d_readout = Eigen::Vector2d::Zero();  // row_shift / read-out time [px/s]
  Eigen::Matrix2d noise = Eigen::Matrix2d::Identity();
  double weight = 0.0;        // of the robust pose; 0: outlier or not found
  double searched_px2 = 0.0;  // area of the ellipses in which it was sought

  bool accepted() const { return found && weight > 0.1; }
};

struct FrameMatches {
  std::vector<LandmarkMatch> in_view;  // all landmarks whose prediction is in the picture
  RobustPose pose;
  int attempted = 0;
  int accepted = 0;
  int hidden = 0;
  double searched_px2 = 0;  // area of all ellipses that were searched
  CameraMotion motion;      // when this picture was exposed
  bool surprised = false;   // few of the first stage agree: the camera moved unexpectedly
};

/// Finds the map in a frame: a few features widely, a robust pose from them, the rest narrowly
/// around that, and the pose again (findings; slam-spec 5.1, 5.5).
class FrameMatcher {
 public:
  explicit FrameMatcher(const TrackerOptions& options) : options_(options) {}

  /// `filter` has predicted `step`.
  FrameMatches Match(FrontEnd& front_end, const CameraModel& camera, const FilterState& filter,
                     const LandmarkMap& map, const MotionStep& step, std::mt19937_64& random) const;

  /// The same matches against a filter that has changed since; nothing is searched anew.
  void Renew(const CameraModel& camera, const FilterState& filter, FrameMatches& matches,
             std::mt19937_64& random) const;

  /// Sigma of a match at `pixel` [px].
  double PixelSigma(const CameraModel& camera, const Eigen::Vector2d& pixel) const;

 private:
  std::vector<LandmarkMatch> Visible(const CameraModel& camera, const FilterState& filter,
                                     const LandmarkMap& map) const;
  /// Indices into `in_view`, most wanted first, spread over the picture.
  std::vector<int> Order(const CameraModel& camera, const std::vector<LandmarkMatch>& in_view,
                         const LandmarkMap& map, std::mt19937_64& random) const;
  void Search(FrontEnd& front_end, const CameraModel& camera, const LandmarkMap& map,
              const PosePrior& prior, const Rigid3& pose, const Matrix6d& pose_covariance,
              const CameraMotion& motion, double readout_s, LandmarkMatch& match) const;
  /// The motion by the pose that was found, and with it where in mid-exposure the matches were.
  static void CatchUp(const CameraModel& camera, const FilterState& filter, const MotionStep& step,
                      FrameMatches& matches);
  RobustPose Solve(const CameraModel& camera, const PosePrior& prior,
                   std::vector<LandmarkMatch>& in_view, std::mt19937_64& random) const;

  TrackerOptions options_;
};

}  // namespace saccade
