#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/filter/constant_velocity.hpp"
#include "server/filter/covariance.hpp"
#include "server/filter/journal.hpp"
#include "server/filter/motion_model.hpp"
#include "server/filter/parallax.hpp"
#include "server/filter/point_model.hpp"
#include "server/filter/point_parametrisation.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/similarity3.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

using AnchorPoseId = std::uint32_t;

/// A feature as it enters the state: seen at `bearing` from a pose clone.
struct FeatureBirth {
  FeatureId id = 0;
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();            // unit, in the clone
  Eigen::Matrix3d bearing_covariance = Eigen::Matrix3d::Zero();  // of the bearing
  double inverse_range = 1.0;                                    // [1/m]
  double inverse_range_sigma = 0.5;                              // [1/m]
};

/// One matched pixel: of a feature, or of a point that is known and therefore outside the state.
struct Observation {
  FeatureId id = 0;
  std::optional<Eigen::Vector3d> known_point;  // [m, world]; then `id` is not looked at
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Matrix2d noise = Eigen::Matrix2d::Identity();  // R [px^2]
  /// d pixel / d read-out time [px/s]; `pixel` is corrected with the filter's present read-out.
  Eigen::Vector2d d_readout = Eigen::Vector2d::Zero();
};

/// What a prediction's errors look like: z - h = -noise, split by where it comes from.
struct PredictedPixel {
  PixelPrediction at;          // linearised at the filter's camera pose
  Eigen::Matrix2d covariance;  // H P H^T [px^2], without measurement noise
  /// Cov(H error, camera pose error) [position, rotation].
  Eigen::Matrix<double, 2, 6> with_camera;
};

struct FeatureMarginal {
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();        // [m]
  Eigen::Matrix3d covariance_in_world = Eigen::Matrix3d::Zero();   // [m^2]
  Eigen::Matrix3d covariance_in_camera = Eigen::Matrix3d::Zero();  // cross terms included [m^2]
  double inverse_range = 0.0, inverse_range_sigma = 0.0;           // from the anchor [1/m]
};

struct UpdateReport {
  int rows = 0;
  double nis = 0.0;  // r^T S^-1 r, of `rows` degrees of freedom
};

/// Estimates that are better than the filter's were at its mark.
struct Refinement {
  struct Feature {
    Eigen::Vector3d bearing;  // unit, in its clone
    double inverse_range;     // [1/m]
  };
  std::map<AnchorPoseId, Rigid3> anchors;
  std::map<FeatureId, Feature> features;
  std::optional<Rigid3> world_from_camera;  // at the mark
};

/// A map that was found elsewhere, from the same pictures, for an empty filter.
struct MapSeed {
  struct Feature {
    FeatureId id = 0;                                            // rising
    int anchor = 0;                                              // index into `anchors`
    Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();          // unit, in the anchor
    Eigen::Matrix2d birth_covariance = Eigen::Matrix2d::Zero();  // of one match there [rad^2]
    double inverse_range = 1.0;                                  // [1/m]
  };
  std::vector<Rigid3> anchors;  // world from camera, in order of time
  std::vector<Feature> features;
  double readout_s = 0.0;
  /// Of [read-out | 6 of each anchor | 3 of each feature, tangent by TangentBasis].
  Eigen::MatrixXd covariance;
};

struct FilterOptions {
  /// Jacobians at first estimates (slam-spec 1): always, or for the first updates of a map, while
  /// the present ones still jump. docs/derivations/first-estimates.md.
  bool fej = false;
  int fej_updates = 60;
  PointForm form = PointForm::kBearingRange;
  /// Read-out time of a rolling shutter, first to last row [s], and how sure that is; sigma 0: as
  /// given, not estimated.
  double readout_s = 0.0;
  double readout_sigma_s = 0.0;
  /// Updates after which a change of scale is kept unobserved (docs/derivations/scale.md); before,
  /// the first depths are still being sorted out.
  int carry_scale_after = 60;
  /// Inverse ranges whose clone's matches a turn alone explains to within this many standard
  /// deviations are left as they are (docs/derivations/parallax.md); 0: always corrected.
  double parallax_sigmas = 3.0;
  double min_inverse_range = 1e-4;  // [1/m]; of points given in metres (the state may pass 0)
};

/// State and covariance of one moving camera and its map (slam-spec 1, 2, 5.4).
///
/// x = [camera 12 | read-out 1, if estimated | pose clones 6 each and features 3 or 1 each, as they
/// were born]. The covariance is private: docs/derivations/state.md lists the calls that change it,
/// and how. Not thread-safe.
class FilterState {
 public:
  static constexpr int kPoseDim = 6;

  explicit FilterState(const FilterOptions& options);

  /// Forgets everything; the camera is at `camera`, known to `covariance` (12 x 12).
  void Reset(const CameraMotion& camera, const Matrix12d& covariance);
  /// Puts the camera elsewhere, without knowledge shared with the map (slam-spec 6).
  void ResetCamera(const CameraMotion& camera, const Matrix12d& covariance);

