#include "server/filter/robust_pose.hpp"

#include <gtest/gtest.h>

#include "tests/unit/server/filter/random_world.hpp"

namespace saccade::robust_pose_test {
namespace {

/// Known points seen from a camera that the filter expects a little elsewhere.
struct Scene {
  CameraModel lens = TestCamera();
  PosePrior prior;
  Rigid3 truth;
  std::vector<PoseEvidence> evidence;
};

Scene MakeScene(RandomWorld& world, int points, double false_share) {
  Scene scene;
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << 0.02, 0.02, 0.02, 0.015, 0.015, 0.015;
  scene.prior.covariance = sigma.cwiseAbs2().asDiagonal();
  FilterState filter{FilterOptions()};
  Matrix12d covariance = Matrix12d::Zero();
  covariance.topLeftCorner<6, 6>() = scene.prior.covariance;
  filter.Reset(CameraMotion(), covariance);
  const Eigen::Matrix<double, 6, 1> off = sigma.cwiseProduct(world.NormalVector<6>());
  scene.truth = {ExpQuaternion(off.tail<3>()), off.head<3>()};
  for (int k = 0; k < points; ++k) {
    const Eigen::Vector3d point =
        world.Uniform(0.8, 3.0) *
        *scene.lens.Unproject({world.Uniform(60, 580), world.Uniform(60, 420)});
    PoseEvidence match;
    match.point = point;
    match.predicted = *filter.Predicted(scene.lens, point);
    match.noise = 0.25 * Eigen::Matrix2d::Identity();
    match.pixel = PredictFixed(scene.lens, scene.truth, point)->pixel + world.NormalVector<2>(0.5);
    if (k < false_share * points) {  // anywhere inside the gate
      const Eigen::Matrix2d s = match.predicted.covariance + match.noise;
      const Eigen::Matrix2d root = s.llt().matrixL();
      match.pixel = match.predicted.at.pixel +
                    root * Eigen::Vector2d(world.Uniform(-2, 2), world.Uniform(-2, 2));
    }
    scene.evidence.push_back(match);
  }
  return scene;
}

TEST(RobustPose, FalseMatchesInsideTheGatesAreFoundOut) {
  RandomWorld world(11);
  double clean = 0, dirty = 0;
  int accepted_false = 0, lost_true = 0;
  for (int run = 0; run < 100; ++run) {
    const Scene good = MakeScene(world, 20, 0.0);
    const Scene bad = MakeScene(world, 20, 0.4);
    const auto error = [&](const Scene& scene, const RobustPose& pose) {
      return (pose.world_from_camera.translation - scene.truth.translation).squaredNorm();
    };
    clean += error(good, EstimateRobustPose(good.lens, good.prior, good.evidence,
                                            RobustPoseOptions(), world.engine()));
    const RobustPose pose =
        EstimateRobustPose(bad.lens, bad.prior, bad.evidence, RobustPoseOptions(), world.engine());
    dirty += error(bad, pose);
    for (int k = 0; k < 20; ++k) {
      const bool is_false = k < 8;
      accepted_false += is_false && pose.weights[k] > 0.1 ? 1 : 0;
      lost_true += !is_false && pose.weights[k] <= 0.1 ? 1 : 0;
    }
  }
  EXPECT_LT(std::sqrt(dirty / clean), 2.0);  // 12 good ones left of 20
  EXPECT_LT(accepted_false, 40);             // of 800: near the truth by chance
  EXPECT_LT(lost_true, 24);                  // of 1200
}

TEST(RobustPose, CovarianceIsHonest) {
  RandomWorld world(12);
  double nees = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    const Scene scene = MakeScene(world, 15, 0.0);
    const RobustPose pose = EstimateRobustPose(scene.lens, scene.prior, scene.evidence,
                                               RobustPoseOptions(), world.engine());
    Eigen::Matrix<double, 6, 1> error;
    error << scene.truth.translation - pose.world_from_camera.translation,
        LogQuaternion(pose.world_from_camera.rotation.conjugate() * scene.truth.rotation);
    nees += error.dot(pose.covariance.inverse() * error) / kRuns;
  }
  EXPECT_GT(nees, 5.0);
  EXPECT_LT(nees, 7.5);  // a little above 6: Tukey's weights cost efficiency
}

TEST(RobustPose, WithoutEvidenceThePriorStands) {
  RandomWorld world(13);
  const Scene scene = MakeScene(world, 0, 0.0);
  const RobustPose pose =
      EstimateRobustPose(scene.lens, scene.prior, {}, RobustPoseOptions(), world.engine());
  EXPECT_EQ(pose.inliers, 0);
  EXPECT_EQ(pose.world_from_camera.translation, scene.prior.world_from_camera.translation);
}

}  // namespace
}  // namespace saccade::robust_pose_test
