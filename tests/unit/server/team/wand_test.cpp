// Static cameras and a wand with tags, of which nothing is known but what the cameras see.
#include <gtest/gtest.h>

#include <random>

#include "server/team/wand_start.hpp"

namespace saccade::wand_test {
namespace {

constexpr CornerOrder kTheirs = {2, 1, 0, 3};  // of the detector of this world

CameraModel Lens() {
  CameraIntrinsics intrinsics;
  intrinsics.model = LensModel::kBrownConrady;
  intrinsics.width = 1920;
  intrinsics.height = 1200;
  intrinsics.fx = intrinsics.fy = 1500;
  intrinsics.cx = 960;
  intrinsics.cy = 600;
  intrinsics.distortion = {-0.2, 0.1, 0.001, -0.0005, 0};
  return CameraModel(intrinsics);
}

/// A camera at `eye` that looks at `target`, its y axis down along world -z.
Rigid3 LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  Eigen::Matrix3d r;
  r.col(2) = (target - eye).normalized();
  r.col(0) = r.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
  r.col(1) = r.col(2).cross(r.col(0));
  return {Eigen::Quaterniond(r), eye};
}

struct World {
  explicit World(unsigned seed) : engine(seed) {
    body.side_m = 0.12;
    for (int k = 0; k < 4; ++k) {  // round a post
      const Eigen::Quaterniond turn = ExpQuaternion({0, 0, k * M_PI / 2});
      body.wand_from_tag[k] = {turn * ExpQuaternion({M_PI / 2, 0, 0}),
                               turn * Eigen::Vector3d(0, -0.09, 0)};
    }
    body.wand_from_tag[4] = {Eigen::Quaterniond::Identity(), {0.1, 0, 0.15}};
    for (int c = 0; c < 4; ++c) {
      const double a = 0.3 + c * M_PI / 2;
      cameras.push_back(LookAt({3 * std::cos(a), 3 * std::sin(a), 0.5 + 0.5 * c}, {0, 0, 0.5}));
    }
    for (int k = 0; k < 40; ++k) {
      const double t = 0.3 * k;
      wands.push_back(
          {ExpQuaternion({0.3 * std::sin(t), 0.3 * std::cos(1.3 * t), 0.5 * t}),
           {0.7 * std::sin(0.7 * t), 0.7 * std::cos(0.9 * t), 0.5 + 0.3 * std::sin(t)}});
    }
  }

  std::vector<TagSight> See(int instant) {
    std::vector<TagSight> sights;
    const double h = body.side_m / 2;
    const Eigen::Vector3d corners[4] = {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
    for (int c = 0; c < 4; ++c) {
      const Rigid3 camera_from_wand =
          cameras[static_cast<std::size_t>(c)].Inverse() * wands[static_cast<std::size_t>(instant)];
      for (const auto& [tag, wand_from_tag] : body.wand_from_tag) {
        const Rigid3 camera_from_tag = camera_from_wand * wand_from_tag;
        const Eigen::Vector3d normal = camera_from_tag.rotation * Eigen::Vector3d::UnitZ();
        if (-normal.dot(camera_from_tag.translation.normalized()) < 0.35) continue;
        TagSight sight{c, instant, tag, {}};
        bool inside = true;
        for (std::size_t k = 0; k < 4; ++k) {
          const auto pixel =
              lens.Project(camera_from_tag * corners[static_cast<std::size_t>(kTheirs[k])]);
          inside = inside && pixel && lens.InImage(*pixel);
          if (inside) sight.corners[k] = *pixel + Eigen::Vector2d(noise(engine), noise(engine));
        }
        if (inside) sights.push_back(sight);
      }
    }
    return sights;
  }

  std::mt19937 engine;
  std::normal_distribution<double> noise{0.0, 0.3};
  CameraModel lens = Lens();
  WandBody body;
  std::vector<Rigid3> cameras, wands;
};

TEST(WandTeam, FindsCamerasAndWandFromNothingButWhatTheySee) {
  World world(1);
  const std::vector<CameraModel> lenses(4, world.lens);
  std::vector<TagSight> all;
  for (int k = 0; k < 40; ++k) {
    const auto seen = world.See(k);
    all.insert(all.end(), seen.begin(), seen.end());
  }
  const auto order = FindCornerOrder(lenses, world.body, all);
  ASSERT_TRUE(order.ok()) << order.status();
  EXPECT_EQ(*order, kTheirs);
  WandTeam team(lenses, world.body, WandStartOptions());
  std::size_t next = 0;
  for (int k = 0; k < 40; ++k) {
    std::vector<TagSight> here;
    while (next < all.size() && all[next].instant == k) here.push_back(all[next++]);
    team.Add(here, *order);
  }
  team.Finish();
  ASSERT_TRUE(team.fit());
  const Rigid3 world_from_mine = world.cameras[static_cast<std::size_t>(team.reference())];
  for (std::size_t c = 0; c < 4; ++c) {
    ASSERT_TRUE(team.poses().world_from_camera[c]) << c;
    const Rigid3 there = world_from_mine * *team.poses().world_from_camera[c];
    EXPECT_LT((there.translation - world.cameras[c].translation).norm(), 0.01) << c;
    EXPECT_LT(RotationAngle(there, world.cameras[c]), 0.003) << c;
  }
  double sum = 0.0;
  for (std::size_t k = 0; k < 40; ++k) {
    ASSERT_TRUE(team.poses().world_from_wand[k]) << k;
    const Rigid3 there = world_from_mine * *team.poses().world_from_wand[k];
    sum += (there.translation - world.wands[k].translation).squaredNorm();
  }
  EXPECT_LT(std::sqrt(sum / 40), 0.006);
}

TEST(WandTeam, TheOrderOfCornersNeedsTwoTagsAtOnce) {
  World world(2);
  const std::vector<CameraModel> lenses(4, world.lens);
  std::vector<TagSight> one = world.See(0);
  one.resize(1);
  EXPECT_EQ(FindCornerOrder(lenses, world.body, one).status().code(),
            absl::StatusCode::kFailedPrecondition);
  // A wand that is not as its file says.
  World other(3);
  other.body.wand_from_tag[0].translation.x() += 0.05;
  other.body.wand_from_tag[1].translation.z() += 0.05;
  other.body.wand_from_tag[2].rotation = ExpQuaternion({1, 0, 0});
  other.body.wand_from_tag[4].translation.y() += 0.1;
  std::vector<TagSight> all;
  for (int k = 0; k < 10; ++k) {
    const auto seen = world.See(k);
    all.insert(all.end(), seen.begin(), seen.end());
  }
  EXPECT_EQ(FindCornerOrder(lenses, other.body, all).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace saccade::wand_test
