#include "server/map/bundle_adjustment.hpp"

#include <gtest/gtest.h>

#include <random>

#include "server/map/keyframe_graph.hpp"

namespace saccade::bundle_adjustment_test {
namespace {

constexpr double kSigma_rad = 0.3 / 500.0;

/// A camera that moves along an arc and looks at points 1 to 4 m away.
class Arc {
 public:
  Arc(int keyframes, int points, double length_m, std::uint64_t seed = 1) : random_(seed) {
    for (int k = 0; k < keyframes; ++k) {
      const double along = static_cast<double>(k) / (keyframes - 1);
      poses_.push_back({ExpQuaternion({0.02 * along, -0.1 * along, 0.05 * along}),
                        {length_m * along, 0.1 * length_m * std::sin(3.0 * along), 0.0}});
    }
    for (int k = 0; k < points; ++k) {
      const double depth = Uniform(1.0, 4.0);
      points_.emplace_back(depth * Uniform(-0.5, 0.5), depth * Uniform(-0.4, 0.4), depth);
    }
  }

  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Eigen::Vector3d Noise(double sigma) {
    std::normal_distribution<double> normal(0.0, sigma);
    return {normal(random_), normal(random_), normal(random_)};
  }
  Eigen::Vector3d Ray(int keyframe, int point, double noise_rad = kSigma_rad) {
    return ((poses_[keyframe].Inverse() * points_[point]).normalized() + Noise(noise_rad))
        .normalized();
  }
  const std::vector<Rigid3>& poses() const { return poses_; }
  const std::vector<Eigen::Vector3d>& points() const { return points_; }

  /// All points first seen by keyframe 0; poses and depths known badly.
  BundleProblem Problem() {
    BundleProblem problem;
    problem.iterations = 30;
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      Rigid3 guess = poses_[k];
      if (k > 0) {
        guess.translation += Noise(0.02);
        guess.rotation = guess.rotation * ExpQuaternion(Noise(0.01));
      }
      problem.keyframes.push_back({guess, false});
    }
    for (int k = 0; k < static_cast<int>(points_.size()); ++k) {
      BundlePoint point;
      point.bearing = point.seen = Ray(0, k);
      point.seen_sigma_rad = kSigma_rad;
      point.inverse_range = Uniform(0.8, 1.25) / points_[k].norm();
      point.prior_inverse_range = point.prior_sigma = point.inverse_range;
      point.parallax_sigmas = 100.0;
      problem.points.push_back(point);
      for (int from = 1; from < static_cast<int>(poses_.size()); ++from) {
        problem.sightings.push_back({from, k, Ray(from, k), kSigma_rad});
      }
    }
    return problem;
  }

  /// Largest error of a keyframe's place after the best scale about keyframe 0 [m].
  double WorstPlace(const BundleProblem& problem, double scale) const {
    double worst = 0.0;
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      worst = std::max(worst, (scale * problem.keyframes[k].world_from_camera.translation -
                               poses_[k].translation)
                                  .norm());
    }
    return worst;
  }
  double Scale(const BundleProblem& problem) const {
    double product = 0.0, square = 0.0;
    for (std::size_t k = 1; k < poses_.size(); ++k) {
      const Eigen::Vector3d& at = problem.keyframes[k].world_from_camera.translation;
      product += at.dot(poses_[k].translation);
      square += at.squaredNorm();
    }
    return product / square;
  }

 private:
  std::mt19937_64 random_;
  std::vector<Rigid3> poses_;
  std::vector<Eigen::Vector3d> points_;
};

TEST(BundleAdjustment, FindsPosesAndDepthsUpToScale) {
  Arc arc(10, 60, 0.5);
  BundleProblem problem = arc.Problem();
  for (std::size_t k = 0; k < problem.sightings.size(); k += 23) {
    problem.sightings[k].ray = (problem.sightings[k].ray + arc.Noise(0.05)).normalized();
  }
  double before = 0.0, after = 0.0;
  for (const BundlePoint& point : problem.points) before += std::log(point.inverse_range);
  ASSERT_TRUE(AdjustBundle(problem, false));
  for (const BundlePoint& point : problem.points) after += std::log(point.inverse_range);
  EXPECT_NEAR((after - before) / 60.0, 0.0, 0.01) << "the scale was not kept";
  const double scale = arc.Scale(problem);
  EXPECT_NEAR(scale, 1.0, 0.1);
  EXPECT_LT(arc.WorstPlace(problem, scale), 0.003);  // 20 mm before
  for (std::size_t k = 0; k < problem.points.size(); ++k) {
    EXPECT_NEAR(scale / problem.points[k].inverse_range, arc.points()[k].norm(),
                0.03 * arc.points()[k].norm());
  }
}

