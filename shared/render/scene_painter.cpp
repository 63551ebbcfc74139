#include "shared/render/scene_painter.hpp"

#include <array>
#include <cstdint>
#include <vector>

#include "shared/render/contact_shadow.hpp"

namespace saccade {
namespace {

constexpr std::array<int, 2> kSizes = {3, 4}, kShadowSizes = {3, 1};
constexpr float kHiddenAlpha = 0.65f;

constexpr const char* kVertex = R"(#version 330 core
in vec3 position; in vec4 color;
uniform mat4 camera_from_world; uniform mat4 clip_from_camera;
out vec3 point; flat out vec4 paint;
void main() {
  vec4 in_camera = camera_from_world * vec4(position, 1.0);
  point = in_camera.xyz;
  paint = color;
  gl_Position = clip_from_camera * in_camera;
})";
// Farther by the bias, exactly: depth is written for z + bias, not shifted in the depth buffer's
// own uneven steps.
constexpr const char* kDepthFragment = R"(#version 330 core
in vec3 point; flat in vec4 paint; out vec4 color;
uniform float bias_m; uniform vec2 depth_row;
void main() {
  float z = point.z + bias_m;
  gl_FragDepth = clamp(0.5 * (depth_row.x + depth_row.y / z) + 0.5, 0.0, 1.0);
  color = vec4(0.0);
})";
// A little of the light at the eye stays: it tells faces apart that the room lights alike.
constexpr const char* kShadedFragment = R"(#version 330 core
in vec3 point; flat in vec4 paint; out vec4 color;
uniform float alpha; uniform vec3 toward; uniform float level; uniform float confidence;
void main() {
  vec3 normal = normalize(cross(dFdx(point), dFdy(point)));
  vec3 line = normalize(point);
  if (dot(normal, line) > 0.0) normal = -normal;
  float facing = abs(dot(normal, line));
  float known = level * clamp(1.0 + dot(toward, normal), 0.25, 1.9) * (0.85 + 0.15 * facing);
  float light = mix(0.4 + 0.6 * facing, known, confidence);
  color = vec4(min(paint.rgb * light, vec3(1.0)), 1.0) * alpha;
})";
constexpr const char* kShadowVertex = R"(#version 330 core
in vec3 position; in float darkness;
uniform mat4 camera_from_world; uniform mat4 clip_from_camera;
out float dark;
void main() {
  dark = darkness;
  gl_Position = clip_from_camera * camera_from_world * vec4(position, 1.0);
})";
constexpr const char* kShadowFragment = R"(#version 330 core
in float dark; out vec4 color;
void main() { color = vec4(0.0, 0.0, 0.0, dark); })";

struct Soup {
  std::vector<float> vertices;
  std::vector<std::uint32_t> indices;

  void Add(const PlacedMesh& placed) {
    const TriangleMesh& mesh = *placed.mesh;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const std::uint32_t rgba = mesh.colors_rgba.empty() ? 0xb4b4b4ff : mesh.colors_rgba[i];
      for (const std::uint32_t corner : mesh.triangles[i]) {
        const Eigen::Vector3f p =
            (placed.world_from_mesh * mesh.positions[corner].cast<double>()).cast<float>();
        vertices.insert(vertices.end(), {p.x(), p.y(), p.z()});
        for (const int shift : {24, 16, 8, 0}) {
          vertices.push_back(static_cast<float>(rgba >> shift & 0xff) / 255.0f);
        }
        indices.push_back(static_cast<std::uint32_t>(indices.size()));
      }
    }
  }
};

Eigen::Matrix4f MatrixOf(const Rigid3& transform) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = transform.RotationMatrix();
  matrix.topRightCorner<3, 1>() = transform.translation;
  return matrix.cast<float>();
}

}  // namespace

ScenePainter::ScenePainter(const GlFunctions& gl)
    : gl_(gl),
      real_(gl, kSizes),
      drawn_(gl, kSizes),
      hidden_(gl, kSizes),
      shadows_(gl, kShadowSizes) {}

