#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "server/gl/gl_context.hpp"
#include "shared/render/framebuffer.hpp"
#include "shared/render/gl_functions.hpp"
#include "shared/render/mesh.hpp"
#include "shared/render/program.hpp"
#include "shared/render/texture.hpp"

namespace saccade::render_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kVertex = R"(#version 330 core
in vec3 position;
in vec2 uv;
uniform mat4 clip_from_model;
out vec2 coordinate;
void main() { coordinate = uv; gl_Position = clip_from_model * vec4(position, 1.0); })";
constexpr const char* kFragment = R"(#version 330 core
in vec2 coordinate;
uniform sampler2D paint;
uniform vec4 tint;
out vec4 color;
void main() { color = texture(paint, coordinate) * tint; })";
constexpr std::array<const char*, 2> kAttributes = {"position", "uv"};

class RenderTest : public ::testing::Test {
 protected:
  static constexpr int kSide = 8;

  void SetUp() override {
    absl::StatusOr<std::unique_ptr<GlContext>> context = GlContext::Create();
    ASSERT_TRUE(context.ok()) << context.status();
    context_ = *std::move(context);
    const auto gl =
        GlFunctions::Load([&](const char* name) { return context_->GetProcAddress(name); });
    ASSERT_TRUE(gl.ok()) << gl.status();
    gl_ = *gl;
    auto target = Framebuffer::Create(gl_, kSide, kSide);
    ASSERT_TRUE(target.ok()) << target.status();
    target_ = *std::move(target);
  }

  /// Draws a rectangle with corners at -1 .. 1, z as given, textured with `pixels` (2 x 2, RGBA).
  void DrawSquare(std::span<const std::uint8_t> pixels, float z) {
    auto program = Program::Create(gl_, kVertex, kFragment, kAttributes);
    ASSERT_TRUE(program.ok()) << program.status();
    const Texture texture(gl_, 2, 2, PixelLayout::kRgba8, pixels,
                          {.mipmaps = false, .repeat = false});
    const std::array<int, 2> sizes = {3, 2};
    Mesh mesh(gl_, sizes);
    const std::array<float, 20> vertices = {-1, -1, z, 0, 0, 1, -1, z, 1, 0,
                                            -1, 1,  z, 0, 1, 1, 1,  z, 1, 1};
    const std::array<std::uint32_t, 6> indices = {0, 1, 2, 2, 1, 3};
    mesh.Upload(vertices, indices);
    (*program)->Use();
    (*program)->Set("clip_from_model", Eigen::Matrix4f(Eigen::Matrix4f::Identity()));
    (*program)->Set("tint", Eigen::Vector4f(1, 1, 1, 1));
    (*program)->Set("paint", 0);
    texture.Bind(0);
    mesh.Draw();
  }

  std::array<int, 3> Rgb(int x, int y) {
    std::vector<std::uint8_t> pixels(kSide * kSide * 4);
    EXPECT_TRUE(target_->ReadBgra(pixels).ok());
    const std::uint8_t* p = &pixels[static_cast<std::size_t>(4 * (y * kSide + x))];
    return {p[2], p[1], p[0]};
  }

  std::unique_ptr<GlContext> context_;
  GlFunctions gl_;
  std::unique_ptr<Framebuffer> target_;
};

constexpr std::array<std::uint8_t, 16> kCorners = {255, 0, 0,   255, 0,   255, 0,   255,
                                                   0,   0, 255, 255, 255, 255, 255, 255};

TEST_F(RenderTest, TextureRowsComeBackInTheOrderTheyWereGiven) {
  target_->Bind();
  gl_.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  DrawSquare(kCorners, 0);
  EXPECT_THAT(Rgb(0, 0), ElementsAre(255, 0, 0));
  EXPECT_THAT(Rgb(7, 0), ElementsAre(0, 255, 0));
  EXPECT_THAT(Rgb(0, 7), ElementsAre(0, 0, 255));
  EXPECT_THAT(Rgb(7, 7), ElementsAre(255, 255, 255));
}

TEST_F(RenderTest, DepthKeepsTheNearerOfTwoSurfaces) {
  target_->Bind();
  gl_.Enable(GL_DEPTH_TEST);
  gl_.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  DrawSquare(kCorners, -0.5f);
  const std::array<std::uint8_t, 16> black{};
  DrawSquare(black, 0.5f);
  EXPECT_THAT(Rgb(0, 0), ElementsAre(255, 0, 0));
  std::vector<float> depths(kSide * kSide);
  ASSERT_TRUE(target_->ReadDepth(depths).ok());
  EXPECT_NEAR(depths[10], 0.25f, 1e-4f);
}

TEST_F(RenderTest, ShaderErrorsCarryTheCompilersLog) {
  const auto broken =
      Program::Create(gl_, kVertex, "#version 330 core\nvoid main() { nonsense; }", kAttributes);
  EXPECT_EQ(broken.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(broken.status().message()), HasSubstr("nonsense"));
}

TEST_F(RenderTest, ReadingIntoTooSmallABufferIsRefused) {
  std::vector<std::uint8_t> small(10);
  EXPECT_EQ(target_->ReadBgra(small).code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(RenderTest, ErrorsAreReportedOnceWithTheirPlace) {
  gl_.Enable(0xdead);
  EXPECT_THAT(std::string(CheckGl(gl_, "here").message()), HasSubstr("here"));
  EXPECT_TRUE(CheckGl(gl_, "here").ok());
}

TEST_F(RenderTest, AMissingFunctionIsNamed) {
  const auto gl = GlFunctions::Load([&](const char* name) {
    return std::strcmp(name, "glClear") == 0 ? nullptr : context_->GetProcAddress(name);
  });
  EXPECT_EQ(gl.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(gl.status().message()), HasSubstr("glClear"));
}

}  // namespace
}  // namespace saccade::render_test
