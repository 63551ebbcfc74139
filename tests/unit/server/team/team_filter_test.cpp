// The joint filter of a team against one dense filter, and T35: who shares nothing changes nothing.
#include "server/team/team_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "server/team/reorder_buffer.hpp"

namespace saccade::team_filter_test {
namespace {

BlockState At(const Eigen::VectorXd& numbers) { return {std::nullopt, numbers}; }
BlockState PoseAt(const Eigen::Vector3d& position) {
  return {Rigid3{Eigen::Quaterniond::Identity(), position}, Eigen::VectorXd()};
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  Eigen::MatrixXd Matrix(int rows, int columns) {
    Eigen::MatrixXd m(rows, columns);
    for (int k = 0; k < m.size(); ++k) m.data()[k] = normal_(engine_);
    return m;
  }
  Eigen::MatrixXd Covariance(int n) {
    const Eigen::MatrixXd a = Matrix(n, n);
    return a * a.transpose() + 0.1 * Eigen::MatrixXd::Identity(n, n);
  }

 private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

/// z = sum H_k x_k, for blocks of numbers.
Expectation Linear(const Eigen::VectorXd& z, std::vector<Eigen::MatrixXd> h) {
  return [z, h](std::span<const BlockState* const> at) -> std::optional<ObservationModel> {
    ObservationModel model{z, h};
    for (std::size_t k = 0; k < h.size(); ++k) model.residual -= h[k] * at[k]->numbers;
    return model;
  };
}

/// One robot of four numbers with a feature of two, for `steps` steps of its own.
void Live(TeamFilter& filter, BlockId robot, BlockId feature, unsigned seed, int steps) {
  Random random(seed);
  for (int k = 0; k < steps; ++k) {
    const Eigen::MatrixXd f = Eigen::MatrixXd::Identity(4, 4) + 0.1 * random.Matrix(4, 4);
    ASSERT_TRUE(
        filter.Predict(robot, At(f * filter.state(robot).numbers), f, 0.01 * random.Covariance(4))
            .ok());
    const std::array blocks = {robot, feature};
    const auto updated = filter.Update(
        blocks, Linear(random.Matrix(2, 1), {random.Matrix(2, 4), random.Matrix(2, 2)}),
        random.Covariance(2), {4.0, 2});
    ASSERT_TRUE(updated.ok()) << updated.status();
  }
}

TEST(TeamFilter, EqualsADenseKalmanFilter) {
  Random random(1);
  TeamFilter filter;
  std::vector<BlockId> ids;
  const std::array<int, 3> dims = {4, 3, 2};
  Eigen::VectorXd x(9);
  Eigen::MatrixXd p = Eigen::MatrixXd::Zero(9, 9);
  int at = 0;
  for (const int n : dims) {
    const Eigen::VectorXd mean = random.Matrix(n, 1);
    const Eigen::MatrixXd covariance = random.Covariance(n);
    const auto id = filter.Add(std::string(1, static_cast<char>('a' + at)), TeamBlockKind::kRobot,
                               At(mean), covariance);
    ASSERT_TRUE(id.ok()) << id.status();
    ids.push_back(*id);
    x.segment(at, n) = mean;
    p.block(at, at, n, n) = covariance;
    at += n;
  }
  for (int k = 0; k < 40; ++k) {
    const Eigen::MatrixXd f = random.Matrix(3, 3), q = random.Covariance(3);
    Eigen::MatrixXd all = Eigen::MatrixXd::Identity(9, 9);
    all.block(4, 4, 3, 3) = f;
    x = (all * x).eval();
    p = (all * p * all.transpose()).eval();
    p.block(4, 4, 3, 3) += q;
    ASSERT_TRUE(filter.Predict(ids[1], At(f * filter.state(ids[1]).numbers), f, q).ok());
    // The third with the first: their order is not that of the state.
    const Eigen::MatrixXd h2 = random.Matrix(2, 2), h0 = random.Matrix(2, 4);
    const Eigen::MatrixXd h1 = random.Matrix(2, 3), r = random.Covariance(2);
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(2, 9);
    h.leftCols(4) = h0;
    h.rightCols(2) = h2;
    std::vector<BlockId> blocks = {ids[2], ids[0]};
    std::vector<Eigen::MatrixXd> parts = {h2, h0};
    if (k > 10) {
      h.middleCols(4, 3) = h1;
      blocks.push_back(ids[1]);
      parts.push_back(h1);
    }
    const Eigen::VectorXd z = random.Matrix(2, 1);
    const Eigen::MatrixXd gain = p * h.transpose() * (h * p * h.transpose() + r).inverse();
    x += gain * (z - h * x);
    p -= (gain * h * p).eval();
    ASSERT_TRUE(filter.Update(blocks, Linear(z, parts), r, {}).ok());
    EXPECT_EQ(filter.Share(ids[0], ids[1]), k > 10) << "nothing is kept of what is zero";
  }
  Eigen::VectorXd mine(9);
  mine << filter.state(ids[0]).numbers, filter.state(ids[1]).numbers, filter.state(ids[2]).numbers;
  EXPECT_LT((mine - x).norm(), 1e-9 * x.norm());
  EXPECT_LT((filter.FullCovariance() - p).norm(), 1e-9 * p.norm());
}

TEST(TeamFilter, BlocksThatShareNothingAreToTheByteAsInFiltersOfTheirOwnT35) {
  TeamFilter joint, first, second;
  const auto start = [](TeamFilter& filter, const std::string& name) {
    const auto robot = filter.Add(name, TeamBlockKind::kRobot, At(Eigen::VectorXd::Ones(4)),
                                  Eigen::MatrixXd::Identity(4, 4));
    const auto feature = filter.Add(name + " feature", TeamBlockKind::kFeature,
                                    At(Eigen::VectorXd::Ones(2)), Eigen::MatrixXd::Identity(2, 2));
    return std::pair(*robot, *feature);
  };
  const auto a = start(joint, "a"), b = start(joint, "b");
  const auto alone_a = start(first, "a"), alone_b = start(second, "b");
  for (unsigned k = 0; k < 10; ++k) {
    Live(joint, a.first, a.second, k, 5);
    Live(joint, b.first, b.second, 100 + k, 7);
    Live(first, alone_a.first, alone_a.second, k, 5);
    Live(second, alone_b.first, alone_b.second, 100 + k, 7);
  }
  EXPECT_EQ(joint.state(a.first).numbers, first.state(alone_a.first).numbers);
  EXPECT_EQ(joint.covariance(a.first), first.covariance(alone_a.first));
  EXPECT_EQ(joint.state(b.second).numbers, second.state(alone_b.second).numbers);
  EXPECT_EQ(joint.Cross(b.first, b.second), second.Cross(alone_b.first, alone_b.second));
  EXPECT_FALSE(joint.Share(a.first, b.first));
  // Who leaves takes nothing along.
  ASSERT_TRUE(joint.Remove(b.first).ok());
  EXPECT_EQ(joint.covariance(a.first), first.covariance(alone_a.first));
  EXPECT_EQ(joint.Remove(b.first).code(), absl::StatusCode::kNotFound);
}

TEST(TeamFilter, WhatIsDerivedIsCorrelatedAndGoneAgainLeavesNoTraceT3) {
  Random random(3);
  TeamFilter filter;
  const BlockId robot = *filter.Add("robot", TeamBlockKind::kRobot, At(Eigen::VectorXd::Zero(4)),
                                    random.Covariance(4));
  const BlockId other = *filter.Add("other", TeamBlockKind::kRobot, At(Eigen::VectorXd::Zero(4)),
                                    random.Covariance(4));
  Live(filter, robot,
       *filter.Add("feature", TeamBlockKind::kFeature, At(Eigen::VectorXd::Zero(2)),
                   random.Covariance(2)),
       4, 3);
  const Eigen::MatrixXd before = filter.FullCovariance();
  const Eigen::MatrixXd j = random.Matrix(2, 4), noise = random.Covariance(2);
  const std::array from = {BlockJacobian{robot, j}};
  const auto born =
      filter.Derive("clone", TeamBlockKind::kMapFrame, At(Eigen::VectorXd::Zero(2)), from, noise);
  ASSERT_TRUE(born.ok()) << born.status();
  EXPECT_LT((filter.Cross(*born, robot) - j * filter.covariance(robot)).norm(), 1e-12);
  EXPECT_LT(
      (filter.covariance(*born) - j * filter.covariance(robot) * j.transpose() - noise).norm(),
      1e-12);
  EXPECT_FALSE(filter.Share(*born, other));
  ASSERT_TRUE(filter.Remove(*born).ok());
  EXPECT_EQ(filter.FullCovariance(), before);
}

TEST(TeamFilter, AStaticCameraIsPlacedByARobotAndThenHelpsIt) {
  TeamFilter filter;
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << 0.02, 0.02, 0.02, 0.01, 0.01, 0.01;
  const BlockId robot = *filter.Add("robot", TeamBlockKind::kRobot, PoseAt({0, 0, 2}),
                                    sigma.cwiseAbs2().asDiagonal());
  const BlockId camera = *filter.Add("camera", TeamBlockKind::kCamera, PoseAt({0.2, 0.1, -0.2}),
                                     0.25 * Eigen::MatrixXd::Identity(6, 6));
  // The robot's marker, seen by a camera that is truly at the origin: both points' bearings.
  const std::array<Eigen::Vector3d, 4> corners = {
      Eigen::Vector3d(-.3, -.3, 0), {.3, -.3, 0}, {.3, .3, 0.1}, {-.3, .3, 0}};
  const Expectation seen =
      [&](std::span<const BlockState* const> at) -> std::optional<ObservationModel> {
    const Rigid3 &r = *at[0]->pose, &c = *at[1]->pose;
    ObservationModel model{Eigen::VectorXd(8), {Eigen::MatrixXd(8, 6), Eigen::MatrixXd(8, 6)}};
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector3d& corner = corners[static_cast<std::size_t>(k)];
      const Eigen::Vector3d x = c.Inverse() * (r * corner);
      if (x.z() < 0.1) return std::nullopt;
      const Eigen::Vector3d truth = corner + Eigen::Vector3d(0, 0, 2);
      Eigen::Matrix<double, 2, 3> d;
      d << 1 / x.z(), 0, -x.x() / (x.z() * x.z()), 0, 1 / x.z(), -x.y() / (x.z() * x.z());
      const Eigen::Matrix3d back = c.RotationMatrix().transpose();
      model.residual.segment<2>(2 * k) = truth.head<2>() / truth.z() - x.head<2>() / x.z();
      model.jacobians[0].block<2, 6>(2 * k, 0) << d * back,
          -d * back * r.RotationMatrix() * Skew(corner);
      model.jacobians[1].block<2, 6>(2 * k, 0) << -d * back, d * Skew(x);
    }
    return model;
  };
  const std::array blocks = {robot, camera};
  const Eigen::MatrixXd noise = 1e-8 * Eigen::MatrixXd::Identity(8, 8);
  ASSERT_TRUE(filter.Update(blocks, seen, noise, {0.0, 8}).ok());
  EXPECT_LT(filter.state(camera).pose->translation.norm(), 0.06) << "as well as the robot is known";
  EXPECT_LT(RotationAngle(*filter.state(camera).pose, Rigid3()), 0.03);
  EXPECT_TRUE(filter.Share(robot, camera));
  // The robot does not know where it went; the camera tells.
  const double known = filter.covariance(robot).topLeftCorner<3, 3>().trace();
  ASSERT_TRUE(filter
                  .Predict(robot, filter.state(robot), Eigen::MatrixXd::Identity(6, 6),
                           0.04 * Eigen::MatrixXd::Identity(6, 6))
                  .ok());
  ASSERT_TRUE(filter.Update(blocks, seen, noise, {0.0, 8}).ok());
  const double after = filter.covariance(robot).topLeftCorner<3, 3>().trace();
  EXPECT_LT(after, 1.5 * known);
  const Eigen::MatrixXd p = filter.FullCovariance();
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(p).eigenvalues().minCoeff(),
            -1e-12 * p.trace());
}

TEST(TeamFilter, AGrossErrorWeighsLittleAndAnErrorChangesNothing) {
  TeamFilter filter;
  const BlockId robot = *filter.Add("robot", TeamBlockKind::kRobot, At(Eigen::VectorXd::Zero(2)),
                                    0.01 * Eigen::MatrixXd::Identity(2, 2));
  const std::array blocks = {robot};
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(2, 2);
  const auto far =
      filter.Update(blocks, Linear(Eigen::Vector2d(3, 0), {one}), 0.01 * one, {4.0, 1});
  ASSERT_TRUE(far.ok());
  EXPECT_LT(far->weight, 0.02);
  EXPECT_LT(filter.state(robot).numbers.norm(), 0.1) << "half of it without the weight";
  const Eigen::MatrixXd before = filter.covariance(robot);
  const std::array twice = {robot, robot};
  EXPECT_EQ(
      filter.Update(twice, Linear(Eigen::Vector2d(3, 0), {one, one}), one, {}).status().code(),
      absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(filter.Update(blocks, Linear(Eigen::Vector2d(3, 0), {one}), -one, {}).status().code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(filter.Update(blocks, Linear(Eigen::Vector2d(NAN, 0), {one}), one, {}).status().code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_FALSE(filter.Add("robot", TeamBlockKind::kRobot, At(Eigen::VectorXd::Zero(2)), one).ok());
  EXPECT_FALSE(filter.Add("b", TeamBlockKind::kRobot, At(Eigen::VectorXd::Zero(3)), one).ok());
  EXPECT_FALSE(filter.Predict(99, At(Eigen::VectorXd::Zero(2)), one, one).ok());
  EXPECT_EQ(filter.covariance(robot), before);
}

TEST(ReorderBuffer, GivesBackTheOrderOfExposureAndCountsWhatIsLateT37) {
  std::mt19937 engine(5);
  std::vector<std::pair<Timestamp, Timestamp>> events;  // arrival, exposure
  for (Timestamp t = 0; t < 1000; t += 7) events.emplace_back(t + engine() % 100, t);
  std::sort(events.begin(), events.end());
  ReorderBuffer<Timestamp> buffer(100);
  std::vector<Timestamp> out;
  const auto take = [&](const std::vector<Timestamp>& ready) {
    out.insert(out.end(), ready.begin(), ready.end());
  };
  for (const auto& [arrival, exposure] : events) {
    EXPECT_TRUE(buffer.Push(exposure, 0, out.size(), exposure));
    take(buffer.Ready());
  }
  EXPECT_GT(buffer.waiting(), 0u);
  EXPECT_FALSE(buffer.Push(800, 0, 0, 800)) << "what is younger went out already";
  take(buffer.Rest());
  EXPECT_EQ(buffer.late(), 1u);
  EXPECT_EQ(out.size(), events.size());
  EXPECT_TRUE(std::is_sorted(out.begin(), out.end()));
}

}  // namespace
}  // namespace saccade::team_filter_test
