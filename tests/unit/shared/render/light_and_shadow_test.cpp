// How virtual things are lit, and the shadows under those that rest.
#include <gtest/gtest.h>

#include <numeric>

#include "server/gl/gl_context.hpp"
#include "shared/render/contact_shadow.hpp"
#include "shared/render/framebuffer.hpp"
#include "shared/render/scene_painter.hpp"

namespace saccade::light_and_shadow_test {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// Half a metre wide and high, its base at the origin.
std::shared_ptr<const TriangleMesh> Box() {
  auto mesh = std::make_shared<TriangleMesh>();
  for (int k = 0; k < 8; ++k) {
    mesh->positions.emplace_back(k & 1 ? 0.25f : -0.25f, k & 2 ? -0.5f : 0.0f,
                                 k & 4 ? 0.25f : -0.25f);
  }
  for (const auto& q : {std::array{0u, 1u, 3u, 2u},
                        {5u, 4u, 6u, 7u},
                        {4u, 0u, 2u, 6u},
                        {1u, 5u, 7u, 3u},
                        {2u, 3u, 7u, 6u},
                        {4u, 5u, 1u, 0u}}) {
    mesh->triangles.push_back({q[0], q[1], q[2]});
    mesh->triangles.push_back({q[0], q[2], q[3]});
  }
  mesh->colors_rgba.assign(mesh->triangles.size(), 0xffffffff);
  return mesh;
}

/// y = 0; its edge at x = 1 and z = 5.
std::shared_ptr<const TriangleMesh> Floor() {
  auto mesh = std::make_shared<TriangleMesh>();
  mesh->positions = {{-5, 0, -5}, {1, 0, -5}, {1, 0, 5}, {-5, 0, 5}};
  mesh->triangles = {{0, 2, 1}, {0, 3, 2}};
  return mesh;
}

std::vector<PlacedMesh> BoxAt(const Vector3d& at) {
  return {{Floor(), Rigid3(), SceneMaterial::kReal},
          {Box(), {Eigen::Quaterniond::Identity(), at}, SceneMaterial::kVirtual}};
}

float Darkness(const ShadowMesh& shadow) {
  return std::accumulate(shadow.darkness.begin(), shadow.darkness.end(), 0.0f);
}

TEST(ContactShadows, LieUnderWhatRestsAndFadeBesideIt) {
  const ShadowMesh shadow = ContactShadows(BoxAt({0, -1e-4, 0}));
  ASSERT_FALSE(shadow.triangles.empty());
  for (std::size_t k = 0; k < shadow.positions.size(); ++k) {
    const Vector3f& p = shadow.positions[k];
    EXPECT_NEAR(p.y(), 0, 0.004);
    const float beside = std::max(std::abs(p.x()), std::abs(p.z())) - 0.25f;
    if (beside < 1e-5f) {
      EXPECT_NEAR(shadow.darkness[k], 0.5f, 1e-3f);
    }
    if (beside > 0.11f) {
      EXPECT_LT(shadow.darkness[k], 0.01f);
    }
    EXPECT_LT(beside, 0.13f);
  }
  EXPECT_LT(Darkness(ContactShadows(BoxAt({0, -0.1, 0}))), 1e-6f);  // it hovers
}

TEST(ContactShadows, EndWhereThereIsNothingToFallOn) {
  const ShadowMesh shadow = ContactShadows(BoxAt({0.9, 0, 0}));  // over the floor's edge
  bool some = false;
  for (std::size_t k = 0; k < shadow.positions.size(); ++k) {
    if (shadow.positions[k].x() > 1.001f) {
      EXPECT_EQ(shadow.darkness[k], 0.0f);
    }
    some |= shadow.darkness[k] > 0.3f;
  }
  EXPECT_TRUE(some);
}

class PaintedBox : public ::testing::Test {
 protected:
  static constexpr int kSide = 96;

  void SetUp() override {
    auto context = GlContext::Create();
    ASSERT_TRUE(context.ok()) << context.status();
    context_ = *std::move(context);
    auto gl = GlFunctions::Load([&](const char* name) { return context_->GetProcAddress(name); });
    ASSERT_TRUE(gl.ok()) << gl.status();
    gl_ = *gl;
    auto target = Framebuffer::Create(gl_, kSide, kSide);
    ASSERT_TRUE(target.ok()) << target.status();
    target_ = *std::move(target);
    auto painter = ScenePainter::Create(gl_);
    ASSERT_TRUE(painter.ok()) << painter.status();
    painter_ = *std::move(painter);
  }
  void TearDown() override {
    painter_ = nullptr;
    target_ = nullptr;
  }

  /// B G R A, rows from the top, of a camera 2 m before the box and 0.6 m above the floor.
  std::vector<std::uint8_t> Draw() {
    Eigen::Matrix4f clip = Eigen::Matrix4f::Zero();
    clip(0, 0) = clip(1, 1) = 1.6f;
    clip(2, 2) = (50.0f + 0.05f) / (50.0f - 0.05f);
    clip(2, 3) = -2.0f * 50.0f * 0.05f / (50.0f - 0.05f);
    clip(3, 2) = 1.0f;
    target_->Bind();
    gl_.ClearColor(0, 0, 0, 0);
    gl_.Clear(GL_COLOR_BUFFER_BIT);
    painter_->Draw(
        clip, {Eigen::Quaterniond(Eigen::AngleAxisd(-0.15, Vector3d::UnitX())), {0, -0.6, -2}});
    std::vector<std::uint8_t> pixels(kSide * kSide * 4);
    EXPECT_TRUE(target_->ReadBgra(pixels).ok());
    EXPECT_TRUE(CheckGl(gl_, "test").ok());
    return pixels;
  }
  /// Pixels that darken what is behind them and show nothing themselves.
  static int Shadows(const std::vector<std::uint8_t>& pixels) {
    int count = 0;
    for (std::size_t k = 0; k < pixels.size(); k += 4) {
      count += pixels[k] == 0 && pixels[k + 2] == 0 && pixels[k + 3] > 8 && pixels[k + 3] < 200;
    }
    return count;
  }
  /// Of the face that the camera sees.
  static int Front(const std::vector<std::uint8_t>& pixels) {
    return pixels[static_cast<std::size_t>(4 * (kSide / 2 * kSide + kSide / 2))];
  }

  std::unique_ptr<GlContext> context_;
  GlFunctions gl_;
  std::unique_ptr<Framebuffer> target_;
  std::unique_ptr<ScenePainter> painter_;
};

TEST_F(PaintedBox, ThrowsAShadowWhereItRestsAndNoneWhereItHovers) {
  painter_->Upload(BoxAt({0, 0, 0}));
  EXPECT_GT(Shadows(Draw()), 40);
  painter_->Upload(BoxAt({0, -0.1, 0}));
  EXPECT_EQ(Shadows(Draw()), 0);
}

TEST_F(PaintedBox, IsLitAsIsKnownAndElseAsBefore) {
  painter_->Upload(BoxAt({0, 0, 0}));
  const int before = Front(Draw());
  SceneLight light;
  light.toward_in_world = {0, 0, -0.8};
  painter_->SetLight(light);
  EXPECT_EQ(Front(Draw()), before);  // nothing is known
  light.confidence = 1.0;
  light.level = 0.5;
  painter_->SetLight(light);
  const int lit = Front(Draw());
  light.toward_in_world = {0, 0, 0.8};  // from behind the box
  painter_->SetLight(light);
  const int dark = Front(Draw());
  EXPECT_GT(lit, 180);
  EXPECT_LT(dark, 60);
}

}  // namespace
}  // namespace saccade::light_and_shadow_test
