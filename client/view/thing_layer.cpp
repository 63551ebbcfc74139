#include "client/view/thing_layer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "shared/models/shapes.hpp"
#include "shared/scene/object_place.hpp"

namespace saccade::view {
namespace {

constexpr int kCellPx = 8;              // of the grid that bends the picture: straight within
constexpr double kSupersampling = 2.0;  // of the edges of what hides, as on the server
constexpr std::array<int, 2> kColored = {3, 4};
constexpr std::array<float, 4> kEdge = {0.545f, 0.565f, 0.592f, 1.0f};

bool SamePlaces(const std::vector<std::optional<Rigid3>>& a,
                const std::vector<std::optional<Rigid3>>& b) {
  return std::ranges::equal(a, b, [](const auto& one, const auto& other) {
    if (!one || !other) return one.has_value() == other.has_value();
    return one->translation == other->translation &&
           one->rotation.coeffs() == other->rotation.coeffs();
  });
}

/// The twelve edges of a box on its base, the four of a plane.
std::vector<std::array<Eigen::Vector3d, 2>> EdgesOf(const SceneObject& object) {
  std::vector<std::array<Eigen::Vector3d, 2>> edges;
  const bool flat = object.shape == SceneShape::kPlane;
  const auto corner = [&object](int i) {
    return Eigen::Vector3d((i & 1 ? 0.5 : -0.5) * object.size_m.x(),
                           i & 2 ? -object.size_m.y() : 0.0,
                           (i & 4 ? 0.5 : -0.5) * object.size_m.z());
  };
  for (int i = 0; i < 8; ++i) {
    for (const int bit : {1, 2, 4}) {
      if ((i & bit) != 0 || (flat && ((i & 2) != 0 || bit == 2))) continue;
      edges.push_back({corner(i), corner(i | bit)});
    }
  }
  return edges;
}

}  // namespace

ThingLayer::ThingLayer(const GlFunctions& gl) : gl_(gl), edges_(gl, kColored) {}

absl::StatusOr<std::unique_ptr<ThingLayer>> ThingLayer::Create(const GlFunctions& gl) {
  std::unique_ptr<ThingLayer> made(new ThingLayer(gl));
  for (std::unique_ptr<ScenePainter>* painter : {&made->video_, &made->map_}) {
    auto created = ScenePainter::Create(gl);
    if (!created.ok()) return created.status();
    *painter = *std::move(created);
  }
  return made;
}

void ThingLayer::Update(const session::State& state, std::span<const MarkerPose> markers) {
  video_->SetLight(state.scene.light());
  map_->SetLight(state.scene.light());
  const std::vector<SceneObject>& objects = state.scene.scene().objects;
  const bool moves = std::ranges::any_of(
      objects, [](const SceneObject& one) { return one.parent != SceneParent::kWorld; });
  std::vector<std::optional<Rigid3>> places;
  if (moves || state.scene.version() != version_) {
    const std::vector<Annotation> marks = state.annotations.List();
    for (const SceneObject& object : objects) {
      places.push_back(WorldFromObject(object, marks, markers));
    }
  }
  if (state.scene.version() == version_ && (!moves || SamePlaces(places, places_))) return;
  version_ = state.scene.version();
  places_ = std::move(places);
  Upload(state.scene.scene());
}

void ThingLayer::Upload(const Scene& scene) {
  std::vector<PlacedMesh> all, outside;
  std::vector<float> vertices;
  std::vector<std::uint32_t> indices;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const SceneObject& object = scene.objects[i];
    const std::optional<Rigid3>& pose = places_[i];
    if (!pose) continue;
    const std::shared_ptr<const SceneModel> model = scene.Model(object.model);
    const PlacedMesh mesh{std::make_shared<const TriangleMesh>(MeshOf(object, model.get())), *pose,
                          object.material};
    all.push_back(mesh);
    const bool shell = object.shape == SceneShape::kRoom || object.shape == SceneShape::kPlane;
    const bool real = object.material == SceneMaterial::kReal;
    if (!(shell && real)) outside.push_back(mesh);
    if (!real || object.shape == SceneShape::kModel) continue;
    for (const std::array<Eigen::Vector3d, 2>& edge : EdgesOf(object)) {
      for (const Eigen::Vector3d& end : edge) {
        const Eigen::Vector3f at = (*pose * end).cast<float>();
        vertices.insert(vertices.end(), {at.x(), at.y(), at.z()});
        vertices.insert(vertices.end(), kEdge.begin(), kEdge.end());
        indices.push_back(static_cast<std::uint32_t>(indices.size()));
      }
    }
  }
  video_->Upload(all);
  map_->Upload(outside);
  edges_.Upload(vertices, indices, true);
}

