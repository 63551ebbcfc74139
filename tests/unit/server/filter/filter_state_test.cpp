#include "server/filter/filter_state.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <ctime>
#include <map>

#include "server/filter/robust_pose.hpp"
#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::filter_state_test {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

Matrix12d SmallCovariance(double position, double rotation, double velocity, double turning) {
  Vector12d sigma;
  sigma << Eigen::Vector3d::Constant(position), Eigen::Vector3d::Constant(rotation),
      Eigen::Vector3d::Constant(velocity), Eigen::Vector3d::Constant(turning);
  return sigma.cwiseAbs2().asDiagonal();
}

/// A camera at the origin that looks at random points; features are born at wrong depths.
class Simulation {
 public:
  Simulation(std::uint64_t seed, int points, const FilterOptions& options)
      : world_(seed), lens_(TestCamera()), filter_(options) {
    for (int k = 0; k < points; ++k) {
      points_.push_back(world_.Uniform(1.0, 4.0) *
                        *lens_.Unproject({world_.Uniform(60, 580), world_.Uniform(60, 420)}));
    }
    filter_.Reset(CameraMotion(), SmallCovariance(0, 0, 0.3, 0.5));
  }

  void BirthAll(double inverse_range, double sigma, double noise_px) {
    const CloneId clone = filter_.AddClone();
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const auto pixel = lens_.Project(truth_.Inverse() * points_[k]);
      if (!pixel || !lens_.InImage(*pixel)) continue;
      FeatureBirth birth;
      Eigen::Matrix<double, 3, 2> d_bearing;
      birth.id = k + 1;
      birth.bearing = *lens_.Unproject(*pixel + world_.NormalVector<2>(noise_px), &d_bearing);
      birth.bearing_covariance = noise_px * noise_px * d_bearing * d_bearing.transpose();
      birth.inverse_range = inverse_range;
      birth.inverse_range_sigma = sigma;
      ASSERT_TRUE(filter_.AddFeature(clone, birth).ok());
    }
  }

  std::vector<Observation> See(double noise_px) {
    std::vector<Observation> seen;
    for (const FeatureId id : filter_.FeatureIds()) {
      const auto pixel = lens_.Project(truth_.Inverse() * points_[id - 1]);
      if (!pixel || !lens_.InImage(*pixel) || !filter_.Predicted(lens_, id)) continue;
      Observation observation;
      observation.id = id;
      observation.pixel = *pixel + world_.NormalVector<2>(noise_px);
      observation.noise = noise_px * noise_px * Eigen::Matrix2d::Identity();
      seen.push_back(observation);
    }
    return seen;
  }

  void Step(double dt, const Rigid3& truth, double noise_px) {
    truth_ = truth;
    filter_.Predict(dt, MotionNoise());
    const auto seen = See(noise_px);
    const RobustPose pose = PoseFrom(seen);
    const auto report = filter_.Update(lens_, seen, pose.world_from_camera);
    ASSERT_TRUE(report.ok()) << report.status();
  }

  /// Where to linearise: as the tracker does, at the pose that the matches ask for.
  RobustPose PoseFrom(const std::vector<Observation>& seen) {
    std::vector<PoseEvidence> evidence;
    for (const Observation& each : seen) {
      evidence.push_back(
          {filter_.Point(each.id), *filter_.Predicted(lens_, each.id), each.pixel, each.noise});
    }
    const PosePrior prior{filter_.camera().world_from_camera, filter_.PoseCovariance()};
    return EstimateRobustPose(lens_, prior, evidence, RobustPoseOptions(), world_.engine());
  }

  /// Sways about the origin.
  static Rigid3 Sway(double t) {
    return {ExpQuaternion({0.1 * std::sin(1.1 * t), 0.12 * std::sin(0.9 * t), 0.05 * std::sin(t)}),
            {0.2 * std::sin(0.8 * t), 0.1 * std::sin(1.3 * t), 0.1 * std::sin(0.6 * t)}};
  }

  RandomWorld world_;
  CameraModel lens_;
  FilterState filter_;
  std::vector<Eigen::Vector3d> points_;
  Rigid3 truth_;
};