  /// Forgets everything and takes a map over, as one whose first troubles are behind it; the camera
  /// shares no knowledge with it yet. Ids of the clones, in the order of `seed.anchors`.
  std::vector<AnchorPoseId> Seed(const MapSeed& seed, const CameraMotion& camera,
                                 const Matrix12d& covariance);

  const FilterOptions& options() const { return options_; }
  int dim() const { return covariance_.dim(); }
  const CameraMotion& camera() const { return camera_; }
  Matrix12d CameraCovariance() const;
  Matrix6d PoseCovariance() const;  // [position (world), rotation (local)]
  /// Copy of the whole covariance, for tests and evaluation.
  Eigen::MatrixXd FullCovariance() const { return covariance_.Full(); }

  /// Read-out time of the rolling shutter as it stands [s]; 0: global shutter.
  double readout_s() const { return readout_s_; }

  std::size_t feature_count() const { return features_.size(); }
  std::size_t anchor_count() const { return anchors_.size(); }
  bool Has(FeatureId id) const { return Find(id) != nullptr; }
  std::vector<FeatureId> FeatureIds() const;
  /// The feature as it stands. `id` must exist.
  AnchoredPoint Point(FeatureId id) const;
  FeatureMarginal Marginal(FeatureId id) const;

  /// Carries the camera `dt` seconds on, in steps of at most 1/30 s up to a second, and in 30 steps
  /// beyond: the cost does not grow with a gap. `head`: what its joints did in
  /// these `dt` seconds, if that is known; then camera()'s velocities are the wearer's alone
  /// (docs/derivations/prediction.md). Velocities given to Reset() and ResetCamera() are the
  /// wearer's wherever the head is known.
  void Predict(double dt, const MotionNoise& noise, const HeadMotion* head = nullptr);
  /// camera(), with velocities that include what the joints do.
  CameraMotion WholeMotion() const;
  /// Widens what is known of the camera's pose and velocities by P += `extra`.
  void Inflate(const Matrix12d& extra);

  /// Clones the camera's pose into the state, fully correlated.
  AnchorPoseId AddAnchor();
  /// Puts a pose into the state that a camera once had and that is known from elsewhere, with an
  /// error of its own: covariance (6 x 6) of [position (world), rotation (local)].
  AnchorPoseId AddAnchor(const Rigid3& world_from_camera, const Matrix6d& covariance);
  /// Starts a feature in a clone. InvalidArgument: unknown anchor, id taken, numbers not usable.
  absl::Status AddFeature(AnchorPoseId anchor, const FeatureBirth& birth);
  /// Removes features (unknown ids are ignored), and the clones that then carry none.
  void Remove(std::span<const FeatureId> ids);

  /// Pixel of a feature at the current camera pose, with its uncertainty; nothing if not in view.
  std::optional<PredictedPixel> Predicted(const CameraModel& camera, FeatureId id) const;
  std::optional<PredictedPixel> Predicted(const CameraModel& camera,
                                          const Eigen::Vector3d& known_point) const;

  /// Corrects everything with the observations of one frame (joint update, slam-spec 2).
  ///
  /// n = dim(), m = 2 * observations.size(): O(n^2 m). Measurements are linearised at
  /// `linearisation`, which may be a better pose than the predicted one (iterated update with that
  /// as its only iterate). Uses the information form when m > n. On error nothing changes:
  ///   InvalidArgument     unknown feature, or one not in view from `linearisation`
  ///   FailedPrecondition  innovation covariance not positive definite
  absl::StatusOr<UpdateReport> Update(const CameraModel& camera,
                                      std::span<const Observation> observations,
                                      const Rigid3& linearisation);

  /// The clone that a feature hangs on. `id` must exist.
  AnchorPoseId AnchorOf(FeatureId id) const { return Find(id)->anchor; }
  /// Nothing if it is not in the state any more.
  std::optional<Rigid3> AnchorPose(AnchorPoseId id) const;
  /// Remembers the present estimates, and from now on what happens to their errors.
  void Mark();
  void DropMark();
  /// Moves the estimates of the mark to better ones, found elsewhere from the same measurements
  /// (docs/derivations/bundle-adjustment.md), and the present ones to where they would be had that
  /// been known then. The covariance is carried along, neither smaller nor larger. Ends the mark;
  /// does nothing without one.
  void Refine(const Refinement& refinement);

  /// From here on errors are counted from this clone: its pose defines the world, and has no error
  /// (docs/derivations/gauge.md; Baarda's S-transformation). Estimates stay, and so does every
  /// uncertainty of one thing seen from another. False, and nothing is done: the clone is unknown,
  /// or Jacobians are at first estimates, which learn nothing of where the world is. O(n^2).
  bool CountErrorsFrom(AnchorPoseId anchor);

