// T35: robots in one filter that share nothing are as if each had its own, in what comes out and in
// what it costs; and what happens when they do share something.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <ctime>

#include "server/filter/filter_state.hpp"
#include "server/filter/robust_pose.hpp"
#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::joint_filter_test {
namespace {

constexpr double kNoise_px = 0.5;
constexpr FeatureId kOthers = 10'000;  // ids of the second wearer's features begin here

Matrix12d StartCovariance() {
  Vector12d sigma;
  sigma << Eigen::Vector3d::Constant(0.02), Eigen::Vector3d::Constant(0.01),
      Eigen::Vector3d::Constant(0.3), Eigen::Vector3d::Constant(0.5);
  return sigma.cwiseAbs2().asDiagonal();
}

CameraMotion StandingAt(const Rigid3& pose) {
  CameraMotion motion;
  motion.world_from_camera = pose;
  return motion;
}

/// Somebody who sways before things of his own and does, by chance, all that a tracker does with a
/// filter. What he does depends on his seed and on what the filter says of him alone.
class Wearer {
 public:
  Wearer(std::uint64_t seed, FilterState& filter, RobotId robot, FeatureId first_id)
      : world_(seed), lens_(TestCamera()), filter_(filter), robot_(robot), first_id_(first_id) {
    phase_ = world_.Uniform(0, 6);
    truth_ = Truth(0.0);
    filter_.ResetCamera(StandingAt(truth_), StartCovariance(), robot_);
    for (int k = 0; k < 60; ++k) {
      points_.push_back(world_.Uniform(1.0, 4.0) *
                        *lens_.Unproject({world_.Uniform(60, 580), world_.Uniform(60, 420)}));
    }
  }

  Rigid3 Truth(double t) const {
    const double s = t + phase_;
    return {ExpQuaternion({0.1 * std::sin(1.1 * s), 0.12 * std::sin(0.9 * s), 0.05 * std::sin(s)}),
            {0.2 * std::sin(0.8 * s), 0.1 * std::sin(1.3 * s), 0.1 * std::sin(0.6 * s)}};
  }

  void Step() {
    const double dt = world_.Uniform(0, 1) < 0.1 ? 0.1 : 1.0 / 30;
    const Rigid3 before = truth_;
    truth_ = Truth(time_ += dt);
    Move(dt, before);
    const std::vector<Observation> seen = See();
    const auto report = filter_.Update(lens_, seen, PoseFrom(seen), robot_);
    ASSERT_TRUE(report.ok()) << report.status();
    if (frame_ % 6 == 0) Birth();
    if (frame_ % 17 == 5 && !mine_.empty()) {
      const std::size_t gone = static_cast<std::size_t>(world_.Uniform(0, 0.999) * mine_.size());
      filter_.Remove(std::vector<FeatureId>{mine_[gone]});
      mine_.erase(mine_.begin() + static_cast<std::ptrdiff_t>(gone));
    }
    Keep();
    ++frame_;
  }

  std::vector<Observation> See() {
    std::vector<Observation> seen;
    for (const FeatureId id : mine_) {
      const auto pixel = lens_.Project(truth_.Inverse() * points_[(id - first_id_) % 60]);
      if (!pixel || !lens_.InImage(*pixel) || !filter_.Predicted(lens_, id, robot_)) continue;
      Observation observation;
      observation.id = id;
      observation.pixel = *pixel + world_.NormalVector<2>(kNoise_px);
      observation.noise = kNoise_px * kNoise_px * Eigen::Matrix2d::Identity();
      observation.d_readout = world_.NormalVector<2>(30.0);
      seen.push_back(observation);
    }
    return seen;
  }

  Rigid3 PoseFrom(const std::vector<Observation>& seen) {
    std::vector<PoseEvidence> evidence;
    for (const Observation& each : seen) {
      evidence.push_back({filter_.Point(each.id), *filter_.Predicted(lens_, each.id, robot_),
                          each.pixel, each.noise});
    }
    const PosePrior prior{filter_.camera(robot_).world_from_camera, filter_.PoseCovariance(robot_)};
    return EstimateRobustPose(lens_, prior, evidence, RobustPoseOptions(), world_.engine())
        .world_from_camera;
  }

