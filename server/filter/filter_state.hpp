#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Dense>
#include <map>
#include <optional>
#include <ranges>
#include <span>
#include <vector>

#include "server/filter/covariance.hpp"
#include "server/filter/depth_particles.hpp"
#include "server/filter/filter_types.hpp"
#include "server/filter/inertial_start.hpp"
#include "server/filter/journal.hpp"
#include "server/filter/parallax.hpp"
#include "server/filter/point_parametrisation.hpp"
#include "server/filter/state_layout.hpp"
#include "shared/camera/camera_model.hpp"
#include "shared/geometry/similarity3.hpp"

namespace saccade {

/// State and joint covariance of cameras, moving (robots) or not, and what they see (slam-spec 1,
/// 2, 5.4, 11).
///
/// Blocks: each robot as its motion model has it, its read-out time, if estimated; pose clones 6
/// each and features 3 or 1 each, as they were born. What shares no knowledge stands in islands
/// apart, which cost and do what filters of their own would; a robot that sees another's feature
/// joins the two. Calls without a robot mean the first. The covariance is private:
/// docs/derivations/state.md lists the calls that change it, and how. Not thread-safe.
class FilterState {
 public:
  static constexpr int kPoseDim = 6;

  explicit FilterState(const FilterOptions& options);

  /// Forgets everything, further robots, too; the camera is at `camera`, known to `covariance`.
  void Reset(const CameraMotion& camera, const Matrix12d& covariance);
  /// Puts the camera elsewhere, without knowledge shared with the map (slam-spec 6).
  void ResetCamera(const CameraMotion& camera, const Matrix12d& covariance,
                   RobotId robot = kFirstRobot);

  /// A further robot, or a camera that stands still; it shares nothing with the rest yet.
  RobotId AddRobot(const CameraMotion& camera, const Matrix12d& covariance,
                   const RobotOptions& options = RobotOptions());
  /// A robot leaves; what it has found stays. The first one, and an unknown one: nothing is done.
  void RemoveRobot(RobotId robot);
  bool HasRobot(RobotId robot) const;

  /// Forgets everything and takes a map over, as one whose first troubles are behind it; the camera
  /// shares no knowledge with it yet. Ids of the clones, in the order of `seed.clones`.
  std::vector<CloneId> Seed(const MapSeed& seed, const CameraMotion& camera,
                            const Matrix12d& covariance);

  const FilterOptions& options() const { return options_; }
  int dim() const { return layout_.dim(); }
  const StateLayout& layout() const { return layout_; }
  /// Of a robot, which must exist, as wherever one is named below.
  const CameraMotion& camera(RobotId robot = kFirstRobot) const { return Of(robot).motion; }
  Matrix12d CameraCovariance(RobotId robot = kFirstRobot) const;
  Matrix6d PoseCovariance(RobotId robot = kFirstRobot) const;  // [position (world), rotation]
  /// camera(), with velocities that include what the joints do.
  CameraMotion WholeMotion(RobotId robot = kFirstRobot) const;
  /// Read-out time of the rolling shutter as it stands [s]; 0: global shutter.
  double readout_s(RobotId robot = kFirstRobot) const { return Of(robot).readout_s; }
  /// Copy of the whole covariance, island by island, for tests and evaluation.
  Eigen::MatrixXd FullCovariance() const;

  std::size_t feature_count() const { return features_.size(); }
  std::size_t clone_count() const { return clones_.size(); }
  bool Has(FeatureId id) const { return Find(id) != nullptr; }
  std::vector<FeatureId> FeatureIds() const;
  /// The feature as it stands. `id` must exist.
  PointFromClone Point(FeatureId id) const;
  /// `covariance_in_camera` is that of `robot`.
  FeatureMarginal Marginal(FeatureId id, RobotId robot = kFirstRobot) const;