TEST(FilterState, OneFrameSaysLittleOfDepth) {
  Simulation sim(21, 60, FilterOptions());
  sim.BirthAll(1.0, 0.5, 0.5);
  sim.Step(1.0 / 30, {Eigen::Quaterniond::Identity(), {0.002, 0.001, 0}}, 0.5);
  double least = 1e9;
  for (const FeatureId id : sim.filter_.FeatureIds()) {
    least = std::min(least, sim.filter_.Marginal(id).inverse_range_sigma);
  }
  EXPECT_GT(least, 0.25);
}

TEST(FilterState, AugmentThenDeleteRestoresEverythingT3) {
  Simulation sim(22, 20, FilterOptions());
  sim.BirthAll(0.5, 0.25, 0.5);
  for (int k = 1; k < 20; ++k) sim.Step(1.0 / 30, Simulation::Sway(k / 30.0), 0.5);
  const Eigen::MatrixXd before = sim.filter_.FullCovariance();
  const Eigen::Vector3d point = sim.filter_.Marginal(7).point_in_world;
  const CloneId clone = sim.filter_.AddClone();
  FeatureBirth birth;
  birth.id = 1000;
  ASSERT_TRUE(sim.filter_.AddFeature(clone, birth).ok());
  EXPECT_EQ(sim.filter_.dim(), before.rows() + 9);
  sim.filter_.Remove(std::vector<FeatureId>{1000});
  ASSERT_EQ(sim.filter_.dim(), before.rows());
  EXPECT_LT((sim.filter_.FullCovariance() - before).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((sim.filter_.Marginal(7).point_in_world - point).norm(), 1e-12);
}

TEST(FilterState, RemovingOneLeavesTheOthersAsTheyWere) {
  Simulation sim(23, 20, FilterOptions());
  sim.BirthAll(0.5, 0.25, 0.5);
  for (int k = 1; k < 10; ++k) sim.Step(1.0 / 30, Simulation::Sway(k / 30.0), 0.5);
  const FeatureMarginal before = sim.filter_.Marginal(12);
  sim.filter_.Remove(std::vector<FeatureId>{3, 5, 20});
  const FeatureMarginal after = sim.filter_.Marginal(12);
  EXPECT_EQ(sim.filter_.dim(), 12 + 6 + 3 * 17);
  EXPECT_LT((before.covariance_in_camera - after.covariance_in_camera).norm(), 1e-14);
  EXPECT_EQ(before.point_in_world, after.point_in_world);
}

TEST(FilterState, CloneCarriesTheWholeCovarianceOfThePose) {
  Simulation sim(24, 10, FilterOptions());
  sim.BirthAll(0.5, 0.25, 0.5);
  for (int k = 1; k < 10; ++k) sim.Step(1.0 / 30, Simulation::Sway(k / 30.0), 0.5);
  const int offset = sim.filter_.dim();
  sim.filter_.AddClone();
  const Eigen::MatrixXd p = sim.filter_.FullCovariance();
  EXPECT_EQ(Eigen::MatrixXd(p.block(offset, 0, 6, offset)),
            Eigen::MatrixXd(p.block(0, 0, 6, offset)));
  EXPECT_EQ(Eigen::MatrixXd(p.block(offset, offset, 6, 6)), Eigen::MatrixXd(p.block(0, 0, 6, 6)));
}

TEST(FilterState, CountingErrorsFromACloneKeepsWhatIsSeenFromElsewhere) {
  Simulation run(5, 20, FilterOptions());
  // Where the world is, is known badly; what things are to one another, well.
  run.filter_.Reset(CameraMotion(), SmallCovariance(0.5, 0.2, 0.3, 0.5));
  run.BirthAll(0.5, 0.25, 0.3);
  for (int k = 1; k < 80; ++k) run.Step(1.0 / 30, Simulation::Sway(k / 30.0), 0.3);
  const CloneId clone = run.filter_.CloneOf(1);
  const StateLayout& layout = run.filter_.layout();
  const int of_clone = layout[layout.Blocks(0)[1]].offset;  // behind the camera
  ASSERT_GT(run.filter_.FullCovariance().block(of_clone, of_clone, 6, 6).trace(), 0.5);
  std::map<FeatureId, Eigen::Matrix2d> before;
  for (const FeatureId id : run.filter_.FeatureIds()) {
    if (const auto seen = run.filter_.Predicted(run.lens_, id)) before[id] = seen->covariance;
  }
  ASSERT_GT(before.size(), 10u);
  const Rigid3 pose = run.filter_.camera().world_from_camera;
  EXPECT_FALSE(run.filter_.CountErrorsFrom(clone + 1));
  EXPECT_GT(run.filter_.DirectionSigma(clone), 0.003);
  ASSERT_TRUE(run.filter_.CountErrorsFrom(clone));
  EXPECT_LT(run.filter_.DirectionSigma(clone), 1e-6);
  for (const auto& [id, covariance] : before) {
    const auto after = run.filter_.Predicted(run.lens_, id)->covariance;
    EXPECT_LT((after - covariance).norm(), 1e-7 * covariance.norm() + 1e-9) << id;
  }
  const Eigen::MatrixXd p = run.filter_.FullCovariance();
  EXPECT_LT(p.middleRows(of_clone, 6).norm(), 1e-9);
  EXPECT_LT(run.filter_.PoseCovariance().trace(), 0.05);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(p).eigenvalues().minCoeff(), -1e-10);
  EXPECT_EQ((pose.translation - run.filter_.camera().world_from_camera.translation).norm(), 0.0);
}