  const CameraModel& lens() const { return lens_; }
  const std::vector<FeatureId>& mine() const { return mine_; }
  const Rigid3& truth() const { return truth_; }
  const Eigen::Vector3d& PointOf(FeatureId id) const { return points_[(id - first_id_) % 60]; }

 private:
  /// Half of the time a head carries the camera.
  void Move(double dt, const Rigid3& before) {
    if (frame_ / 40 % 2 == 0) {
      filter_.Predict(dt, MotionNoise(), nullptr, robot_);
      return;
    }
    HeadMotion head;
    const Rigid3 moved = before.Inverse() * truth_;
    head.camera_from_next.rotation = ExpQuaternion(0.8 * LogQuaternion(moved.rotation));
    head.covariance = 1e-8 * Matrix6d::Identity();
    filter_.Predict(dt, MotionNoise(), &head, robot_);
  }

  void Birth() {
    const CloneId clone = filter_.AddClone(robot_);
    for (int k = 0; k < 6 && mine_.size() < 30; ++k) {
      const Eigen::Vector3d& point = points_[born_ % 60];
      const auto pixel = lens_.Project(truth_.Inverse() * point);
      const FeatureId id = first_id_ + born_++;
      if (!pixel || !lens_.InImage(*pixel)) continue;
      FeatureBirth birth;
      Eigen::Matrix<double, 3, 2> d_bearing;
      birth.id = id;
      birth.bearing = *lens_.Unproject(*pixel + world_.NormalVector<2>(kNoise_px), &d_bearing);
      birth.bearing_covariance = kNoise_px * kNoise_px * d_bearing * d_bearing.transpose();
      const double range = (truth_.Inverse() * point).norm();
      birth.inverse_range = std::max(0.05, (1.0 + world_.Normal(0.2)) / range);
      birth.inverse_range_sigma = 0.25 / range;
      ASSERT_TRUE(filter_.AddFeature(clone, birth).ok());
      mine_.push_back(id);
    }
    std::sort(mine_.begin(), mine_.end());
    filter_.Remove({});  // the clone, if nothing was born
  }

  /// What comes now and then: an adjustment, another home, another world, a relocalisation.
  void Keep() {
    if (frame_ % 50 == 20) filter_.SetCheckpoint(robot_);
    if (frame_ % 50 == 30) {
      Refinement better;
      for (const FeatureId id : mine_) {
        const PointFromClone point = filter_.Point(id);
        better.features[id] = {point.bearing, 1.01 * point.inverse_range};
      }
      filter_.Refine(better, robot_);
    }
    if (frame_ % 80 == 79) filter_.CountErrorsFrom(filter_.CloneOf(mine_.front()));
    if (frame_ == 130) {
      const Similarity3 moved{1.1, ExpQuaternion({0.1, -0.2, 0.05}), {0.5, -0.1, 0.2}};
      filter_.MoveWorld(moved, robot_);
      filter_.MoveWorld(moved.Inverse(), robot_);
    }
    if (frame_ == 190) {
      filter_.ResetCamera(StandingAt(filter_.camera(robot_).world_from_camera), StartCovariance(),
                          robot_);
    }
  }