TEST(BundleAdjustment, HoldsWhatIsFixed) {
  Arc arc(10, 60, 0.5);
  BundleProblem problem = arc.Problem();
  for (const int k : {0, 9}) problem.keyframes[k] = {arc.poses()[k], true};
  ASSERT_TRUE(AdjustBundle(problem, false));
  EXPECT_EQ(problem.keyframes[9].world_from_camera.translation, arc.poses()[9].translation);
  EXPECT_LT(arc.WorstPlace(problem, 1.0), 0.003);
}

TEST(BundleAdjustment, KnownPointsGiveMetres) {
  Arc arc(10, 60, 0.5);
  BundleProblem problem = arc.Problem();
  for (BundlePoint& point : problem.points) point.inverse_range *= 1.3;
  for (int k = 0; k < 10; ++k) {
    for (int point = 0; point < 8; ++point) {
      problem.known.push_back({k, arc.points()[point], arc.Ray(k, point), kSigma_rad});
    }
  }
  ASSERT_TRUE(AdjustBundle(problem, false));
  EXPECT_LT(arc.WorstPlace(problem, 1.0), 0.005);
}

TEST(BundleAdjustment, StopsAndChangesNothing) {
  Arc arc(10, 60, 0.5);
  BundleProblem problem = arc.Problem();
  const Eigen::Vector3d before = problem.keyframes[5].world_from_camera.translation;
  EXPECT_FALSE(AdjustBundle(problem, true));
  EXPECT_EQ(problem.keyframes[5].world_from_camera.translation, before);
  BundleProblem nothing;
  EXPECT_FALSE(AdjustBundle(nothing, false));
}

/// Adds keyframes of an arc to a graph; the first gives birth to all points.
void Fill(KeyframeGraph& graph, Arc& arc) {
  for (int k = 0; k < static_cast<int>(arc.poses().size()); ++k) {
    std::vector<GraphSighting> sightings;
    std::vector<GraphBirth> births;
    for (int point = 0; point < static_cast<int>(arc.points().size()); ++point) {
      const FeatureId id = static_cast<FeatureId>(point) + 1;
      if (k == 0) {
        births.push_back({id, arc.Ray(0, point), kSigma_rad, 0.5, 0.25});
      } else {
        sightings.push_back({id, arc.Ray(k, point), kSigma_rad, {}});
      }
    }
    graph.Add(arc.poses()[k], 2.0, sightings, births);
  }
}

std::optional<GraphEstimate> Unknown(FeatureId) { return std::nullopt; }

TEST(KeyframeGraph, MakesAJobThatAdjusts) {
  KeyframeGraph graph{KeyframeGraphOptions()};
  Arc arc(12, 60, 0.5);
  Fill(graph, arc);
  auto job = graph.MakeJob(Unknown);
  ASSERT_TRUE(job.has_value());
  EXPECT_EQ(job->keyframes.size(), 12u);
  EXPECT_EQ(job->points.size(), 60u);
  EXPECT_EQ(job->problem.sightings.size(), 11u * 60u);
  ASSERT_TRUE(AdjustBundle(job->problem, false));
  std::vector<GraphSighting> sightings;
  for (int point = 0; point < 60; ++point) {
    sightings.push_back({static_cast<FeatureId>(point) + 1, arc.Ray(11, point), kSigma_rad, {}});
  }
  graph.Add(arc.poses()[11], 2.0, sightings, {});
  graph.Take(*job);
  EXPECT_LT((graph.Pose(12)->translation - graph.Pose(11)->translation).norm(), 1e-9)
      << "a keyframe added meanwhile moves along";
  const auto next = graph.MakeJob(Unknown);
  ASSERT_TRUE(next.has_value());
  EXPECT_NE(next->problem.points.front().inverse_range, 0.5) << "what was found is not taken over";
}