TEST(FilterState, MovingTheWorldChangesNothingThatIsSeen) {
  Simulation run(7, 20, FilterOptions()), other(7, 20, FilterOptions());
  for (Simulation* each : {&run, &other}) {
    each->BirthAll(0.5, 0.25, 0.3);
    for (int k = 1; k < 40; ++k) each->Step(1.0 / 30, Simulation::Sway(k / 30.0), 0.3);
  }
  const Similarity3 moved{1.3, ExpQuaternion({0.4, -1.0, 0.2}), {3.0, -1.0, 2.0}};
  run.filter_.MoveWorld(moved);
  const Rigid3 expected = moved.Move(other.filter_.camera().world_from_camera);
  EXPECT_LT((run.filter_.camera().world_from_camera.translation - expected.translation).norm(),
            1e-12);
  const auto compare = [&](double tolerance) {
    int compared = 0;
    for (const FeatureId id : other.filter_.FeatureIds()) {
      const auto a = run.filter_.Predicted(run.lens_, id),
                 b = other.filter_.Predicted(run.lens_, id);
      ASSERT_EQ(a.has_value(), b.has_value());
      if (!a) continue;
      ++compared;
      EXPECT_LT((a->at.pixel - b->at.pixel).norm(), tolerance) << id;
      EXPECT_LT((a->covariance - b->covariance).norm(), tolerance * b->covariance.norm()) << id;
      EXPECT_LT((run.filter_.Marginal(id).point_in_world -
                 moved * other.filter_.Marginal(id).point_in_world)
                    .norm(),
                tolerance);
    }
    EXPECT_GT(compared, 10);
  };
  compare(1e-9);
  // And it goes on alike: velocities and all correlations came along.
  for (Simulation* each : {&run, &other}) {
    each->filter_.Predict(1.0 / 30, {0.0, 0.0});
  }
  compare(1e-9);
}

