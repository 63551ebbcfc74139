#include "client/view/surface_layer.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace saccade::view {
namespace {

constexpr std::array<int, 3> kCorner = {3, 3, 3};  // place, normal, colour

constexpr const char* kSurfaceVertex = R"(#version 330 core
in vec3 position; in vec3 normal; in vec3 color;
out vec3 place; out vec3 front; out vec3 shade;
uniform mat4 clip_from_model;
void main() {
  gl_Position = clip_from_model * vec4(position, 1.0);
  gl_Position.z += 0.0003 * gl_Position.w;  // what lies on it is drawn over it
  place = position; front = normal; shade = color;
})";
constexpr const char* kSurfaceFragment = R"(#version 330 core
in vec3 place; in vec3 front; in vec3 shade; out vec4 color;
uniform vec3 eye;
void main() {
  float facing = dot(normalize(front), normalize(eye - place));
  float light = facing > 0.0 ? 0.72 + 0.28 * facing : 0.35;
  color = vec4(light * shade, 1.0);
})";

/// Whether a box may be seen: false only where all corners are outside of one side of the view.
bool MayBeSeen(const Eigen::Matrix4f& clip_from_world, const Eigen::Vector3f& low,
               const Eigen::Vector3f& high) {
  std::array<int, 5> outside = {};
  for (int k = 0; k < 8; ++k) {
    const Eigen::Vector4f corner((k & 1) != 0 ? high.x() : low.x(),
                                 (k & 2) != 0 ? high.y() : low.y(),
                                 (k & 4) != 0 ? high.z() : low.z(), 1.0f);
    const Eigen::Vector4f clip = clip_from_world * corner;
    outside[0] += clip.x() < -clip.w() ? 1 : 0;
    outside[1] += clip.x() > clip.w() ? 1 : 0;
    outside[2] += clip.y() < -clip.w() ? 1 : 0;
    outside[3] += clip.y() > clip.w() ? 1 : 0;
    outside[4] += clip.w() < 0 ? 1 : 0;
  }
  return std::ranges::none_of(outside, [](int count) { return count == 8; });
}

}  // namespace

absl::StatusOr<std::unique_ptr<SurfaceLayer>> SurfaceLayer::Create(const GlFunctions& gl) {
  std::unique_ptr<SurfaceLayer> layer(new SurfaceLayer(gl));
  constexpr std::array<const char*, 3> kNames = {"position", "normal", "color"};
  auto program = Program::Create(gl, kSurfaceVertex, kSurfaceFragment, kNames);
  if (!program.ok()) return program.status();
  layer->program_ = *std::move(program);
  return layer;
}

void SurfaceLayer::Update(const session::SurfaceBook& book) {
  if (book.changes() == changes_) return;
  changes_ = book.changes();
  const SurfaceSnapshot::Chunks& now = book.surface().chunks;
  std::erase_if(chunks_, [&now](const auto& each) { return !now.contains(each.first); });
  triangles_ = 0;
  for (const auto& [index, chunk] : now) {
    triangles_ += chunk->triangles.size();
    Uploaded& uploaded = chunks_[index];
    if (uploaded.chunk != chunk) Upload(chunk, uploaded);
  }
}

void SurfaceLayer::Upload(const std::shared_ptr<const SurfaceChunk>& chunk,
                          Uploaded& uploaded) const {
  const std::size_t corners = chunk->positions.size();
  std::vector<Eigen::Vector3f> places(corners), normals(corners, Eigen::Vector3f::Zero());
  uploaded.low = Eigen::Vector3f::Constant(1e9f);
  uploaded.high = -uploaded.low;
  for (std::size_t i = 0; i < corners; ++i) {
    places[i] = chunk->Point(i);
    uploaded.low = uploaded.low.cwiseMin(places[i]);
    uploaded.high = uploaded.high.cwiseMax(places[i]);
  }
  std::vector<std::uint32_t> indices;
  indices.reserve(3 * chunk->triangles.size());
  for (const SurfaceChunk::Triangle& t : chunk->triangles) {
    const Eigen::Vector3f normal = (places[t[1]] - places[t[0]]).cross(places[t[2]] - places[t[0]]);
    for (const std::uint16_t corner : t) {
      normals[corner] += normal;
      indices.push_back(corner);
    }
  }
  std::vector<float> vertices;
  vertices.reserve(9 * corners);
  for (std::size_t i = 0; i < corners; ++i) {
    const Eigen::Vector3f& at = places[i];
    const Eigen::Vector3f normal = normals[i].normalized();
    const auto& rgb = chunk->colors_rgb[i];
    vertices.insert(vertices.end(),
                    {at.x(), at.y(), at.z(), normal.x(), normal.y(), normal.z(),
                     static_cast<float>(rgb[0]) / 255.0f, static_cast<float>(rgb[1]) / 255.0f,
                     static_cast<float>(rgb[2]) / 255.0f});
  }
  uploaded.chunk = chunk;
  if (!uploaded.mesh) uploaded.mesh = std::make_unique<Mesh>(gl_, kCorner);
  uploaded.mesh->Upload(vertices, indices, /*dynamic=*/true);
}

void SurfaceLayer::Draw(const Eigen::Matrix4f& clip_from_world,
                        const Eigen::Vector3d& eye_in_world) const {
  if (chunks_.empty()) return;
  program_->Use();
  program_->Set("clip_from_model", clip_from_world);
  program_->Set("eye", Eigen::Vector3f(eye_in_world.cast<float>()));
  for (const auto& [index, uploaded] : chunks_) {
    if (MayBeSeen(clip_from_world, uploaded.low, uploaded.high)) uploaded.mesh->Draw();
  }
}

}  // namespace saccade::view