  RandomWorld world_;
  CameraModel lens_;
  FilterState& filter_;
  const RobotId robot_;
  const FeatureId first_id_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<FeatureId> mine_;
  Rigid3 truth_;
  double phase_ = 0.0, time_ = 0.0;
  int frame_ = 0;
  FeatureId born_ = 0;
};

FilterOptions Options(PointForm form) {
  FilterOptions options;
  options.form = form;
  options.readout_s = 0.01;
  options.readout_sigma_s = 0.005;
  return options;
}

/// A filter of one wearer, or of two.
struct Joint {
  explicit Joint(PointForm form) : filter(Options(form)) {
    filter.Reset(CameraMotion(), StartCovariance());
    second = filter.AddRobot(CameraMotion(), StartCovariance(),
                             {.readout_s = 0.01, .readout_sigma_s = 0.005});
  }
  FilterState filter;
  RobotId second = 0;
};
struct Single {
  explicit Single(PointForm form) : filter(Options(form)) {
    filter.Reset(CameraMotion(), StartCovariance());
  }
  FilterState filter;
};

double Apart(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  if (a.rows() != b.rows()) return 1e9;
  return (a - b).cwiseAbs().maxCoeff();
}

Eigen::VectorXd Numbers(const CameraMotion& motion) {
  Eigen::VectorXd all(13);
  all << motion.world_from_camera.translation, motion.world_from_camera.rotation.coeffs(),
      motion.velocity_m_s, motion.angular_velocity_rad_s;
  return all;
}

TEST(JointFilter, TwoRobotsThatShareNothingEqualTwoFiltersT35) {
  for (const PointForm form : {PointForm::kBearingRange, PointForm::kRangeOnly}) {
    Joint joint(form);
    Single a(form), b(form);
    Wearer first(1, joint.filter, kFirstRobot, 1), second(2, joint.filter, joint.second, kOthers);
    Wearer alone(1, a.filter, kFirstRobot, 1), other(2, b.filter, kFirstRobot, kOthers);
    double worst = 0.0;
    for (int k = 0; k < 300; ++k) {
      first.Step();
      if (k % 5 != 3) second.Step();  // not at the same rate
      alone.Step();
      if (k % 5 != 3) other.Step();
      const int n = a.filter.dim(), m = b.filter.dim();
      ASSERT_EQ(joint.filter.dim(), n + m) << k;
      const Eigen::MatrixXd all = joint.filter.FullCovariance();
      worst =
          std::max({worst, Apart(all.topLeftCorner(n, n), a.filter.FullCovariance()),
                    Apart(all.bottomRightCorner(m, m), b.filter.FullCovariance()),
                    Apart(Numbers(joint.filter.camera()), Numbers(a.filter.camera())),
                    Apart(Numbers(joint.filter.camera(joint.second)), Numbers(b.filter.camera())),
                    std::abs(joint.filter.readout_s() - a.filter.readout_s()),
                    std::abs(joint.filter.readout_s(joint.second) - b.filter.readout_s())});
      ASSERT_EQ(all.bottomLeftCorner(m, n).cwiseAbs().maxCoeff(), 0.0);
      for (const FeatureId id : alone.mine()) {
        worst = std::max(worst, Apart(joint.filter.Marginal(id).covariance_in_camera,
                                      a.filter.Marginal(id).covariance_in_camera));
      }
      for (const FeatureId id : other.mine()) {
        worst = std::max(worst, Apart(joint.filter.Marginal(id, joint.second).covariance_in_camera,
                                      b.filter.Marginal(id).covariance_in_camera));
      }
      ASSERT_LT(worst, 1e-9) << k;
    }
    EXPECT_GT(alone.mine().size(), 20u);
    EXPECT_LT((a.filter.camera().world_from_camera.translation - alone.truth().translation).norm(),
              0.3)
        << "the filters must have worked";
    std::printf("%s: largest difference %.3g\n", form == PointForm::kBearingRange ? "SID" : "ESID",
                worst);
  }
}

TEST(JointFilter, ARobotThatNobodySeesChangesNothingToTheByteT35) {
  Joint joint(PointForm::kBearingRange);
  Single single(PointForm::kBearingRange);
  Wearer first(3, joint.filter, kFirstRobot, 1), alone(3, single.filter, kFirstRobot, 1);
  const Matrix12d before = joint.filter.CameraCovariance(joint.second);
  for (int k = 0; k < 250; ++k) {
    joint.filter.Predict(1.0 / 30, MotionNoise(), nullptr, joint.second);
    first.Step();
    alone.Step();
  }
  const int n = single.filter.dim();
  EXPECT_EQ(Eigen::MatrixXd(joint.filter.FullCovariance().topLeftCorner(n, n)),
            single.filter.FullCovariance());
  EXPECT_EQ(Numbers(joint.filter.camera()), Numbers(single.filter.camera()));
  for (const FeatureId id : alone.mine()) {
    EXPECT_EQ(joint.filter.Marginal(id).point_in_world, single.filter.Marginal(id).point_in_world);
  }
  EXPECT_GT(joint.filter.CameraCovariance(joint.second).trace(), before.trace());
}

TEST(JointFilter, SharingNothingCostsWhatTwoFiltersDoT35) {
  // The bar is 1.1 and saccade-bench's to hold; a test shares its machine.
  Joint joint(PointForm::kBearingRange);
  Single a(PointForm::kBearingRange), b(PointForm::kBearingRange);
  Wearer first(1, joint.filter, kFirstRobot, 1), second(2, joint.filter, joint.second, kOthers);
  Wearer alone(1, a.filter, kFirstRobot, 1), other(2, b.filter, kFirstRobot, kOthers);
  std::vector<double> ratios;
  for (int k = 0; k < 200; ++k) {
    const std::clock_t begin = std::clock();
    first.Step(), second.Step();
    const std::clock_t middle = std::clock();
    alone.Step(), other.Step();
    const std::clock_t end = std::clock();
    ratios.push_back(static_cast<double>(middle - begin) / static_cast<double>(end - middle));
  }
  std::nth_element(ratios.begin(), ratios.begin() + 100, ratios.end());
  std::printf("joint / two filters: %.3f\n", ratios[100]);
  EXPECT_LT(ratios[100], 1.3);
}

TEST(JointFilter, SeeingAnothersFeatureSharesKnowledgeAsTheTextbookHasIt) {
  Joint joint(PointForm::kBearingRange);
  FilterState& filter = joint.filter;
  Wearer first(1, filter, kFirstRobot, 1), second(2, filter, joint.second, kOthers);
  for (int k = 0; k < 120; ++k) first.Step(), second.Step();
  const FeatureId id = first.mine().front();
  const Matrix6d before = filter.PoseCovariance(joint.second);
  const auto predicted = filter.Predicted(first.lens(), id, joint.second);
  ASSERT_TRUE(predicted);
  Observation seen;
  seen.id = id;
  seen.pixel = predicted->at.pixel + Eigen::Vector2d(1.0, -1.0);
  const Eigen::Matrix2d s = predicted->covariance + seen.noise;
  const auto& h = predicted->with_camera;
  const Matrix6d expected = before - h.transpose() * s.inverse() * h;
  const int n = filter.dim(), at = filter.layout().dim(0);
  EXPECT_EQ(filter.FullCovariance().bottomLeftCorner(n - at, at).norm(), 0.0);
  ASSERT_TRUE(filter
                  .Update(first.lens(), std::vector<Observation>{seen},
                          filter.camera(joint.second).world_from_camera, joint.second)
                  .ok());
  EXPECT_EQ(filter.dim(), n);
  EXPECT_EQ(filter.layout().dim(0), 0) << "one island is left";
  const Matrix6d after = filter.PoseCovariance(joint.second);
  EXPECT_LT(RelativeError(Matrix6d(expected.topLeftCorner<6, 6>()), after), 0.05);
  EXPECT_LT(after.trace(), before.trace());
  const Eigen::MatrixXd p = filter.FullCovariance();
  EXPECT_GT(p.block(0, n - at, n - at, at).norm(), 0.0);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(p).eigenvalues().minCoeff(),
            -1e-12 * p.trace());
  // They go on together: each with own things, in one island.
  for (int k = 0; k < 30; ++k) first.Step(), second.Step();
  const Eigen::MatrixXd later = filter.FullCovariance();
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(later).eigenvalues().minCoeff(),
            -1e-12 * later.trace());
}