TEST(FilterState, APoseFromElsewhereHasAnErrorOfItsOwn) {
  Simulation run(6, 30, FilterOptions());
  run.BirthAll(0.5, 0.25, 0.3);
  for (int k = 1; k < 90; ++k) run.Step(1.0 / 30, Simulation::Sway(k / 30.0), 0.3);
  const auto error = [&] {
    return (run.filter_.camera().world_from_camera.translation - run.truth_.translation).norm();
  };
  const double error_before = error();
  // Ten of them leave and come back, on a clone that is 3 cm and 1 deg from where it was.
  const PointFromClone first = run.filter_.Point(3);
  std::vector<FeatureBirth> births;
  for (FeatureId id = 3; id < 13; ++id) {
    if (!run.filter_.Has(id)) continue;
    const PointFromClone known = run.filter_.Point(id);
    births.push_back({id, known.bearing, 1e-7 * Eigen::Matrix3d::Identity(), known.inverse_range,
                      run.filter_.Marginal(id).inverse_range_sigma});
  }
  ASSERT_GT(births.size(), 5u);
  for (const FeatureBirth& birth : births) run.filter_.Remove(std::vector<FeatureId>{birth.id});
  const Rigid3 right = first.world_from_clone;
  const Rigid3 wrong = {right.rotation * ExpQuaternion({0.01, -0.01, 0.01}),
                        right.translation + Eigen::Vector3d(0.02, -0.02, 0.01)};
  Vector6 sigma;
  sigma << 0.02, 0.02, 0.02, 0.01, 0.01, 0.01;
  const int offset = run.filter_.dim();
  const CloneId clone = run.filter_.AddClone(wrong, sigma.cwiseAbs2().asDiagonal());
  for (const FeatureBirth& birth : births) {
    ASSERT_TRUE(run.filter_.AddFeature(clone, birth).ok());
    EXPECT_FALSE(run.filter_.AddFeature(clone, birth).ok()) << "the id is taken";
  }
  const Eigen::MatrixXd p = run.filter_.FullCovariance();
  EXPECT_EQ(p.block(offset, 0, 6, offset).norm(), 0.0);
  const std::vector<FeatureId> ids = run.filter_.FeatureIds();
  EXPECT_TRUE(std::is_sorted(ids.begin(), ids.end()));
  for (int k = 90; k < 120; ++k) run.Step(1.0 / 30, Simulation::Sway(k / 30.0), 0.3);
  const Rigid3 found = *run.filter_.ClonePose(clone);
  EXPECT_LT((found.translation - right.translation).norm(), 0.01);
  EXPECT_LT(RotationAngle(found, right), 0.005);
  // What stayed was known far better, and hardly moves for it.
  EXPECT_LT(error(), error_before + 0.01);
}

TEST(FilterState, KalmanAndInformationFormAgreeT4) {
  // The same observations once as one batch of known points (more rows than states: information
  // form), once computed here by the textbook's Kalman form.
  RandomWorld world(25);
  const CameraModel lens = TestCamera();
  for (int run = 0; run < 50; ++run) {
    FilterState filter{FilterOptions()};
    const Matrix12d prior = SmallCovariance(0.02, 0.02, 0.2, 0.3);
    filter.Reset(CameraMotion(), prior);
    filter.Predict(1.0 / 30, MotionNoise());
    const Matrix12d p = filter.CameraCovariance();
    const CameraMotion predicted = filter.camera();
    std::vector<Observation> seen;
    const int count = 12;
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(2 * count, 12);
    Eigen::VectorXd innovation(2 * count);
    for (int k = 0; k < count; ++k) {
      Observation observation;
      observation.known_point =
          world.Uniform(1, 3) * *lens.Unproject({world.Uniform(60, 580), world.Uniform(60, 420)});
      const auto at = PredictFixed(lens, predicted.world_from_camera, *observation.known_point);
      observation.pixel = at->pixel + world.NormalVector<2>(3.0);
      h.block<2, 6>(2 * k, 0) = at->d_camera;
      innovation.segment<2>(2 * k) = observation.pixel - at->pixel;
      seen.push_back(observation);
    }
    ASSERT_TRUE(filter.Update(lens, seen, predicted.world_from_camera).ok());
    const Eigen::MatrixXd s =
        h * p * h.transpose() + Eigen::MatrixXd::Identity(2 * count, 2 * count);
    const Eigen::MatrixXd gain = p * h.transpose() * s.inverse();
    const Vector12d error = gain * innovation;
    Matrix12d carry = Matrix12d::Identity();
    carry.block<3, 3>(3, 3) = RightJacobianSo3(error.segment<3>(3));
    const Matrix12d expected = carry * (p - gain * s * gain.transpose()) * carry.transpose();
    EXPECT_LT(Minus(Plus(predicted, error), filter.camera()).norm(), 1e-9 * error.norm());
    EXPECT_LT(RelativeError(expected, filter.CameraCovariance()), 1e-9);
  }
}

