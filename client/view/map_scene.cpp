#include "client/view/map_scene.hpp"

#include <imgui.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "client/view/theme.hpp"

namespace saccade::view {
namespace {

constexpr int kColumns = 12, kRows = 9;
constexpr double kMaxSigmaM = 0.5;  // longer ones say "unknown" well enough
constexpr std::array<int, 2> kColored = {3, 4}, kTextured = {3, 2};

constexpr const char* kPlainVertex = R"(#version 330 core
in vec3 position; in vec4 color; out vec4 shade;
uniform mat4 clip_from_model; uniform float point_px;
void main() {
  gl_Position = clip_from_model * vec4(position, 1.0);
  gl_PointSize = point_px;
  shade = color;
})";
constexpr const char* kPlainFragment = R"(#version 330 core
in vec4 shade; out vec4 color; uniform int round_points;
void main() {
  if (round_points == 1 && length(gl_PointCoord - vec2(0.5)) > 0.5) discard;
  color = shade;
})";
constexpr const char* kTexturedVertex = R"(#version 330 core
in vec3 position; in vec2 uv; out vec2 at; uniform mat4 clip_from_model;
void main() { gl_Position = clip_from_model * vec4(position, 1.0); at = uv; })";
constexpr const char* kTexturedFragment = R"(#version 330 core
in vec2 at; out vec4 color; uniform sampler2D picture;
void main() { color = vec4(texture(picture, at).rgb, 1.0); })";

/// Vertices with colours, used one after the other.
struct Lines {
  std::vector<float> vertices;
  std::vector<std::uint32_t> indices;
  void Add(const Eigen::Vector3d& p, ImU32 color, float alpha = 1) {
    const ImVec4 c = ImGui::ColorConvertU32ToFloat4(color);
    for (const double value : {p.x(), p.y(), p.z()}) vertices.push_back(static_cast<float>(value));
    vertices.insert(vertices.end(), {c.x, c.y, c.z, alpha});
    indices.push_back(static_cast<std::uint32_t>(indices.size()));
  }
};

}  // namespace

Eigen::Matrix4f ClipFromCamera(const CameraModel& camera, double near_m, double far_m) {
  const CameraIntrinsics& lens = camera.intrinsics();
  Eigen::Matrix4d clip = Eigen::Matrix4d::Zero();
  clip(0, 0) = 2 * lens.fx / lens.width;
  clip(0, 2) = 2 * (lens.cx + 0.5) / lens.width - 1;
  clip(1, 1) = -2 * lens.fy / lens.height;
  clip(1, 2) = 1 - 2 * (lens.cy + 0.5) / lens.height;
  clip(2, 2) = (far_m + near_m) / (far_m - near_m);
  clip(2, 3) = -2 * far_m * near_m / (far_m - near_m);
  clip(3, 2) = 1;
  return clip.cast<float>();
}

Eigen::Matrix4f MatrixOf(const Rigid3& transform) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = transform.RotationMatrix();
  matrix.topRightCorner<3, 1>() = transform.translation;
  return matrix.cast<float>();
}

absl::StatusOr<std::unique_ptr<MapScene>> MapScene::Create(const GlFunctions& gl) {
  std::unique_ptr<MapScene> scene(new MapScene(gl));
  constexpr std::array<const char*, 2> kPlainNames = {"position", "color"};
  constexpr std::array<const char*, 2> kTexturedNames = {"position", "uv"};
  auto plain = Program::Create(gl, kPlainVertex, kPlainFragment, kPlainNames);
  if (!plain.ok()) return plain.status();
  auto textured = Program::Create(gl, kTexturedVertex, kTexturedFragment, kTexturedNames);
  if (!textured.ok()) return textured.status();
  scene->plain_ = *std::move(plain);
  scene->textured_ = *std::move(textured);
  auto surfaces = SurfaceLayer::Create(gl);
  if (!surfaces.ok()) return surfaces.status();
  scene->surfaces_ = *std::move(surfaces);
  return scene;
}

MapScene::MapScene(const GlFunctions& gl)
    : gl_(gl),
      grid_(gl, kColored),
      points_(gl, kColored),
      sigmas_(gl, kColored),
      path_(gl, kColored),
      frustum_lines_(gl, kColored),
      frustum_picture_(gl, kTextured) {
  BuildGrid();
}

/// Through the world's origin, across y: 10 cm squares, 2 m wide.
void MapScene::BuildGrid() {
  Lines lines;
  for (int i = -10; i <= 10; ++i) {
    const ImU32 color = i == 0 ? IM_COL32(0x4a, 0x4e, 0x53, 255) : IM_COL32(0x2c, 0x2f, 0x33, 255);
    const double at = 0.1 * i;
    lines.Add({at, 0, -1}, color);
    lines.Add({at, 0, 1}, color);
    lines.Add({-1, 0, at}, color);
    lines.Add({1, 0, at}, color);
  }
  grid_.Upload(lines.vertices, lines.indices);
}

void MapScene::Update(const session::State& state) {
  surfaces_->Update(state.surface);
  if (state.map_version != map_version_) {
    map_version_ = state.map_version;
    Lines dots, ends;
    for (const auto& [id, feature] : state.features) {
      const ImU32 color = ColorOf(feature.state);
      const Eigen::Vector3d& at = feature.point_in_world;
      dots.Add(at, color);
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(feature.covariance_in_world);
      const double sigma_m = std::sqrt(std::max(axes.eigenvalues()[2], 0.0));
      if (!(sigma_m > 0)) continue;
      const Eigen::Vector3d half = std::min(sigma_m, kMaxSigmaM) * axes.eigenvectors().col(2);
      ends.Add(at - half, color, 0.45f);
      ends.Add(at + half, color, 0.45f);
    }
    points_.Upload(dots.vertices, dots.indices, true);
    sigmas_.Upload(ends.vertices, ends.indices, true);
  }
  if (state.path_version == path_version_) return;
  path_version_ = state.path_version;
  Lines path;
  for (const Eigen::Vector3d& at : state.path) path.Add(at, IM_COL32(0x9a, 0xa0, 0xa6, 255), 0.8f);
  path_.Upload(path.vertices, path.indices, true);
}