  /// Carries the camera `dt` seconds on, in steps of at most 1/30 s up to a second, and in 30 steps
  /// beyond: the cost does not grow with a gap. `head`: what its joints did in these `dt` seconds,
  /// if that is known; then camera()'s velocities are the wearer's alone
  /// (docs/derivations/prediction.md). Velocities given to Reset() and ResetCamera() are the
  /// wearer's wherever the head is known. Other robots stay where they are.
  void Predict(double dt, const MotionNoise& noise, const HeadMotion* head = nullptr,
               RobotId robot = kFirstRobot);
  /// The robot's motion is measured by an inertial unit from here on. `solution` is of the present
  /// pose, in this world, which has become metric by it (MoveWorld): that the unit of length is
  /// known to scale_sigma only makes everything uncertain as it is away from `origin`. Ends the
  /// checkpoint.
  void StartInertial(const InertialSolution& solution, const Eigen::Vector3d& origin,
                     RobotId robot = kFirstRobot);
  bool inertial(RobotId robot = kFirstRobot) const;
  /// As Predict(), by samples where they cover the step (true), by M1 with `noise` where not.
  bool PredictInertial(const ImuStep& step, const MotionNoise& noise, RobotId robot = kFirstRobot);
  /// Of the errors of inertial(), as InertialErrors.
  Eigen::MatrixXd InertialCovariance(RobotId robot = kFirstRobot) const;
  /// Widens what is known of the camera's pose and velocities by P += `extra`.
  void Inflate(const Matrix12d& extra, RobotId robot = kFirstRobot);

  /// Clones the camera's pose into the state, fully correlated.
  CloneId AddClone(RobotId robot = kFirstRobot);
  /// Puts a pose into the state that a camera once had and that is known from elsewhere, with an
  /// error of its own: covariance (6 x 6) of [position (world), rotation (local)]. It enters the
  /// island of `robot`.
  CloneId AddClone(const Rigid3& world_from_camera, const Matrix6d& covariance,
                   RobotId robot = kFirstRobot);
  /// Puts the pose of a thing into the state that was given a place elsewhere, with an error of its
  /// own, as above; it stays until Reset() or Seed(). Its own points are observed as
  /// Observation::marker says. For a place that comes from the same pictures `covariance` should be
  /// wide: the first update ties it to the camera (slam-spec 6, 7).
  CloneId AddMarker(const Rigid3& world_from_marker, const Matrix6d& covariance,
                    RobotId robot = kFirstRobot);
  /// Starts a feature in a clone. InvalidArgument: unknown clone, id taken, numbers not usable.
  absl::Status AddFeature(CloneId clone, const FeatureBirth& birth);
  /// What is known of where a feature can be, whatever its range; nothing if it is not there. For a
  /// range that is sought outside the filter (depth_particles): until TellRange() it should see no
  /// update, so that the range knows nothing of the rest.
  std::optional<DepthLine> LineOf(FeatureId id, RobotId robot = kFirstRobot) const;
  /// Its range as found elsewhere [1/m], in place of what the filter knew of it. `id` must exist.
  void TellRange(FeatureId id, double inverse_range, double sigma);
  /// Removes features (unknown ids are ignored), and the clones that then carry none.
  void Remove(std::span<const FeatureId> ids);

  /// Pixel of a feature at the current camera pose, with its uncertainty; nothing if not in view.
  std::optional<PredictedPixel> Predicted(const CameraModel& camera, FeatureId id,
                                          RobotId robot = kFirstRobot) const;
  std::optional<PredictedPixel> Predicted(const CameraModel& camera,
                                          const Eigen::Vector3d& known_point,
                                          RobotId robot = kFirstRobot) const;

  /// Corrects everything that shares knowledge with `robot` with the observations of one frame of
  /// its (joint update, slam-spec 2). Islands of which it sees features are joined with its own.
  ///
  /// n = rows of its island, m = 2 * observations.size(): O(n^2 m). Measurements are linearised at
  /// `linearisation`, which may be a better pose than the predicted one (iterated update with that
  /// as its only iterate). Uses the information form when m > n. On error nothing changes:
  ///   InvalidArgument     unknown robot or feature, or one not in view from `linearisation`
  ///   FailedPrecondition  innovation covariance not positive definite
  absl::StatusOr<UpdateReport> Update(const CameraModel& camera,
                                      std::span<const Observation> observations,
                                      const Rigid3& linearisation, RobotId robot = kFirstRobot);