void ThingLayer::DrawMap(const Eigen::Matrix4f& clip_from_camera, const Rigid3& world_from_eye) {
  if (!map_->empty()) map_->Draw(clip_from_camera, world_from_eye);
}

absl::Status ThingLayer::DrawOffScreen(const tools::View& view) {
  if (picture_ == nullptr || lens_ != view.camera) {
    auto made = ScenePicture::Create(gl_, *view.camera, kSupersampling);
    if (!made.ok()) return made.status();
    picture_ = *std::move(made);
    lens_ = view.camera;
    texture_ = nullptr;
  }
  const auto pixels = picture_->Draw(*video_, view.world_from_camera);
  if (!pixels.ok()) return pixels.status();
  if (texture_ == nullptr) {
    texture_ =
        std::make_unique<Texture>(gl_, picture_->width(), picture_->height(), PixelLayout::kBgra8,
                                  *pixels, Texture::Options{.mipmaps = false, .repeat = false});
  } else {
    texture_->Replace(*pixels);
  }
  return absl::OkStatus();
}

void ThingLayer::DrawVideo(const tools::View& view, float left, float top, float scale,
                           ImDrawList* list) {
  if (video_->empty()) return;
  const absl::Status drawn = DrawOffScreen(view);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
  problem_ = drawn.ok() ? "" : std::string(drawn.message());
  if (!drawn.ok()) return;
  const auto id = reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(texture_->id()));
  const int width = view.camera->width(), height = view.camera->height();
  const int columns = (width + kCellPx - 1) / kCellPx, rows = (height + kCellPx - 1) / kCellPx;
  const auto edge = [](int cell, int size) { return std::min(cell * kCellPx, size); };
  const auto page = [&](int u, int v) {
    return ImVec2(left + scale * static_cast<float>(u), top + scale * static_cast<float>(v));
  };
  list->AddCallback(&ThingLayer::BlendPremultiplied, this);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const int u0 = edge(column, width), u1 = edge(column + 1, width);
      const int v0 = edge(row, height), v1 = edge(row + 1, height);
      const std::array<std::array<int, 2>, 4> corners = {{{u0, v0}, {u1, v0}, {u1, v1}, {u0, v1}}};
      std::array<ImVec2, 4> uv;
      bool inside = true;
      for (std::size_t i = 0; i < 4; ++i) {
        const auto share = picture_->ShareOf({corners[i][0] - 0.5, corners[i][1] - 0.5});
        inside = inside && share;
        if (share) {
          uv[i] = {static_cast<float>(share->x()), static_cast<float>(share->y())};
        }
      }
      if (!inside) continue;
      list->AddImageQuad(id, page(u0, v0), page(u1, v0), page(u1, v1), page(u0, v1), uv[0], uv[1],
                         uv[2], uv[3]);
    }
  }
  list->AddCallback(ImDrawCallback_ResetRenderState, nullptr);
}

void ThingLayer::BlendPremultiplied(const ImDrawList* /*list*/, const ImDrawCmd* command) {
  static_cast<ThingLayer*>(command->UserCallbackData)
      ->gl_.BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
}

}  // namespace saccade::view