absl::StatusOr<std::unique_ptr<ScenePainter>> ScenePainter::Create(const GlFunctions& gl) {
  std::unique_ptr<ScenePainter> made(new ScenePainter(gl));
  constexpr std::array<const char*, 2> kNames = {"position", "color"};
  auto depth = Program::Create(gl, kVertex, kDepthFragment, kNames);
  if (!depth.ok()) return depth.status();
  auto shaded = Program::Create(gl, kVertex, kShadedFragment, kNames);
  if (!shaded.ok()) return shaded.status();
  constexpr std::array<const char*, 2> kShadowNames = {"position", "darkness"};
  auto shadow = Program::Create(gl, kShadowVertex, kShadowFragment, kShadowNames);
  if (!shadow.ok()) return shadow.status();
  made->shadow_ = *std::move(shadow);
  made->depth_ = *std::move(depth);
  made->shaded_ = *std::move(shaded);
  return made;
}

void ScenePainter::Upload(std::span<const PlacedMesh> meshes) {
  Soup real, drawn, hidden;
  for (const PlacedMesh& placed : meshes) {
    switch (placed.material) {
      case SceneMaterial::kReal:
        real.Add(placed);
        break;
      case SceneMaterial::kVirtual:
      case SceneMaterial::kGuide:
        drawn.Add(placed);
        break;
      case SceneMaterial::kHidden:
        hidden.Add(placed);
        break;
    }
  }
  real_.Upload(real.vertices, real.indices);
  drawn_.Upload(drawn.vertices, drawn.indices);
  hidden_.Upload(hidden.vertices, hidden.indices);
  const ShadowMesh shadows = ContactShadows(meshes);
  std::vector<float> vertices;
  for (std::size_t k = 0; k < shadows.positions.size(); ++k) {
    const Eigen::Vector3f& p = shadows.positions[k];
    vertices.insert(vertices.end(), {p.x(), p.y(), p.z(), shadows.darkness[k]});
  }
  std::vector<std::uint32_t> indices;
  for (const auto& triangle : shadows.triangles) {
    indices.insert(indices.end(), triangle.begin(), triangle.end());
  }
  shadows_.Upload(vertices, indices);
}

void ScenePainter::Draw(const Eigen::Matrix4f& clip_from_camera, const Rigid3& world_from_camera) {
  const Eigen::Matrix4f camera_from_world = MatrixOf(world_from_camera.Inverse());
  const auto use = [&](Program& program) {
    program.Use();
    program.Set("camera_from_world", camera_from_world);
    program.Set("clip_from_camera", clip_from_camera);
  };
  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(GL_LESS);
  gl_.DepthMask(GL_TRUE);
  gl_.Disable(GL_CULL_FACE);
  gl_.Disable(GL_BLEND);
  gl_.Clear(GL_DEPTH_BUFFER_BIT);
  if (real_.index_count() > 0) {
    use(*depth_);
    depth_->Set("bias_m", static_cast<float>(kOcclusionBias_m));
    depth_->Set("depth_row", Eigen::Vector2f(clip_from_camera(2, 2), clip_from_camera(2, 3)));
    gl_.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    real_.Draw();
    gl_.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  }
  use(*shaded_);
  shaded_->Set("alpha", 1.0f);
  shaded_->Set("level", static_cast<float>(light_.level));
  shaded_->Set("confidence", static_cast<float>(light_.confidence));
  const Eigen::Vector3d toward = world_from_camera.rotation.conjugate() * light_.toward_in_world;
  shaded_->Set("toward", Eigen::Vector3f(toward.cast<float>()));
  if (drawn_.index_count() > 0) drawn_.Draw();
  if (shadows_.index_count() > 0) {
    use(*shadow_);
    gl_.DepthMask(GL_FALSE);
    gl_.Enable(GL_BLEND);
    gl_.BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    shadows_.Draw();
    gl_.Disable(GL_BLEND);
    gl_.DepthMask(GL_TRUE);
  }
  if (hidden_.index_count() == 0) return;
  use(*shaded_);
  gl_.Clear(GL_DEPTH_BUFFER_BIT);
  gl_.Enable(GL_BLEND);
  gl_.BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  shaded_->Set("alpha", kHiddenAlpha);
  // Of what is hidden the nearest surface alone is seen, in whatever order triangles come.
  gl_.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  hidden_.Draw();
  gl_.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  gl_.DepthFunc(GL_LEQUAL);
  hidden_.Draw();
  gl_.Disable(GL_BLEND);
}

}  // namespace saccade
