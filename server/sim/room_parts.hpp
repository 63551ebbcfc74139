#pragma once

#include <cstdint>

#include "server/sim/paint.hpp"
#include "server/sim/room_builder.hpp"

namespace saccade {

/// What several parts of the room share.
struct RoomMaterials {
  std::uint64_t seed = 0;
  int palette = 0, spines = 0, cartons = 0, papers = 0;  // textures
  Paint light_wood, dark_wood;

  RoomMaterials(std::uint64_t seed_in, RoomBuilder& room);
  Paint Plain(PaletteCell cell) const;
  /// A face that shows all of a picture.
  static Paint Whole(int texture) { return {.texture = texture}; }
  /// Cell (column, row) of an atlas of columns x rows.
  static Paint Cell(int texture, int column, int row, int columns, int rows);
};

/// Local frame of a wall: x from its left end to its right, y up from the floor, z into the room.
enum class Wall { kDesk, kRight, kBack, kLeft };
void PushWall(RoomBuilder& room, Wall wall);

/// A thin picture hung on the wall of the current frame, lower left corner at (x, y), size in
/// metres; framed if `frame_m` > 0.
void Hang(RoomBuilder& room, const RoomMaterials& materials, const Paint& picture, float x, float y,
          float width, float height, float frame_m = 0);
/// Books side by side on a board at height `y`, from x0 to x1, their spines at z.
void BookRow(RoomBuilder& room, const RoomMaterials& materials, cv::RNG& rng, float x0, float x1,
             float y, float z, float max_height);
/// A closed cardboard box; `label` 0 .. 2.
void Carton(RoomBuilder& room, const RoomMaterials& materials, int label,
            const Eigen::Vector3f& corner, const Eigen::Vector3f& size);

void BuildShell(RoomBuilder& room, const RoomMaterials& materials);      // walls, window, door
void BuildPictures(RoomBuilder& room, const RoomMaterials& materials);   // what hangs on the walls
void BuildFurniture(RoomBuilder& room, const RoomMaterials& materials);  // what stands about
void BuildDesk(RoomBuilder& room, const RoomMaterials& materials);  // the desk and what is on it

}  // namespace saccade