void MapScene::Show(const net::FrameFacts* facts, const Texture* picture) {
  picture_ = picture;
  if (facts == nullptr || picture == nullptr || !session::IsPlaced(facts->pose)) {
    picture_ = nullptr;
    return;
  }
  if (camera_ != facts->camera) {
    camera_ = facts->camera;
    BuildFrustum(*camera_);
  }
  world_from_camera_ = facts->pose->world_from_camera;
}

/// A pyramid with the picture on its base, 1 m before the eye, bent as the lens bends it.
void MapScene::BuildFrustum(const CameraModel& camera) {
  const auto at = [&camera](int column, int row) -> Eigen::Vector3d {
    const Eigen::Vector2d pixel(camera.width() * column / double{kColumns} - 0.5,
                                camera.height() * row / double{kRows} - 0.5);
    const Eigen::Vector3d ray = camera.Unproject(pixel).value_or(Eigen::Vector3d::UnitZ());
    return ray / std::max(ray.z(), 0.2);
  };
  std::vector<float> vertices;
  std::vector<std::uint32_t> indices;
  for (int row = 0; row <= kRows; ++row) {
    for (int column = 0; column <= kColumns; ++column) {
      const Eigen::Vector3f p = at(column, row).cast<float>();
      vertices.insert(vertices.end(), {p.x(), p.y(), p.z(), static_cast<float>(column) / kColumns,
                                       static_cast<float>(row) / kRows});
      if (row == kRows || column == kColumns) continue;
      const auto a = static_cast<std::uint32_t>(row * (kColumns + 1) + column);
      const std::uint32_t b = a + kColumns + 1;
      indices.insert(indices.end(), {a, b, a + 1, b, b + 1, a + 1});
    }
  }
  frustum_picture_.Upload(vertices, indices);
  Lines lines;
  const ImU32 color = IM_COL32(0xf2, 0xf2, 0xf2, 255);
  const auto segment = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    lines.Add(a, color);
    lines.Add(b, color);
  };
  for (const int column : {0, kColumns}) {
    for (const int row : {0, kRows}) segment(Eigen::Vector3d::Zero(), at(column, row));
    for (int row = 0; row < kRows; ++row) segment(at(column, row), at(column, row + 1));
  }
  for (const int row : {0, kRows}) {
    for (int c = 0; c < kColumns; ++c) segment(at(c, row), at(c + 1, row));
  }
  frustum_lines_.Upload(lines.vertices, lines.indices);
}

void MapScene::Draw(const tools::View& eye, const Eigen::Vector4i& viewport, double frustum_m,
                    float point_px, MapShows shows, ThingLayer& things) {
  gl_.Viewport(viewport[0], viewport[1], viewport[2], viewport[3]);
  gl_.Scissor(viewport[0], viewport[1], viewport[2], viewport[3]);
  gl_.Enable(GL_SCISSOR_TEST);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.Enable(GL_PROGRAM_POINT_SIZE);
  gl_.Enable(GL_BLEND);
  gl_.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  gl_.Disable(GL_CULL_FACE);
  gl_.DepthMask(GL_TRUE);
  gl_.DepthFunc(GL_LEQUAL);
  const ImVec4 ground = ImGui::ColorConvertU32ToFloat4(kGround);
  gl_.ClearColor(ground.x, ground.y, ground.z, 1);
  gl_.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  const Eigen::Matrix4f clip_from_camera = ClipFromCamera(*eye.camera, 0.01, 1000);
  const Eigen::Matrix4f clip_from_world = clip_from_camera * MatrixOf(eye.camera_from_world);
  const bool surfaces = shows != MapShows::kDots && surfaces_->triangles() > 0;
  const bool dots = shows != MapShows::kSurfaces || !surfaces;
  if (surfaces) surfaces_->Draw(clip_from_world, eye.world_from_camera.translation);
  plain_->Use();
  plain_->Set("clip_from_model", clip_from_world);
  plain_->Set("point_px", point_px);
  plain_->Set("round_points", 0);
  grid_.Draw(GL_LINES);
  path_.Draw(GL_LINE_STRIP);
  things.edges().Draw(GL_LINES);
  if (dots) sigmas_.Draw(GL_LINES);
  plain_->Set("round_points", 1);
  if (dots) points_.Draw(GL_POINTS);
  if (picture_ != nullptr) DrawFrustum(clip_from_world, frustum_m);
  things.DrawMap(clip_from_camera, eye.world_from_camera);
}

void MapScene::DrawFrustum(const Eigen::Matrix4f& clip_from_world, double frustum_m) {
  Eigen::Matrix4f model = MatrixOf(world_from_camera_);
  model.topLeftCorner<3, 3>() *= static_cast<float>(frustum_m);
  plain_->Set("round_points", 0);
  plain_->Set("clip_from_model", Eigen::Matrix4f(clip_from_world * model));
  frustum_lines_.Draw(GL_LINES);
  textured_->Use();
  textured_->Set("clip_from_model", Eigen::Matrix4f(clip_from_world * model));
  textured_->Set("picture", 0);
  picture_->Bind(0);
  frustum_picture_.Draw();
}

}  // namespace saccade::view