TEST(FilterState, SparseUpdateEqualsTheTextbook) {
  for (const PointForm form : {PointForm::kBearingRange, PointForm::kRangeOnly}) {
    FilterOptions options;
    options.fej = false;
    options.form = form;
    Simulation sim(26, 12, options);
    sim.BirthAll(0.5, 0.25, 0.5);
    for (int k = 1; k < 8; ++k) sim.Step(1.0 / 30, Simulation::Sway(k / 30.0), 0.5);
    sim.filter_.Predict(1.0 / 30, MotionNoise());
    const Eigen::MatrixXd p = sim.filter_.FullCovariance();
    sim.truth_ = Simulation::Sway(8 / 30.0);
    const auto seen = sim.See(0.5);
    const int n = sim.filter_.dim(), m = 2 * static_cast<int>(seen.size());
    ASSERT_GT(n, m);
    // Jacobian by moving the state itself is not possible from outside; by its predictions it is.
    Eigen::MatrixXd s(m, m), hp(m, 6);
    for (int k = 0; k < m / 2; ++k) {
      const auto at = sim.filter_.Predicted(sim.lens_, seen[k].id);
      const Eigen::Matrix2d block = at->covariance;
      EXPECT_LT((block - block.transpose()).norm(), 1e-9 * block.norm());
      hp.middleRows<2>(2 * k) = at->with_camera;
    }
    const Matrix6d before = sim.filter_.PoseCovariance();
    const auto first = sim.filter_.Predicted(sim.lens_, seen[0].id);
    const std::vector<Observation> one = {seen[0]};
    ASSERT_TRUE(sim.filter_.Update(sim.lens_, one, sim.filter_.camera().world_from_camera).ok());
    const Eigen::Matrix2d innovation = first->covariance + seen[0].noise;
    const Matrix6d expected =
        before - first->with_camera.transpose() * innovation.inverse() * first->with_camera;
    // The rotation's tangent moved by the correction; it is small here.
    EXPECT_LT(RelativeError(expected, sim.filter_.PoseCovariance()), 2e-2);
    EXPECT_LT(sim.filter_.PoseCovariance().trace(), before.trace());
  }
}

TEST(FilterState, CovarianceStaysPositiveT5) {
  Simulation sim(27, 25, FilterOptions());
  sim.BirthAll(0.5, 0.25, 0.5);
  for (int k = 1; k <= 20000; ++k) {
    sim.Step(1.0 / 30, Simulation::Sway(k / 30.0), 0.5);
    if (k % 1000 != 0) continue;
    const Eigen::MatrixXd p = sim.filter_.FullCovariance();
    ASSERT_TRUE(p.allFinite());
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(p, Eigen::EigenvaluesOnly);
    ASSERT_GT(eigen.eigenvalues().minCoeff(), -1e-12 * p.trace()) << "frame " << k;
  }
  EXPECT_LT((sim.filter_.camera().world_from_camera.translation - sim.truth_.translation).norm(),
            0.5);  // the scale is the prior's
}

TEST(FilterState, ReplayIsBitIdenticalT6) {
  Simulation a(28, 20, FilterOptions()), b(28, 20, FilterOptions());
  for (Simulation* sim : {&a, &b}) {
    sim->BirthAll(0.5, 0.25, 0.5);
    for (int k = 1; k < 50; ++k) sim->Step(1.0 / 30, Simulation::Sway(k / 30.0), 0.5);
  }
  EXPECT_EQ(a.filter_.FullCovariance(), b.filter_.FullCovariance());
  EXPECT_EQ(a.filter_.camera().world_from_camera.translation,
            b.filter_.camera().world_from_camera.translation);
}

