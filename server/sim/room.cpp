#include "server/sim/room.hpp"

#include <algorithm>
#include <thread>

#include "server/sim/light_bake.hpp"
#include "server/sim/room_builder.hpp"
#include "server/sim/room_parts.hpp"
#include "server/sim/wearer.hpp"

namespace saccade {
namespace {

constexpr float kPi = 3.14159265f;

/// An area light given in room coordinates.
AreaLight RoomLight(const RoomBuilder& room, const Eigen::Vector3f& centre,
                    const Eigen::Vector3f& half_u, const Eigen::Vector3f& half_v,
                    const Eigen::Vector3f& facing, const Eigen::Vector3f& rgb, int samples) {
  const Eigen::Vector3f origin = room.ToWorld(Eigen::Vector3f::Zero());
  return {.centre = room.ToWorld(centre),
          .half_u = room.ToWorld(half_u) - origin,
          .half_v = room.ToWorld(half_v) - origin,
          .normal = room.ToWorld(facing) - origin,
          .rgb = rgb,
          .samples = samples};
}

std::vector<AreaLight> Lights(const RoomBuilder& room) {
  const Eigen::Vector3f day(10.0f, 11.2f, 12.6f), lamp(20.0f, 19.0f, 17.0f), desk_lamp(40, 31, 20);
  return {
      RoomLight(room, {0.03f, 1.5f, 2.45f}, {0, 0, 0.62f}, {0, 0.57f, 0}, {1, 0, 0}, day, 4),
      RoomLight(room, {1.5f, 2.46f, 1.8f}, {0.29f, 0, 0}, {0, 0, 0.29f}, {0, -1, 0}, lamp, 3),
      RoomLight(room, {2.7f, 2.46f, 2.4f}, {0.29f, 0, 0}, {0, 0, 0.29f}, {0, -1, 0}, lamp, 3),
      RoomLight(room, {2.66f, 1.17f, 0.30f}, {0.04f, 0, 0}, {0, 0, 0.04f}, {0, -1, 0}, desk_lamp,
                2),
  };
}

}  // namespace

RoomMaterials::RoomMaterials(std::uint64_t seed_in, RoomBuilder& room) : seed(seed_in) {
  palette = room.AddTexture(PaintPalette(seed));
  spines = room.AddTexture(PaintSpines(seed));
  cartons = room.AddTexture(PaintCartons(seed));
  papers = room.AddTexture(PaintPapers(seed));
  light_wood = {.texture = room.AddTexture(PaintFurnitureWood(seed, Rgb(206, 178, 138))),
                .tile_m = {0.9f, 0.6f}};
  dark_wood = {.texture = room.AddTexture(PaintFurnitureWood(seed + 1, Rgb(122, 84, 54))),
               .tile_m = {0.9f, 0.6f}};
}

Paint RoomMaterials::Cell(int texture, int column, int row, int columns, int rows) {
  const Eigen::Vector2f size(1.0f / static_cast<float>(columns), 1.0f / static_cast<float>(rows));
  const Eigen::Vector2f at(static_cast<float>(column), static_cast<float>(row));
  return {.texture = texture, .origin = at.cwiseProduct(size), .size = size};
}

Paint RoomMaterials::Plain(PaletteCell cell) const {
  Paint paint = Cell(palette, cell % 8, cell / 8, 8, 8);
  paint.origin += 0.2f * paint.size;  // clear of the neighbours
  paint.size *= 0.6f;
  return paint;
}

void PushWall(RoomBuilder& room, Wall wall) {
  switch (wall) {
    case Wall::kDesk:
      return room.Push({0, 0, 0});
    case Wall::kRight:
      return room.Push({4, 0, 0}, -0.5f * kPi);
    case Wall::kBack:
      return room.Push({4, 0, 4}, kPi);
    case Wall::kLeft:
      return room.Push({0, 0, 4}, 0.5f * kPi);
  }
}

ChessboardTarget SimChessboard() {
  return {.columns = 9, .rows = 6, .square_m = 0.04, .hint_px = {}};
}

RoomScene BuildRoom(std::uint64_t seed) {
  const Rigid3 pose = WorldFromRoom();
  Eigen::Isometry3d world_from_room = Eigen::Isometry3d::Identity();
  world_from_room.translate(pose.translation);
  world_from_room.rotate(pose.rotation);
  RoomBuilder room(world_from_room);
  const RoomMaterials materials(seed, room);
  // Walls first: the renderer draws what comes last first.
  BuildShell(room, materials);
  BuildPictures(room, materials);
  BuildFurniture(room, materials);
  BuildDesk(room, materials);
  const std::vector<AreaLight> lights = Lights(room);
  RoomScene scene = room.Take();
  const unsigned threads = std::clamp(std::thread::hardware_concurrency(), 1u, 4u);
  BakeLight(lights, static_cast<int>(threads), scene);
  return scene;
}

}  // namespace saccade
