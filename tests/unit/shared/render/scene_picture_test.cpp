#include "shared/render/scene_picture.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/gl/gl_context.hpp"
#include "shared/models/shapes.hpp"

namespace saccade::scene_picture_test {
namespace {

constexpr std::uint8_t kShadow = 200;  // alpha: shadows have less

/// An upright box, unturned, by the rules of a ray and its slabs: shares no code with what draws.
struct Box {
  Eigen::Vector3d base_in_world, size_m;

  /// How far along `direction` the ray enters; nothing: it misses.
  std::optional<double> Enter(const Eigen::Vector3d& origin,
                              const Eigen::Vector3d& direction) const {
    const Eigen::Vector3d low =
        base_in_world - Eigen::Vector3d(size_m.x() / 2, size_m.y(), size_m.z() / 2);
    double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (low[axis] - origin[axis]) / direction[axis];
      const double b = (low[axis] + size_m[axis] - origin[axis]) / direction[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter <= leave && enter > 0 ? std::optional(enter) : std::nullopt;
  }
  PlacedMesh Placed(SceneMaterial material) const {
    return {std::make_shared<const TriangleMesh>(BoxMesh(size_m, 0xff8800ff)),
            {Eigen::Quaterniond::Identity(), base_in_world},
            material};
  }
};

/// T33 for the desktop: which pixels of a lens with distortion show the virtual thing, and which
/// what is real before it.
TEST(ScenePicture, ShowsThroughTheLensWhatRaysMeetFirst) {
  auto context = GlContext::Create();
  ASSERT_TRUE(context.ok()) << context.status();
  const auto gl =
      GlFunctions::Load([&](const char* name) { return (*context)->GetProcAddress(name); });
  ASSERT_TRUE(gl.ok()) << gl.status();
  const CameraModel camera(CameraIntrinsics{.model = LensModel::kBrownConrady,
                                            .width = 640,
                                            .height = 480,
                                            .fx = 470,
                                            .fy = 472,
                                            .cx = 322,
                                            .cy = 238,
                                            .distortion = {-0.28, 0.07, 2e-4, 1e-4, 0}});
  const Rigid3 world_from_camera{
      Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d(0.3, 1, 0.1).normalized())),
      {0.1, -0.2, -0.3}};
  const Box thing{{0.3, 0.6, 2.2}, {1.1, 1.2, 0.5}};
  // One is before the thing, one cuts into it, one lies 3 mm before its face: it hides nothing.
  const std::vector<Box> real = {{{0.05, 0.5, 1.4}, {0.3, 0.7, 0.2}},
                                 {{0.75, 0.6, 2.1}, {0.3, 0.5, 0.6}},
                                 {{0.4, -0.2, 1.957}, {0.2, 0.2, 0.02}}};
  std::vector<PlacedMesh> meshes = {thing.Placed(SceneMaterial::kVirtual)};
  for (const Box& box : real) meshes.push_back(box.Placed(SceneMaterial::kReal));
  auto painter = ScenePainter::Create(*gl);
  ASSERT_TRUE(painter.ok()) << painter.status();
  (*painter)->Upload(meshes);
  auto picture = ScenePicture::Create(*gl, camera, /*supersampling=*/2.0);
  ASSERT_TRUE(picture.ok()) << picture.status();
  const auto drawn = (*picture)->Draw(**painter, world_from_camera);
  ASSERT_TRUE(drawn.ok()) << drawn.status();

  int both_seen = 0, either_seen = 0, both_hidden = 0, either_hidden = 0, thin = 0;
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const auto ray = camera.Unproject({u, v});
      const auto share = (*picture)->ShareOf({u, v});
      ASSERT_EQ(ray.has_value(), share.has_value());
      if (!ray) continue;
      const Eigen::Vector3d direction = world_from_camera.rotation * *ray;
      const auto at = [&](const Box& box) {
        const auto along = box.Enter(world_from_camera.translation, direction);
        return along ? *along * ray->z() : std::numeric_limits<double>::infinity();  // depth [m]
      };
      const double depth = at(thing);
      double nearest = std::numeric_limits<double>::infinity();
      for (const Box& box : real) nearest = std::min(nearest, at(box) + kOcclusionBias_m);
      const bool meant = std::isfinite(depth);
      const bool seen = meant && depth < nearest;
      thin += meant && at(real[2]) < depth && seen ? 1 : 0;
      const int x = static_cast<int>(share->x() * (*picture)->width());
      const int y = static_cast<int>(share->y() * (*picture)->height());
      const bool shown =
          (*drawn)[static_cast<std::size_t>(4 * (y * (*picture)->width() + x) + 3)] > kShadow;
      both_seen += seen && shown ? 1 : 0;
      either_seen += seen || shown ? 1 : 0;
      const bool hidden = meant && !seen, not_shown = meant && !shown;
      both_hidden += hidden && not_shown ? 1 : 0;
      either_hidden += hidden || not_shown ? 1 : 0;
    }
  }
  EXPECT_GT(both_seen, 20'000);
  EXPECT_GT(both_hidden, 5'000);
  EXPECT_GT(thin, 500) << "nothing lies within the bias";
  const double seen_iou = static_cast<double>(both_seen) / either_seen;
  const double hidden_iou = static_cast<double>(both_hidden) / either_hidden;
  RecordProperty("seen_iou", std::to_string(seen_iou));
  RecordProperty("hidden_iou", std::to_string(hidden_iou));
  std::printf("seen %.4f of %d px, hidden %.4f of %d px, within the bias %d px\n", seen_iou,
              either_seen, hidden_iou, either_hidden, thin);
  EXPECT_GE(seen_iou, 0.99);
  EXPECT_GE(hidden_iou, 0.98);
}

}  // namespace
}  // namespace saccade::scene_picture_test
