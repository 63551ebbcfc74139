// Robots in a plane: their motion and sightings against numbers, and teams with known truth.
#include "server/team/planar_team.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace saccade::planar_team_test {
namespace {

PlanarVector SomeState(std::mt19937& engine) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  PlanarVector state;
  for (int k = 0; k < kPlanarDim; ++k) state[k] = (k < 3 ? 2.0 : 0.1) * uniform(engine);
  return state;
}

template <typename F>
Eigen::MatrixXd Numeric(const F& f, const Eigen::VectorXd& at) {
  const double h = 1e-6;
  Eigen::MatrixXd j(f(at).size(), at.size());
  for (int k = 0; k < at.size(); ++k) {
    Eigen::VectorXd up = at, down = at;
    up[k] += h;
    down[k] -= h;
    j.col(k) = (f(up) - f(down)) / (2 * h);
  }
  return j;
}

TEST(PlanarRobot, JacobiansAreTheDifferencesT1) {
  std::mt19937 engine(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const PlanarOptions options;
  for (int k = 0; k < 100; ++k) {
    const PlanarVector state = SomeState(engine);
    const PlanarCommand command{uniform(engine), k % 5 == 0 ? 0.0 : uniform(engine)};
    const double dt = 0.01 + std::abs(uniform(engine));
    PlanarVector moved = state;
    PlanarMatrix f;
    DrivePlanar(dt, command, options, moved, &f, nullptr);
    const auto drive = [&](const Eigen::VectorXd& from) -> Eigen::VectorXd {
      PlanarVector to = from;
      DrivePlanar(dt, command, options, to);
      return to;
    };
    EXPECT_LT((Numeric(drive, state) - f).norm(), 1e-6 * f.norm()) << k;

    const Eigen::Vector2d subject(4.0 + uniform(engine), 3.0 * uniform(engine));
    Eigen::VectorXd anywhere(2);
    anywhere << subject.x(), subject.y();
    const Eigen::Vector2d velocity(0.3, -0.2);
    const PlanarSight sight{3.0, 0.4};
    const auto r = ResidualOf(sight, state, command, subject, velocity);
    ASSERT_TRUE(r);
    const auto by_observer = [&](const Eigen::VectorXd& from) -> Eigen::VectorXd {
      return -ResidualOf(sight, from, command, subject, velocity)->residual;
    };
    const auto by_subject = [&](const Eigen::VectorXd& place) -> Eigen::VectorXd {
      return -ResidualOf(sight, state, command, place, velocity)->residual;
    };
    EXPECT_LT((Numeric(by_observer, state) - r->d_observer).norm(), 1e-6 * r->d_observer.norm());
    EXPECT_LT((Numeric(by_subject, anywhere) - r->d_subject).norm(), 1e-6 * r->d_subject.norm());
  }
}

/// Robots that drive in circles and see landmarks and each other, with the noise that the options
/// say.
class World {
 public:
  World(unsigned seed, int robots, const PlanarOptions& options)
      : options_(options), engine_(seed), truth_(static_cast<std::size_t>(robots)) {
    for (std::size_t r = 0; r < truth_.size(); ++r) {
      PlanarVector& state = truth_[r];
      state.setZero();
      state.head<3>() << 2.0 * std::cos(1.3 * static_cast<double>(r)),
          2.0 * std::sin(1.3 * static_cast<double>(r)), static_cast<double>(r);
      state[kSpeedScale] = Normal(options.speed_scale);
      state[kTurnScale] = Normal(options.turn_scale);
      state[kTurnBias] = Normal(options.turn_bias_rad_s);
      state[kRangeBias] = Normal(options.range_bias_m);
      state[kBearingBias] = Normal(options.bearing_bias_rad);
    }
  }

  double Normal(double sigma) { return sigma * normal_(engine_); }
  const PlanarVector& truth(int robot) const { return truth_[static_cast<std::size_t>(robot - 1)]; }
  Timestamp now_ns() const { return now_ns_; }
  Eigen::Vector3d Guess(int robot) {
    return truth(robot).head<3>() + Eigen::Vector3d(Normal(options_.start_position_m),
                                                    Normal(options_.start_position_m),
                                                    Normal(options_.start_heading_rad));
  }

  /// A tenth of a second: all drive, and once a second all see. `blind`: robots that see nobody and
  /// whom nobody sees.
  void Step(PlanarTeam& team, int landmarks_seen_by, int blind = 0) {
    const double dt = 0.1;
    for (int r = 1; r <= static_cast<int>(truth_.size()); ++r) {
      const PlanarCommand command{0.3, 0.2 + 0.05 * r};
      team.Odometry(r, now_ns_, command);
      PlanarVector& state = truth_[static_cast<std::size_t>(r - 1)];
      PlanarMatrix noise;
      PlanarVector moved = state;
      DrivePlanar(dt, command, options_, moved, nullptr, &noise);
      moved.head<3>() += noise.topLeftCorner<3, 3>().llt().matrixL() *
                         Eigen::Vector3d(Normal(1), Normal(1), Normal(1));
      state = moved;
    }
    now_ns_ += 100'000'000;
    if (++steps_ % 10 != 0) return;
    for (int r = 1; r <= static_cast<int>(truth_.size()); ++r) {
      for (int l = 0; l < 3 && r <= landmarks_seen_by; ++l) {
        const Eigen::Vector2d place(4.0 * std::cos(2.0 * l), 4.0 * std::sin(2.0 * l));
        team.SeeLandmark(r, now_ns_, 100 + l, place, Sight(r, place));
      }
      const int other = r % static_cast<int>(truth_.size()) + 1;
      if (other != r && r != blind && other != blind) {
        team.SeeRobot(r, now_ns_, other, Sight(r, truth(other).head<2>()));
      }
    }
  }

 private:
  PlanarSight Sight(int robot, const Eigen::Vector2d& place) {
    const PlanarVector& from = truth(robot);
    const Eigen::Vector2d to = place - from.head<2>();
    PlanarSight sight{to.norm(), std::atan2(to.y(), to.x()) - from[kHeading]};
    const Eigen::Matrix2d noise = SightNoise(sight, 0.0, options_);
    sight.range_m += from[kRangeBias] + Normal(std::sqrt(noise(0, 0)));
    sight.bearing_rad += from[kBearingBias] + Normal(std::sqrt(noise(1, 1)));
    return sight;
  }

  PlanarOptions options_;
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
  std::vector<PlanarVector> truth_;
  Timestamp now_ns_ = 0;
  int steps_ = 0;
};

PlanarOptions Honest() {
  PlanarOptions options;
  options.sight_delay_s = 1e-6;  // the world has none
  options.correlation_s = 0.0;   // nor errors that last
  options.student_dof = 0.0;
  return options;
}

TEST(PlanarTeam, ErrorsAreAsLargeAsItSaysT8) {
  const PlanarOptions options = Honest();
  double sum = 0.0;
  int count = 0;
  for (unsigned run = 0; run < 40; ++run) {
    World world(run, 2, options);
    PlanarTeam team(options);
    for (int r = 1; r <= 2; ++r) ASSERT_TRUE(team.Place(r, world.Guess(r), 0).ok());
    for (int k = 0; k < 200; ++k) {
      world.Step(team, 1);
      if (k % 50 != 49) continue;
      for (int r = 1; r <= 2; ++r) {
        const auto belief = team.At(r, world.now_ns());
        Eigen::Vector3d off = belief->state.head<3>() - world.truth(r).head<3>();
        off.z() = std::remainder(off.z(), 2 * M_PI);
        sum += off.dot(belief->covariance.ldlt().solve(off));
        ++count;
      }
    }
  }
  const double nees = sum / count;
  std::printf("NEES of 3: %.2f over %d\n", nees, count);
  // 95 % of the mean of 40 independent runs of which each counts once: 3 +- 0.76.
  EXPECT_GT(nees, 2.2);
  EXPECT_LT(nees, 3.8);
}

TEST(PlanarTeam, SightingsOfEachOtherHelp) {
  double seen = 0.0, unseen = 0.0;
  for (unsigned run = 0; run < 10; ++run) {
    for (const bool mutual : {true, false}) {
      World world(run, 3, Honest());
      PlanarTeam team(Honest());
      for (int r = 1; r <= 3; ++r) ASSERT_TRUE(team.Place(r, world.Guess(r), 0).ok());
      for (int k = 0; k < 300; ++k) world.Step(team, 1, mutual ? 0 : 3);
      (mutual ? seen : unseen) +=
          (team.At(3, world.now_ns())->state - world.truth(3)).head<2>().norm() / 10;
    }
  }
  std::printf("third robot, that sees no landmark: %.2f m; seen by nobody: %.2f m\n", seen, unseen);
  EXPECT_LT(seen, 0.7 * unseen);
}

TEST(PlanarTeam, ARobotThatNobodySeesChangesNothingToTheByteT35) {
  World with(7, 3, PlanarOptions()), alike(7, 3, PlanarOptions());
  PlanarTeam team{PlanarOptions()}, smaller{PlanarOptions()};
  for (int r = 1; r <= 3; ++r) {
    const Eigen::Vector3d pose = with.truth(r).head<3>();
    ASSERT_TRUE(team.Place(r, pose, 0).ok());
    if (r < 3) {
      ASSERT_TRUE(smaller.Place(r, pose, 0).ok());
    }
  }
  for (int k = 0; k < 200; ++k) {
    with.Step(team, 1, 3);
    alike.Step(smaller, 1, 3);  // to which the third's odometry means nothing
    for (int r = 1; r <= 2; ++r) {
      const auto a = team.At(r, with.now_ns()), b = smaller.At(r, with.now_ns());
      ASSERT_EQ(a->state, b->state);
      ASSERT_EQ(a->covariance, b->covariance);
    }
  }
  EXPECT_GT(team.counts().mutual, 0u);
  EXPECT_GT(team.filter().covariance(*team.filter().Find("robot 3")).trace(),
            team.filter().covariance(*team.filter().Find("robot 2")).trace());
}

TEST(PlanarTeam, WhoComesAnewIsPlacedByWhatItSeesAndByWhoSeesIt) {
  World world(11, 3, Honest());
  PlanarTeam team(Honest());
  for (int r = 1; r <= 3; ++r) ASSERT_TRUE(team.Join(r, 0).ok());
  EXPECT_EQ(team.Join(1, 0).code(), absl::StatusCode::kAlreadyExists);
  EXPECT_FALSE(team.At(1, 0));
  int placed = 0;
  for (int k = 0; k < 400; ++k) {
    world.Step(team, 1);
    if (k == 250) {
      EXPECT_TRUE(team.At(3, world.now_ns())) << "sees and is seen by those that see landmarks";
      team.Leave(3);
      EXPECT_FALSE(team.At(3, world.now_ns()));
      ASSERT_TRUE(team.Join(3, world.now_ns()).ok());
    }
    placed += k > 250 && team.At(3, world.now_ns()) ? 1 : 0;
  }
  EXPECT_GT(placed, 50);
  for (int r = 1; r <= 3; ++r) {
    const auto belief = team.At(r, world.now_ns());
    ASSERT_TRUE(belief) << r;
    EXPECT_LT((belief->state - world.truth(r)).head<2>().norm(), 0.5) << r;
  }
}

}  // namespace
}  // namespace saccade::planar_team_test