/// Five old keyframes that are off by noise of `old_m`, and five recent ones that are `drift_m`
/// aside, two of which are held, as the newest stretch's own past is.
KeyframeGraph::Job BackAtAnOldPlace(Arc& arc, double old_m, double drift_m) {
  KeyframeGraph::Job job;
  job.problem = arc.Problem();
  for (int k = 0; k < 10; ++k) {
    BundleKeyframe& keyframe = job.problem.keyframes[static_cast<std::size_t>(k)];
    keyframe.world_from_camera = arc.poses()[static_cast<std::size_t>(k)];
    keyframe.world_from_camera.translation +=
        k < 5 ? arc.Noise(old_m) : Eigen::Vector3d(0.0, drift_m, 0.0);
    keyframe.fixed = k == 5 || k == 6;
    job.keyframes.push_back(k < 5 ? k : 20 + k);
    job.distances_m.push_back(2.0);
  }
  job.first_recent = 5;
  job.newest = 29;
  return job;
}

double MovedOfOld(const KeyframeGraph::Job& before, const KeyframeGraph::Job& after) {
  double most = 0.0;
  for (std::size_t k = 0; k < before.first_recent; ++k) {
    most = std::max(most, (after.problem.keyframes[k].world_from_camera.translation -
                           before.problem.keyframes[k].world_from_camera.translation)
                              .norm());
  }
  return most;
}

TEST(AdjustJob, AnOldPartIsNotBentToADriftedNewOne) {
  Arc arc(10, 60, 0.5);
  const KeyframeGraph::Job before = BackAtAnOldPlace(arc, 0.0, 0.08);
  KeyframeGraph::Job bent = before, job = before;
  ASSERT_TRUE(AdjustBundle(bent.problem, false));
  ASSERT_GT(MovedOfOld(before, bent), 0.02) << "the scene is too easy for this test";
  ASSERT_TRUE(AdjustJob(job, false));
  EXPECT_EQ(MovedOfOld(before, job), 0.0);
  // What is free of the new part comes to where the old part has it.
  const Rigid3& newest = job.problem.keyframes.back().world_from_camera;
  EXPECT_LT((newest.translation - arc.poses().back().translation).norm(), 0.02);
}

TEST(AdjustJob, AnOldPartThatIsALittleOffIsAdjusted) {
  Arc arc(10, 60, 0.5);
  const KeyframeGraph::Job before = BackAtAnOldPlace(arc, 0.004, 0.0);
  KeyframeGraph::Job plain = before, job = before;
  ASSERT_TRUE(AdjustBundle(plain.problem, false));
  ASSERT_TRUE(AdjustJob(job, false));
  EXPECT_GT(MovedOfOld(before, job), 0.001);
  EXPECT_EQ(MovedOfOld(before, job), MovedOfOld(before, plain));
}

TEST(KeyframeGraph, TheNewestStretchWithoutAGapIsRecent) {
  Arc arc(10, 60, 0.5);
  KeyframeGraph graph{KeyframeGraphOptions()};
  std::vector<GraphBirth> births;
  for (int k = 0; k < 60; ++k) births.push_back({static_cast<FeatureId>(k + 1), arc.Ray(0, k)});
  for (int k = 0; k < 10; ++k) {
    std::vector<GraphSighting> seen;
    for (int point = 0; k > 0 && point < 60; ++point) {
      seen.push_back({static_cast<FeatureId>(point + 1), arc.Ray(k, point), kSigma_rad, {}});
    }
    graph.Add(arc.poses()[static_cast<std::size_t>(k)], 2.0, seen,
              k == 0 ? std::span<const GraphBirth>(births) : std::span<const GraphBirth>());
  }
  const auto job = graph.MakeJob([](FeatureId) { return std::nullopt; });
  ASSERT_TRUE(job.has_value());
  EXPECT_EQ(job->first_recent, 0u) << "all of it is one stretch";
  EXPECT_EQ(job->distances_m.size(), job->keyframes.size());
}

TEST(BundleAdjustment, LeavesOutWhatIsBehindACamera) {
  Arc arc(10, 60, 0.5);
  BundleProblem problem = arc.Problem();
  for (const int k : {0, 9}) problem.keyframes[k] = {arc.poses()[k], true};
  problem.sightings[40].ray = -problem.sightings[40].ray;
  problem.known.push_back({3, {0.0, 0.0, -2.0}, Eigen::Vector3d::UnitZ(), kSigma_rad});
  ASSERT_TRUE(AdjustBundle(problem, false));
  EXPECT_LT(arc.WorstPlace(problem, 1.0), 0.003);
}

