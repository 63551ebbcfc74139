#include "server/map/start_adjustment.hpp"

#include <gtest/gtest.h>

#include <random>

#include "server/filter/point_model.hpp"
#include "server/map/start_guess.hpp"

namespace saccade::start_adjustment_test {
namespace {

constexpr double kSigma_rad = 0.4 / 500.0;

/// A camera that begins to walk and turn, points 1 to 4 m away, all first seen by keyframe 0.
class Walk {
 public:
  Walk(const Eigen::Vector3d& way, double turn_rad, std::uint64_t seed = 1, double readout_s = 0.0)
      : random_(seed), readout_s_(readout_s) {
    for (int k = 0; k < kKeyframes; ++k) {
      const double along = static_cast<double>(k) / (kKeyframes - 1);
      poses_.push_back(
          {ExpQuaternion({0.2 * turn_rad * along, turn_rad * along, 0.0}), along * along * way});
    }
    for (int k = 0; k < kPoints; ++k) {
      const double depth = Uniform(1.0, 4.0);
      points_.emplace_back(depth * Uniform(-0.5, 0.5), depth * Uniform(-0.4, 0.4), depth);
    }
  }

  /// Everything at one distance, nothing known of the way: only the turns, and those as a filter
  /// has them that took half of the parallax for turning.
  StartProblem Problem() {
    StartProblem problem;
    problem.readout_sigma_s = readout_s_ > 0.0 ? 0.015 : 0.0;
    for (const Rigid3& pose : poses_) {
      problem.world_from_camera.push_back({pose.rotation, Eigen::Vector3d::Zero()});
    }
    for (int p = 0; p < kPoints; ++p) {
      StartPoint point;
      point.seen = See(0, p);
      point.bearing = point.seen.ray;
      point.inverse_range = 0.5;
      problem.points.push_back(point);
      for (int k = 1; k < kKeyframes; ++k) problem.sightings.push_back({k, p, See(k, p)});
    }
    return problem;
  }

  /// Puts every point, along its ray, on the plane normal^T X = -distance.
  void Flatten(const Eigen::Vector3d& normal, double distance) {
    const Eigen::Vector3d n = normal.normalized();
    for (Eigen::Vector3d& point : points_) point *= -distance / n.dot(point);
  }

  const std::vector<Rigid3>& poses() const { return poses_; }
  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  static constexpr int kKeyframes = 10, kPoints = 70;

 private:
  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  StartRay See(int keyframe, int point) {
    std::normal_distribution<double> normal(0.0, 0.5 * kSigma_rad);
    const Eigen::Vector3d true_ray = (poses_[static_cast<std::size_t>(keyframe)].Inverse() *
                                      points_[static_cast<std::size_t>(point)])
                                         .normalized();
    StartRay seen;
    // Rows below the middle are exposed later: the picture slides at 1 rad/s, faster at each step.
    seen.d_readout = Eigen::Vector3d(0.1 * keyframe * true_ray.y(), 0.0, 0.0);
    seen.d_readout -= seen.d_readout.dot(true_ray) * true_ray;
    seen.ray = (true_ray - readout_s_ * seen.d_readout +
                Eigen::Vector3d(normal(random_), normal(random_), normal(random_)))
                   .normalized();
    seen.sigma_rad = kSigma_rad;
    return seen;
  }