  /// The clone that a feature hangs on. `id` must exist.
  CloneId CloneOf(FeatureId id) const { return Find(id)->clone; }
  /// Nothing if it is not in the state any more.
  std::optional<Rigid3> ClonePose(CloneId id) const;
  /// Remembers the present estimates of a robot's island, and from now on what happens to their
  /// errors, until the island is joined with another.
  void SetCheckpoint(RobotId robot = kFirstRobot);
  void DropCheckpoint(RobotId robot = kFirstRobot);
  /// Moves the estimates of the checkpoint to better ones, found elsewhere from the same
  /// measurements (docs/derivations/bundle-adjustment.md), and the present ones to where they would
  /// be had that been known then. The covariance is carried along, neither smaller nor larger. Ends
  /// the checkpoint; does nothing without one.
  void Refine(const Refinement& refinement, RobotId robot = kFirstRobot);

  /// From here on errors are counted from this clone: its pose defines the world, and has no error
  /// (docs/derivations/gauge.md; Baarda's S-transformation). Estimates stay, and so does every
  /// uncertainty of one thing seen from another. Of its island alone. False, and nothing is done:
  /// the clone is unknown, or Jacobians are at first estimates, which learn nothing of where the
  /// world is. O(n^2).
  bool CountErrorsFrom(CloneId clone);

  /// Everything in the robot's island is somewhere else in a world that is turned, moved and of
  /// another scale: the same state in other coordinates, to the last correlation
  /// (docs/derivations/gauge.md). Ends the checkpoint. O(n^2).
  void MoveWorld(const Similarity3& world_from_before, RobotId robot = kFirstRobot);

  /// How surely a clone's direction is known from where errors are counted [rad]; unknown: 0.
  double DirectionSigma(CloneId clone) const;

  /// Removes features whose inverse range is negative by two sigma; returns them.
  std::vector<FeatureId> RemoveBehind();

 private:
  /// The joints' own part of a camera's velocities.
  struct HeadRate {
    Eigen::Matrix<double, 6, 1> rate = Eigen::Matrix<double, 6, 1>::Zero();
    Matrix6d covariance = Matrix6d::Zero();
  };
  struct Robot {
    RobotId id = kFirstRobot;
    BlockId block = kNoBlock, readout = kNoBlock;
    const MotionModel* model = &ConstantVelocity();
    CameraMotion motion;
    Rigid3 first_pose;
    std::optional<HeadRate> head;  // that motion is without; none: it was unknown
    double readout_s = 0.0;
    int judged = 0;            // updates that told of the noise
    double noise_scale = 1.0;  // of matches' errors against their R, squared; up to 1
  };
  struct Clone {
    CloneId id = 0;
    BlockId block = kNoBlock;
    int users = 0;
    int born = 0;  // updates before it
    Rigid3 pose;
    Rigid3 first;  // estimate that Jacobians use with fej
  };
  struct Feature {
    FeatureId id = 0;
    BlockId block = kNoBlock;
    CloneId clone = 0;
    PointInClone point, first;
    Eigen::Matrix2d birth_covariance = Eigen::Matrix2d::Zero();  // of the bearing, as first seen
  };
  /// Estimates as they were, and how their errors have changed since.
  struct Checkpoint {
    StateLayout layout;
    Robot robot;
    std::vector<Clone> clones;
    std::vector<Feature> features;
    Journal journal;
  };
  /// What shares knowledge.
  struct Island {
    Covariance p;
    int updates = 0;  // since it began
    std::optional<Checkpoint> checkpoint;
  };
  /// Sparse measurement model of one frame: two rows an observation, three blocks each.
  struct Linearised {
    struct Rows : Journal::Updated::Rows {
      Eigen::Matrix2d noise;
    };
    int camera = 0, readout = -1;  // offsets
    std::vector<Rows> rows;
    Eigen::VectorXd innovation;
  };
  /// The matches of one clone, explained by a turn alone.
  struct Turned {
    TurnMisfit misfit;
    int age = 0;              // updates since the clone was made
    std::vector<int> ranges;  // offsets of the inverse ranges
  };

  bool Fej(int island) const {
    return options_.fej || IslandAt(island).updates <= options_.fej_updates;
  }
  Robot& Of(RobotId id);
  const Robot& Of(RobotId id) const;
  const Feature* Find(FeatureId id) const;
  const Clone* FindClone(CloneId id) const;
  const Clone& CloneOf(const Feature& feature) const { return *FindClone(feature.clone); }
  int At(BlockId id) const { return layout_[id].offset; }
  int IslandOf(BlockId id) const { return layout_[id].island; }
  Island& IslandAt(int island) { return islands_[static_cast<std::size_t>(island)]; }
  const Island& IslandAt(int island) const { return islands_[static_cast<std::size_t>(island)]; }
  /// Those of robots, clones or features that are in an island.
  template <typename Items>
  auto In(int island, Items& items) const {
    return std::views::filter(
        items, [this, island](const auto& each) { return IslandOf(each.block) == island; });
  }