TEST(KeyframeGraph, AJobOutlivesWhatItWasMadeOf) {
  KeyframeGraphOptions options;
  options.dense_keyframes = 12;
  options.max_keyframes = 12;
  KeyframeGraph graph(options);
  Arc arc(12, 60, 0.5);
  Fill(graph, arc);
  auto job = graph.MakeJob(Unknown);
  ASSERT_TRUE(job.has_value());
  ASSERT_TRUE(AdjustBundle(job->problem, false));
  for (int k = 0; k < 20; ++k) graph.Add(arc.poses()[11], 2.0, {}, {});
  EXPECT_FALSE(graph.Pose(job->newest).has_value());
  graph.Take(*job);  // nothing of it is left
  EXPECT_EQ(graph.size(), 12u);
}

TEST(KeyframeGraph, KeepsWhatFeaturesInUseWereBornIn) {
  using Life = KeyframeGraph::Life;
  for (const Life life : {Life::kInFilter, Life::kAtRest, Life::kGone}) {
    KeyframeGraphOptions options;
    options.dense_keyframes = options.max_keyframes = 12;
    KeyframeGraph graph(options);
    Arc arc(12, 60, 0.5);
    Fill(graph, arc);  // keyframe 0 gives birth to all
    for (int k = 0; k < 20; ++k) {
      graph.Add(arc.poses()[11], 2.0, {}, {}, [life](FeatureId) { return life; });
    }
    EXPECT_EQ(graph.size(), 12u);
    EXPECT_EQ(graph.Pose(0).has_value(), life != Life::kGone);
  }
}

TEST(KeyframeGraph, ForgetsWhatIsAtRestBeforeWhatIsInTheFilter) {
  using Life = KeyframeGraph::Life;
  KeyframeGraphOptions options;
  options.dense_keyframes = options.max_keyframes = 6;
  KeyframeGraph graph(options);
  Arc arc(6, 60, 0.5);
  for (int k = 0; k < 6; ++k) {  // one birth each
    const std::vector<GraphBirth> birth = {
        {static_cast<FeatureId>(k + 1), arc.Ray(k, k), kSigma_rad, 0.5, 0.25}};
    graph.Add(arc.poses()[k], 2.0, {}, birth);
  }
  const auto odd_ones_rest = [](FeatureId id) {
    return id > 6 ? Life::kGone : id % 2 == 1 ? Life::kAtRest : Life::kInFilter;
  };
  const std::vector<GraphBirth> last = {{7, arc.Ray(5, 7), kSigma_rad, 0.5, 0.25}};
  graph.Add(arc.poses()[5], 2.0, {}, last, odd_ones_rest);
  EXPECT_FALSE(graph.Pose(0).has_value()) << "the oldest of those at rest goes first";
  EXPECT_TRUE(graph.Pose(1).has_value());
  EXPECT_FALSE(graph.Recall(1).has_value());
  EXPECT_TRUE(graph.Recall(2).has_value());
}

TEST(KeyframeGraph, ACameraThatOnlyTurnsHasNothingToAdjust) {
  KeyframeGraph graph{KeyframeGraphOptions()};
  Arc arc(12, 60, 0.002);
  Fill(graph, arc);
  EXPECT_FALSE(graph.MakeJob(Unknown).has_value());
}

TEST(KeyframeGraph, StaysSmallAndForgetsWhatItDropped) {
  KeyframeGraphOptions options;
  options.dense_keyframes = 10;
  options.max_keyframes = 30;
  KeyframeGraph graph(options);
  for (int round = 0; round < 4; ++round) {
    Arc arc(30, 20, 0.2, round + 1);
    for (int k = 0; k < 30; ++k) {
      std::vector<GraphSighting> sightings;
      std::vector<GraphBirth> births;
      for (int point = 0; point < 20; ++point) {
        const FeatureId id = static_cast<FeatureId>(20 * round + point) + 1;
        if (k == 0) {
          births.push_back({id, arc.Ray(0, point), kSigma_rad, 0.5, 0.25});
        } else {
          sightings.push_back({id, arc.Ray(k, point), kSigma_rad, {}});
        }
      }
      graph.Add(arc.poses()[k], 2.0, sightings, births);
      EXPECT_LE(graph.size(), 30u);
    }
  }
  EXPECT_LT(graph.size(), 25u) << "old keyframes close to each other stay";
  const auto job = graph.MakeJob(Unknown);
  ASSERT_TRUE(job.has_value());
  for (const FeatureId id : job->points) EXPECT_GT(id, 40u) << "of a keyframe that shares nothing";
}

}  // namespace
}  // namespace saccade::bundle_adjustment_test