  /// Everything is somewhere else in a world that is turned, moved and of another scale: the same
  /// state in other coordinates, to the last correlation (docs/derivations/gauge.md). Ends the
  /// mark. O(n^2).
  void MoveWorld(const Similarity3& world_from_before);

  /// How surely a clone's direction is known from where errors are counted [rad]; unknown: 0.
  double DirectionSigma(AnchorPoseId anchor) const;

  /// Removes features whose inverse range is negative by two sigma; returns them.
  std::vector<FeatureId> RemoveBehind();

 private:
  struct Anchor {
    AnchorPoseId id = 0;
    int offset = 0;
    int users = 0;
    int born = 0;  // updates before it
    Rigid3 pose;
    Rigid3 first;  // estimate that Jacobians use with fej
  };
  struct Feature {
    FeatureId id = 0;
    int offset = 0;
    AnchorPoseId anchor = 0;
    PointInClone point, first;
    Eigen::Matrix2d birth_covariance = Eigen::Matrix2d::Zero();  // of the bearing, as first seen
  };
  struct Linearised;  // of all observations: update.cpp

  bool Fej() const { return options_.fej || updates_ <= options_.fej_updates; }
  const Feature* Find(FeatureId id) const;
  const Anchor& AnchorOf(const Feature& feature) const;
  AnchoredPoint Point(const Feature& feature, bool first) const;
  /// Pixel at the current estimates, Jacobians where the options say.
  std::optional<PixelPrediction> Linearise(const CameraModel& camera, const Rigid3& pose,
                                           const Feature& feature) const;
  /// One step of the camera, whatever moved it.
  void Follow(const MotionModel::Step& step);
  void RemoveRows(const std::vector<std::pair<int, int>>& offset_and_size);
  struct HeadRate;
  HeadRate RateOf(const HeadMotion& head, double dt) const;
  void ChangeVelocities(double sign, const HeadRate& rate);
  absl::StatusOr<Linearised> LineariseAll(const CameraModel& camera,
                                          std::span<const Observation> observations,
                                          const Rigid3& linearisation,
                                          const Eigen::VectorXd& step) const;
  /// From the estimates to where they are linearised: the camera at `linearisation`, everything
  /// else where the filter expects it then.
  Eigen::VectorXd StepTo(const Rigid3& linearisation) const;
  AnchoredPoint MovedPoint(const Feature& feature, const Eigen::VectorXd& step) const;
  /// The matches of one clone, explained by a turn alone.
  struct Turned {
    TurnMisfit misfit;
    int age = 0;              // updates since the clone was made
    std::vector<int> ranges;  // offsets of the inverse ranges
  };
  std::vector<Turned> ExplainByTurning(const CameraModel& camera,
                                       std::span<const Observation> observations,
                                       const Rigid3& linearisation) const;
  /// Of each of their ranges, in order, the share of its gain that is not taken.
  Eigen::VectorXd KeptShares(const std::vector<Turned>& turned) const;
  void JudgeNoise(const UpdateReport& report);
  /// Both: the errors to correct; `gain` and `factor` as the journal wants them.
  absl::StatusOr<Eigen::VectorXd> KalmanStep(const Linearised& all, UpdateReport& report,
                                             Journal::Updated& record);
  absl::StatusOr<Eigen::VectorXd> InformationStep(const Linearised& all, UpdateReport& report,
                                                  Journal::Updated& record);
  void Correct(const Eigen::VectorXd& error);
  /// Carries the covariance along when estimates move by `step`: a scale error then moves them by
  /// what they are now, not by what they were (docs/derivations/scale.md).
  void CarryScale(const Eigen::VectorXd& step);

  /// Estimates as they were, and how their errors have changed since.
  struct Marked {
    CameraMotion camera;
    std::vector<Anchor> anchors;
    std::vector<Feature> features;
    int dim = 0;
    Journal journal;
  };
  std::optional<Marked> mark_;
  /// The joints' own part of the camera's velocities, which camera_ is without.
  struct HeadRate {
    Eigen::Matrix<double, 6, 1> rate = Eigen::Matrix<double, 6, 1>::Zero();
    Matrix6d covariance = Matrix6d::Zero();
  };
  std::optional<HeadRate> head_;  // none: it was unknown, camera_'s velocities are whole

  FilterOptions options_;
  const PointParametrisation* form_ = &BearingRange();
  const MotionModel* motion_ = &ConstantVelocity();
  CameraMotion camera_;
  Rigid3 first_pose_;
  std::vector<Anchor> anchors_;    // rising ids
  std::vector<Feature> features_;  // rising ids
  AnchorPoseId next_anchor_ = 1;
  double readout_s_ = 0.0;
  int readout_offset_ = -1;   // -1: not estimated
  int updates_ = 0;           // since Reset()
  int judged_ = 0;            // updates that told of the noise
  double noise_scale_ = 1.0;  // of matches' errors against their R, squared; up to 1
  Covariance covariance_;
};

}  // namespace saccade
