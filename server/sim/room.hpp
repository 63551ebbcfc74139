#pragma once

#include <cstdint>

#include "server/capture/target.hpp"
#include "server/sim/surface.hpp"

namespace saccade {

/// The printed chessboard on the wall above the desk: 9 x 6 inner corners, 40 mm.
ChessboardTarget SimChessboard();

/// The room, 4 x 4 x 2.5 m: textures, light and the arrangement of small things follow from `seed`.
RoomScene BuildRoom(std::uint64_t seed);

}  // namespace saccade
