#include "server/sim/scene_renderer.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <numeric>

namespace saccade {
namespace {

constexpr const char* kVertexShader = R"(#version 330 core
in vec3 position;
in vec4 uv;  // xy: texture, zw: light
uniform mat4 clip_from_world;
out vec4 coordinate;
void main() {
  coordinate = uv;
  gl_Position = clip_from_world * vec4(position, 1.0);
})";

constexpr const char* kFragmentShader = R"(#version 330 core
in vec4 coordinate;
uniform sampler2D paint;
uniform sampler2D light;
uniform float light_scale;
out vec4 color;
void main() {
  color = texture(paint, coordinate.xy) * texture(light, coordinate.zw) * light_scale;
})";

std::span<const std::uint8_t> Bytes(const cv::Mat& image) {
  return {image.data, image.total() * image.elemSize()};
}

void AppendVertices(const SurfacePatch& patch, const cv::Size& light_size,
                    std::vector<float>& vertices) {
  for (std::size_t v = 0; v < patch.positions.size(); ++v) {
    const auto stride = static_cast<std::size_t>(patch.columns + 1);
    const float s = static_cast<float>(v % stride) / static_cast<float>(patch.columns);
    const float t = static_cast<float>(v / stride) / static_cast<float>(patch.rows);
    const float light_x =
        static_cast<float>(patch.light_x) + 0.5f + s * static_cast<float>(patch.light_columns - 1);
    const float light_y =
        static_cast<float>(patch.light_y) + 0.5f + t * static_cast<float>(patch.light_rows - 1);
    const Eigen::Vector3f& p = patch.positions[v];
    vertices.insert(vertices.end(), {p.x(), p.y(), p.z(), patch.uv[v].x(), patch.uv[v].y(),
                                     light_x / static_cast<float>(light_size.width),
                                     light_y / static_cast<float>(light_size.height)});
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<SceneRenderer>> SceneRenderer::Create(const RoomScene& scene,
                                                                     const PinholeView& view,
                                                                     GlBackend backend) {
  auto made = std::unique_ptr<SceneRenderer>(new SceneRenderer(view));
  absl::StatusOr<std::unique_ptr<GlContext>> context = GlContext::Create(backend);
  if (!context.ok()) return context.status();
  made->context_ = *std::move(context);
  absl::StatusOr<GlFunctions> gl =
      GlFunctions::Load([&](const char* name) { return made->context_->GetProcAddress(name); });
  if (!gl.ok()) return gl.status();
  made->gl_ = *gl;
  absl::StatusOr<std::unique_ptr<Framebuffer>> target =
      Framebuffer::Create(made->gl_, view.width, view.height);
  if (!target.ok()) return target.status();
  made->target_ = *std::move(target);
  const std::array<const char*, 2> attributes = {"position", "uv"};
  absl::StatusOr<std::unique_ptr<Program>> program =
      Program::Create(made->gl_, kVertexShader, kFragmentShader, attributes);
  if (!program.ok()) return program.status();
  made->program_ = *std::move(program);
  if (const absl::Status uploaded = made->Upload(scene); !uploaded.ok()) return uploaded;
  return made;
}

absl::Status SceneRenderer::Upload(const RoomScene& scene) {
  for (const SurfaceTexture& texture : scene.textures) {
    textures_.push_back(std::make_unique<Texture>(
        gl_, texture.bgr.cols, texture.bgr.rows, PixelLayout::kBgr8, Bytes(texture.bgr),
        Texture::Options{.mipmaps = true, .repeat = texture.repeat}));
  }
  light_ = std::make_unique<Texture>(gl_, scene.light.cols, scene.light.rows, PixelLayout::kBgr8,
                                     Bytes(scene.light),
                                     Texture::Options{.mipmaps = false, .repeat = false});
  // Small things first: what they hide of walls and floor is then never shaded.
  std::vector<std::size_t> order(scene.patches.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<std::size_t> first_use(scene.textures.size(), scene.patches.size());
  for (std::size_t i = 0; i < scene.patches.size(); ++i) {
    auto& first = first_use[static_cast<std::size_t>(scene.patches[i].texture)];
    first = std::min(first, i);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return first_use[static_cast<std::size_t>(scene.patches[a].texture)] >
           first_use[static_cast<std::size_t>(scene.patches[b].texture)];
  });
  std::vector<float> vertices;
  std::vector<std::uint32_t> indices;
  for (const std::size_t p : order) {
    const SurfacePatch& patch = scene.patches[p];
    const auto base = static_cast<std::uint32_t>(vertices.size() / 7);
    AppendVertices(patch, scene.light.size(), vertices);
    if (calls_.empty() || calls_.back().texture != patch.texture) {
      calls_.push_back({patch.texture, indices.size(), 0});
    }
    const auto stride = static_cast<std::uint32_t>(patch.columns + 1);
    for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(patch.rows); ++j) {
      for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(patch.columns); ++i) {
        const std::uint32_t a = base + j * stride + i;
        indices.insert(indices.end(), {a, a + stride, a + 1, a + 1, a + stride, a + stride + 1});
      }
    }
    calls_.back().count = indices.size() - calls_.back().first;
  }
  const std::array<int, 2> sizes = {3, 4};
  mesh_ = std::make_unique<Mesh>(gl_, sizes);
  mesh_->Upload(vertices, indices);
  return CheckGl(gl_, "upload of the room");
}