/// Turning on the spot for 20 s: no divergence, no bogus depth.
TEST(FilterState, PureRotationInventsNoDepthT13) {
  int outside = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    FilterOptions options;
    options.fej = seed % 2 == 0;
    Simulation sim(seed, 30, options);
    sim.BirthAll(0.5, 0.25, 0.5);
    for (int k = 1; k <= 600; ++k) {
      const double t = k / 30.0;
      sim.Step(1.0 / 30,
               {ExpQuaternion({0.05 * std::sin(2 * t), 0.15 * std::sin(t), 0}), {0, 0, 0}}, 0.5);
    }
    for (const FeatureId id : sim.filter_.FeatureIds()) {
      const FeatureMarginal marginal = sim.filter_.Marginal(id);
      const double truth = 1.0 / sim.points_[id - 1].norm();
      outside += std::abs(marginal.inverse_range - truth) > 3 * marginal.inverse_range_sigma;
      ++all;
    }
    EXPECT_LT(sim.filter_.camera().world_from_camera.translation.norm(), 0.05);
    EXPECT_LT(RotationAngle(sim.filter_.camera().world_from_camera, sim.truth_), 0.01);
  }
  std::printf("T13: %d of %d features more than 3 sigma from their true depth\n", outside, all);
  EXPECT_LE(outside, all / 50);  // without the partial update: 60 to 80 of 100
}

/// T13 with matches as they are: far better than their R, but each off by a little that is always
/// the same from the same place (its patch looks different from there).
TEST(FilterState, PureRotationInventsNoDepthFromBiasedMatches) {
  int false_depth = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    Simulation sim(seed, 30, FilterOptions());
    sim.BirthAll(0.5, 0.25, 0.1);
    std::map<FeatureId, std::pair<Eigen::Vector2d, Eigen::Vector2d>> bias;  // from where, by what
    for (const Observation& each : sim.See(0.0)) {
      bias[each.id] = {each.pixel, sim.world_.NormalVector<2>(0.12)};
    }
    for (int k = 1; k <= 600; ++k) {
      const double t = k / 30.0;
      sim.truth_.rotation = ExpQuaternion({0.1 * std::sin(2 * t), 0.3 * std::sin(t), 0});
      sim.filter_.Predict(1.0 / 30, MotionNoise());
      std::vector<Observation> seen = sim.See(0.1);
      for (Observation& each : seen) {
        const auto& [from, by] = bias[each.id];
        each.pixel += (each.pixel - from).norm() / 100.0 * by;
        each.noise = 0.25 * Eigen::Matrix2d::Identity();
      }
      ASSERT_TRUE(sim.filter_.Update(sim.lens_, seen, sim.PoseFrom(seen).world_from_camera).ok());
    }
    for (const FeatureId id : sim.filter_.FeatureIds()) {
      const FeatureMarginal marginal = sim.filter_.Marginal(id);
      const double truth = 1.0 / sim.points_[id - 1].norm();
      false_depth += marginal.inverse_range_sigma < 0.1 * marginal.inverse_range &&
                     std::abs(marginal.inverse_range / truth - 1.0) > 0.3;
    }
  }
  std::printf("turning with biased matches: %d of 120 features claim a false depth\n", false_depth);
  EXPECT_LE(false_depth, 2);
}

/// A range found elsewhere takes the place of what was known of it; the line of sight stays.
TEST(FilterState, ToldRangesReplaceTheirOwnAlone) {
  Simulation sim(5, 20, FilterOptions());
  sim.BirthAll(1.0, 0.5, 0.5);
  sim.filter_.Predict(1.0 / 30, MotionNoise());
  const auto line = sim.filter_.LineOf(3);
  ASSERT_TRUE(line.has_value());
  const double range = sim.points_[2].norm();
  sim.filter_.TellRange(3, 1.0 / range, 1e-9);
  const FeatureMarginal told = sim.filter_.Marginal(3);
  EXPECT_DOUBLE_EQ(told.inverse_range, 1.0 / range);
  EXPECT_DOUBLE_EQ(told.inverse_range_sigma, 1e-9);
  EXPECT_DOUBLE_EQ(sim.filter_.Marginal(4).inverse_range, 1.0);
  EXPECT_DOUBLE_EQ(sim.filter_.Marginal(4).inverse_range_sigma, 0.5);
  // With its range known the line is all that its pixel is unsure of.
  const auto predicted = sim.filter_.Predicted(sim.lens_, 3);
  ASSERT_TRUE(predicted.has_value());
  Eigen::Matrix<double, 2, 14> h;
  h << predicted->at.d_camera, predicted->at.d_clone, predicted->at.d_point.leftCols<2>();
  EXPECT_LT((h * line->covariance * h.transpose() - predicted->covariance).norm(),
            1e-9 * predicted->covariance.norm());
  EXPECT_FALSE(sim.filter_.LineOf(99).has_value());
}