  // Blocks come and go: births.cpp.
  BlockId Append(BlockKind kind, int size, int island);
  void RemoveBlocks(std::span<const BlockId> gone);
  void Join(int into, int from);

  // Prediction: motion.cpp.
  void Follow(const MotionModel::Step& step, Robot& robot);
  static HeadRate RateOf(const HeadMotion& head, double dt, const Robot& robot);
  void ChangeVelocities(double sign, Robot& robot);
  // Inertial: inertial.cpp.
  /// What everything in an island errs by where the world's unit is wrong, by its logarithm.
  Eigen::VectorXd ScaleDirection(int island, const Eigen::Vector3d& origin) const;

  // Where things are seen: prediction.cpp.
  PointFromClone Point(const Feature& feature, bool first) const;
  /// Pixel at the current estimates, Jacobians where the options say.
  std::optional<PixelPrediction> Linearise(const CameraModel& camera, const Robot& robot,
                                           const Feature& feature) const;
  /// Covariance of [camera pose, clone, point].
  using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 15, 15>;
  SmallMatrix Gather(const Robot& robot, const Clone& clone, const Feature& feature) const;

  // Measurement model: linearise.cpp.
  absl::Status JoinSeen(std::span<const Observation> observations, RobotId robot);
  absl::StatusOr<Linearised> LineariseAll(const CameraModel& camera,
                                          std::span<const Observation> observations,
                                          const Rigid3& linearisation, const Eigen::VectorXd& step,
                                          const Robot& robot) const;
  /// One match of a feature with everything moved by `step`; `ahead`: H of clone and point by it.
  std::optional<PixelPrediction> LineariseOne(const CameraModel& camera, const Feature& feature,
                                              const Rigid3& linearisation,
                                              const Eigen::VectorXd& step, Linearised::Rows& rows,
                                              Eigen::Vector2d& ahead) const;
  /// The same for a point of a marker.
  std::optional<PixelPrediction> LineariseMarker(
      const CameraModel& camera, const Observation& observation, const Rigid3& linearisation,
      const Eigen::VectorXd& step, Linearised::Rows& rows, Eigen::Vector2d& ahead) const;
  /// From the estimates to where they are linearised: the camera at `linearisation`, everything
  /// else where the filter expects it then.
  Eigen::VectorXd StepTo(const Rigid3& linearisation, const Robot& robot) const;
  PointFromClone MovedPoint(const Feature& feature, const Eigen::VectorXd& step) const;
  std::vector<Turned> ExplainByTurning(const CameraModel& camera,
                                       std::span<const Observation> observations,
                                       const Rigid3& linearisation) const;

  // Update: update.cpp.
  /// Of each of their ranges, in order, the share of its gain that is not taken.
  Eigen::VectorXd KeptShares(const std::vector<Turned>& turned, const Robot& robot) const;
  static void JudgeNoise(const UpdateReport& report, Robot& robot);
  /// Both: the errors to correct; `gain` and `factor` as the journal wants them.
  static absl::StatusOr<Eigen::VectorXd> KalmanStep(const Linearised& all, Island& island,
                                                    UpdateReport& report, Journal::Updated& record);
  static absl::StatusOr<Eigen::VectorXd> InformationStep(const Linearised& all, Island& island,
                                                         UpdateReport& report,
                                                         Journal::Updated& record);

  // Correction: correct.cpp.
  void Correct(const Eigen::VectorXd& error, int island);
  /// Carries the covariance along when estimates move by `step`: a scale error then moves them by
  /// what they are now, not by what they were (docs/derivations/scale.md).
  void CarryScale(const Eigen::VectorXd& step, int island);

  FilterOptions options_;
  const PointParametrisation* form_;
  StateLayout layout_;
  std::vector<Island> islands_;
  std::vector<Robot> robots_;      // rising ids
  std::vector<Clone> clones_;      // rising ids
  std::vector<Feature> features_;  // rising ids
  RobotId next_robot_ = kFirstRobot;
  CloneId next_clone_ = 1;
};

}  // namespace saccade