TEST(JointFilter, ACameraThatStandsStillIsFoundByWhatItSees) {
  Single one(PointForm::kBearingRange);
  FilterState& filter = one.filter;
  Wearer wearer(5, filter, kFirstRobot, 1);
  for (int k = 0; k < 150; ++k) wearer.Step();
  const Rigid3 camera_now = filter.camera().world_from_camera;
  const Rigid3 placed = {camera_now.rotation * ExpQuaternion({0.02, -0.02, 0.01}),
                         camera_now.translation + Eigen::Vector3d(0.03, 0.02, -0.03)};
  Vector12d sigma = Vector12d::Zero();
  sigma.head<6>() << 0.05, 0.05, 0.05, 0.03, 0.03, 0.03;
  const RobotId fixed = filter.AddRobot(StandingAt(placed), sigma.cwiseAbs2().asDiagonal(),
                                        {.motion = &StandingStill()});
  EXPECT_EQ(filter.layout().dim(1), 6);
  filter.Predict(10.0, MotionNoise(), nullptr, fixed);
  EXPECT_EQ(filter.CameraCovariance(fixed).diagonal(), sigma.cwiseAbs2());
  const double before = (placed.translation - camera_now.translation).norm();
  // It sees the map's points from where the wearer's camera is thought to be.
  RandomWorld world(6);
  for (int k = 0; k < 20; ++k) {
    std::vector<Observation> seen;
    for (const FeatureId id : wearer.mine()) {
      const auto at = PixelFromClone(wearer.lens(), camera_now, filter.Point(id));
      if (!at || !wearer.lens().InImage(*at) || !filter.Predicted(wearer.lens(), id, fixed)) {
        continue;
      }
      Observation observation;
      observation.id = id;
      observation.pixel = *at + world.NormalVector<2>(0.3);
      observation.noise = 0.09 * Eigen::Matrix2d::Identity();
      seen.push_back(observation);
    }
    ASSERT_GT(seen.size(), 8u);
    ASSERT_TRUE(
        filter.Update(wearer.lens(), seen, filter.camera(fixed).world_from_camera, fixed).ok());
  }
  const Rigid3 found = filter.camera(fixed).world_from_camera;
  EXPECT_LT((found.translation - camera_now.translation).norm(), 0.2 * before);
  EXPECT_LT(RotationAngle(found, camera_now), 0.004);
  EXPECT_LT(filter.PoseCovariance(fixed).trace(), 0.2 * sigma.squaredNorm());
}