/// T13 too: a feature whose depth is unknown still tells of the camera's rotation.
TEST(FilterState, UndelayedFeaturesHoldRotationFromTheSecondFrame) {
  Simulation sim(33, 30, FilterOptions());
  sim.BirthAll(0.5, 0.25, 0.5);
  const double known = std::sqrt(sim.filter_.PoseCovariance().bottomRightCorner<3, 3>().trace());
  EXPECT_LT(known, 1e-9);
  sim.Step(1.0 / 30, {ExpQuaternion({0.01, -0.02, 0.005}), {0, 0, 0}}, 0.5);
  const double seen = std::sqrt(sim.filter_.PoseCovariance().bottomRightCorner<3, 3>().trace());
  FilterState blind{FilterOptions()};
  blind.Reset(CameraMotion(), SmallCovariance(0, 0, 0.3, 0.5));
  blind.Predict(1.0 / 30, MotionNoise());
  const double coasted = std::sqrt(blind.PoseCovariance().bottomRightCorner<3, 3>().trace());
  EXPECT_LT(seen, 0.2 * coasted);
  EXPECT_LT(RotationAngle(sim.filter_.camera().world_from_camera, sim.truth_), 0.01);
}

TEST(FilterState, BadInputIsRefusedAndChangesNothing) {
  Simulation sim(30, 5, FilterOptions());
  sim.BirthAll(0.5, 0.25, 0.5);
  const Eigen::MatrixXd before = sim.filter_.FullCovariance();
  FeatureBirth birth;
  birth.id = 3;
  EXPECT_EQ(sim.filter_.AddFeature(1, birth).code(), absl::StatusCode::kInvalidArgument);
  birth.id = 100;
  EXPECT_EQ(sim.filter_.AddFeature(77, birth).code(), absl::StatusCode::kInvalidArgument);
  birth.inverse_range_sigma = 0;
  EXPECT_EQ(sim.filter_.AddFeature(1, birth).code(), absl::StatusCode::kInvalidArgument);
  Observation unknown;
  unknown.id = 99;
  EXPECT_EQ(
      sim.filter_.Update(sim.lens_, std::vector<Observation>{unknown}, Rigid3()).status().code(),
      absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(sim.filter_.FullCovariance(), before);
  sim.filter_.Remove(std::vector<FeatureId>{99});
  EXPECT_EQ(sim.filter_.feature_count(), 5U);
}

TEST(FilterState, PredictingOverADayCostsWhatASecondCosts) {
  RandomWorld world(3);
  FilterState filter{FilterOptions()};
  filter.Reset(CameraMotion(), SmallCovariance(0, 0, 0.3, 0.5));
  const CloneId clone = filter.AddClone();
  for (FeatureId id = 1; id <= 100; ++id) {
    FeatureBirth birth;
    birth.id = id;
    birth.bearing =
        Eigen::Vector3d(world.Uniform(-0.5, 0.5), world.Uniform(-0.4, 0.4), 1).normalized();
    birth.inverse_range = 0.5;
    birth.inverse_range_sigma = 0.25;
    ASSERT_TRUE(filter.AddFeature(clone, birth).ok());
  }
  const auto cpu_ms = [&](double dt) {
    const std::clock_t begin = std::clock();
    filter.Predict(dt, MotionNoise());
    return 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  const double second_ms = cpu_ms(1.0), day_ms = cpu_ms(86'400.0), year_ms = cpu_ms(3e7);
  std::printf("a second %.2f ms, a day %.2f ms, a year %.2f ms\n", second_ms, day_ms, year_ms);
  EXPECT_LT(day_ms, 3 * second_ms + 5.0);
  EXPECT_LT(year_ms, 3 * second_ms + 5.0);
}

}  // namespace
}  // namespace saccade::filter_state_test