Eigen::Matrix4f SceneRenderer::ClipFromWorld(const Rigid3& world_from_camera) const {
  // Image v grows along window y, so that the first row read back is the top one.
  Eigen::Matrix4d clip_from_camera = Eigen::Matrix4d::Zero();
  clip_from_camera(0, 0) = 2.0 * view_.fx / view_.width;
  clip_from_camera(0, 2) = 2.0 * (view_.cx + 0.5) / view_.width - 1.0;
  clip_from_camera(1, 1) = 2.0 * view_.fy / view_.height;
  clip_from_camera(1, 2) = 2.0 * (view_.cy + 0.5) / view_.height - 1.0;
  clip_from_camera(2, 2) = (kFar_m + kNear_m) / (kFar_m - kNear_m);
  clip_from_camera(2, 3) = -2.0 * kFar_m * kNear_m / (kFar_m - kNear_m);
  clip_from_camera(3, 2) = 1.0;
  const Rigid3 camera_from_world = world_from_camera.Inverse();
  Eigen::Matrix4d view = Eigen::Matrix4d::Identity();
  view.topLeftCorner<3, 3>() = camera_from_world.RotationMatrix();
  view.topRightCorner<3, 1>() = camera_from_world.translation;
  return (clip_from_camera * view).cast<float>();
}

absl::Status SceneRenderer::Draw(const Rigid3& world_from_camera, cv::Mat& bgra) {
  if (const absl::Status current = context_->MakeCurrent(); !current.ok()) return current;
  target_->Bind();
  gl_.Enable(GL_DEPTH_TEST);
  gl_.Enable(GL_CULL_FACE);
  gl_.FrontFace(GL_CW);  // counter-clockwise before the picture was turned upside down
  gl_.ClearColor(0, 0, 0, 1);
  gl_.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  program_->Use();
  program_->Set("clip_from_world", ClipFromWorld(world_from_camera));
  program_->Set("paint", 0);
  program_->Set("light", 1);
  program_->Set("light_scale", kLightScale);
  light_->Bind(1);
  for (const DrawCall& call : calls_) {
    textures_[static_cast<std::size_t>(call.texture)]->Bind(0);
    mesh_->Draw(GL_TRIANGLES, call.first, static_cast<std::ptrdiff_t>(call.count));
  }
  bgra.create(view_.height, view_.width, CV_8UC4);
  return target_->ReadBgra({bgra.data, bgra.total() * 4});
}

absl::Status SceneRenderer::ReadDepth(cv::Mat& depth_m) {
  if (const absl::Status current = context_->MakeCurrent(); !current.ok()) return current;
  depth_m.create(view_.height, view_.width, CV_32FC1);
  const absl::Status read = target_->ReadDepth({depth_m.ptr<float>(), depth_m.total()});
  if (!read.ok()) return read;
  for (float& depth : std::span(depth_m.ptr<float>(), depth_m.total())) {
    const double ndc = 2.0 * static_cast<double>(depth) - 1.0;
    depth =
        static_cast<float>(2.0 * kFar_m * kNear_m / (kFar_m + kNear_m - ndc * (kFar_m - kNear_m)));
  }
  return absl::OkStatus();
}

}  // namespace saccade