TEST(JointFilter, RobotsComeAndGo) {
  Joint joint(PointForm::kBearingRange);
  FilterState& filter = joint.filter;
  Wearer first(1, filter, kFirstRobot, 1), second(2, filter, joint.second, kOthers);
  for (int k = 0; k < 40; ++k) first.Step(), second.Step();
  const Eigen::MatrixXd before = filter.FullCovariance();
  const int own = filter.layout().dim(0), of_second = filter.layout().dim(1);
  filter.RemoveRobot(kFirstRobot);
  filter.RemoveRobot(77);
  EXPECT_EQ(filter.dim(), before.rows());
  filter.RemoveRobot(joint.second);
  EXPECT_FALSE(filter.HasRobot(joint.second));
  EXPECT_EQ(filter.dim(), before.rows() - 13) << "its read-out goes, its map stays";
  EXPECT_TRUE(filter.Has(second.mine().front()));
  const Eigen::MatrixXd after = filter.FullCovariance();
  EXPECT_EQ(Eigen::MatrixXd(after.topLeftCorner(own, own)),
            Eigen::MatrixXd(before.topLeftCorner(own, own)));
  EXPECT_EQ(Eigen::MatrixXd(after.bottomRightCorner(of_second - 13, of_second - 13)),
            Eigen::MatrixXd(before.bottomRightCorner(of_second - 13, of_second - 13)));
  const auto gone = filter.Update(second.lens(), std::vector<Observation>(1), Rigid3(), 1);
  EXPECT_EQ(gone.status().code(), absl::StatusCode::kInvalidArgument);
  filter.Remove(second.mine());
  EXPECT_EQ(filter.dim(), own);
  const RobotId third = filter.AddRobot(CameraMotion(), StartCovariance());
  EXPECT_NE(third, joint.second);
  EXPECT_EQ(filter.layout().islands(), 2) << "the empty island serves again";
  for (int k = 0; k < 10; ++k) first.Step();
}

}  // namespace
}  // namespace saccade::joint_filter_test