  std::mt19937_64 random_;
  double readout_s_;
  std::vector<Rigid3> poses_;
  std::vector<Eigen::Vector3d> points_;
};

/// Truth over estimate of the distance between the first and the last keyframe, in the unit of the
/// points' distances: 1 where the scale is right.
double ScaleOf(const StartSolution& solution, const Walk& walk) {
  double sum = 0.0;
  for (std::size_t p = 0; p < walk.points().size(); ++p) {
    sum += std::log(walk.points()[p].norm() * solution.problem.points[p].inverse_range);
  }
  const double unit = std::exp(sum / static_cast<double>(walk.points().size()));
  const double found = (solution.problem.world_from_camera.back().translation -
                        solution.problem.world_from_camera.front().translation)
                           .norm();
  return (walk.poses().back().translation - walk.poses().front().translation).norm() /
         (found * unit);
}

const std::atomic<bool> kGoOn = false;

TEST(SolveStart, FindsTheWayFromNothingButTurns) {
  for (const Eigen::Vector3d& way :
       {Eigen::Vector3d(0.2, 0.0, 0.0), Eigen::Vector3d(-0.1, 0.02, 0.15)}) {
    Walk walk(way, 0.1);
    const auto solution = SolveStart(walk.Problem(), kGoOn);
    ASSERT_TRUE(solution.has_value());
    EXPECT_LT(solution->evidence.scale_sigma, 0.05);
    EXPECT_GT(solution->evidence.known_points, 60);
    EXPECT_GT(solution->evidence.margin, 4.5);
    EXPECT_NEAR(ScaleOf(*solution, walk), 1.0, 3.0 * solution->evidence.scale_sigma);
    EXPECT_GT(
        solution->problem.world_from_camera.back().translation.normalized().dot(way.normalized()),
        0.98);
  }
}

TEST(SolveStart, LeavesTheReversedSolutionThatItIsGiven) {
  Walk walk({0.12, 0.0, 0.05}, 0.05);
  const auto right = SolveStart(walk.Problem(), kGoOn);
  ASSERT_TRUE(right.has_value());
  const auto from_reversed = SolveStart(Reversed(right->problem), kGoOn);
  ASSERT_TRUE(from_reversed.has_value());
  const Eigen::Vector3d way = from_reversed->problem.world_from_camera.back().translation;
  EXPECT_GT(way.dot(walk.poses().back().translation), 0.0);
  EXPECT_LT(from_reversed->evidence.margin, 1e6) << "the reversed one was looked at";
}

// A desk that fills a narrow picture: one plane. What `tum_fr1_xyz` upright (360 x 480) began with.
TEST(SolveStart, LeavesThePlanesOtherReadingThatItIsGiven) {
  Walk walk({0.0, 0.03, 0.25}, 0.1);
  walk.Flatten({0.0, -0.77, -0.64}, 1.2);
  const auto right = SolveStart(walk.Problem(), kGoOn);
  ASSERT_TRUE(right.has_value());
  const auto other = OtherPlane(right->problem);
  ASSERT_TRUE(other.has_value());
  const Eigen::Vector3d true_way = walk.poses().back().translation.normalized();
  EXPECT_LT(other->world_from_camera.back().translation.normalized().dot(true_way), 0.9);
  const auto from_other = SolveStart(*other, kGoOn);
  ASSERT_TRUE(from_other.has_value());
  const Eigen::Vector3d way = from_other->problem.world_from_camera.back().translation;
  EXPECT_GT(way.normalized().dot(true_way), 0.98);
  EXPECT_NEAR(ScaleOf(*from_other, walk), 1.0, 3.0 * from_other->evidence.scale_sigma);
}

TEST(SolveStart, APlaneSeenFromNearlyOnePlaceIsNotDecided) {
  Walk walk({0.0, 0.004, 0.03}, 0.02);
  walk.Flatten({0.0, -0.77, -0.64}, 1.2);
  const auto solution = SolveStart(walk.Problem(), kGoOn);
  ASSERT_TRUE(solution.has_value());
  EXPECT_LT(solution->evidence.margin, 4.5);
}

// Results repeat to the bit, whatever the heap looks like.
TEST(SolveStart, AddressesDoNotMatter) {
  Walk walk({0.2, 0.0, 0.0}, 0.1, 1, 0.01);
  const StartProblem problem = walk.Problem();
  std::mt19937_64 random(5);
  std::vector<std::vector<char>> blocks;
  std::optional<StartSolution> first;
  for (int run = 0; run < 12; ++run) {
    const auto solution = SolveStart(problem, kGoOn);
    ASSERT_TRUE(solution.has_value());
    if (!first) first = solution;
    EXPECT_EQ(solution->problem.readout_s, first->problem.readout_s) << run;
    EXPECT_EQ(solution->evidence.scale_sigma, first->evidence.scale_sigma) << run;
    for (int k = 0; k < 200; ++k) blocks.emplace_back(1 + random() % 4000);
    for (int k = 0; k < 100; ++k) blocks[random() % blocks.size()] = {};
  }
}

TEST(SolveStart, ATurnOrACameraAtRestHoldsNoScale) {
  for (const double turn : {0.0, 0.3}) {
    Walk walk(Eigen::Vector3d::Zero(), turn);
    const auto solution = SolveStart(walk.Problem(), kGoOn);
    if (!solution) continue;
    EXPECT_GT(solution->evidence.scale_sigma, 0.2) << turn;
  }
}

TEST(SolveStart, SigmasAreTrue) {
  double sum = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Walk walk({0.15, 0.03, 0.06}, 0.1, seed);
    const auto solution = SolveStart(walk.Problem(), kGoOn);
    ASSERT_TRUE(solution.has_value());
    // Noise is half of the sigma that is claimed.
    const double sigmas = std::log(ScaleOf(*solution, walk)) / solution->evidence.scale_sigma;
    sum += sigmas * sigmas;
    ++count;
  }
  const double mean = sum / count;
  EXPECT_GT(mean, 0.02);
  EXPECT_LT(mean, 1.5);
}

TEST(SolveStart, FindsTheReadOutTimeOfAShutter) {
  Walk walk({0.2, 0.0, 0.0}, 0.1, 1, 0.02);
  const auto solution = SolveStart(walk.Problem(), kGoOn);
  ASSERT_TRUE(solution.has_value());
  EXPECT_NEAR(solution->problem.readout_s, 0.02, 0.005);
}

TEST(SolveStart, TooLittleOrStoppedIsNothing) {
  Walk walk({0.2, 0.0, 0.0}, 0.1);
  StartProblem few = walk.Problem();
  few.points.resize(5);
  std::erase_if(few.sightings, [](const StartSighting& sighting) { return sighting.point >= 5; });
  EXPECT_FALSE(SolveStart(few, kGoOn).has_value());
  EXPECT_FALSE(SolveStart(StartProblem(), kGoOn).has_value());
  const std::atomic<bool> stop = true;
  EXPECT_FALSE(SolveStart(walk.Problem(), stop).has_value());
}

TEST(ScaleTo, ChangesTheUnitAndNothingElse) {
  Walk walk({0.2, 0.0, 0.1}, 0.1);
  const auto before = SolveStart(walk.Problem(), kGoOn);
  ASSERT_TRUE(before.has_value());
  StartSolution after = *before;
  ScaleTo(7.0, after);
  std::vector<double> ranges;
  for (const StartPoint& point : after.problem.points) ranges.push_back(1.0 / point.inverse_range);
  std::nth_element(ranges.begin(), ranges.begin() + std::ssize(ranges) / 2, ranges.end());
  EXPECT_NEAR(ranges[ranges.size() / 2], 7.0, 0.5);
  EXPECT_NEAR(ScaleOf(after, walk), ScaleOf(*before, walk), 1e-9);
  const Eigen::Index last = 1 + 6 * (Walk::kKeyframes - 1);
  const auto share = [&](const StartSolution& s) {
    return std::sqrt(s.covariance(last, last)) /
           s.problem.world_from_camera.back().translation.norm();
  };
  EXPECT_NEAR(share(after), share(*before), 1e-9 + 1e-6 * share(*before));
}

}  // namespace
}  // namespace saccade::start_adjustment_test
