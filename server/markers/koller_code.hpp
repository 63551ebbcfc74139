#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>

namespace saccade {

/// Koller's squares: black, inside a frame of 1/8 of the side 3 x 3 cells that are red or black.
/// The first corner cell is always red, the other corners never: that says which way up it is. Row
/// by row the five others are bits 0, 1, parity, 2, 3 of the id; the parity is even. In green light
/// the whole square is black.
inline constexpr int kKollerIds = 16;
inline constexpr double kKollerFrame = 1.0 / 8, kKollerCell = 1.0 / 4;  // of the side

/// Row by row, from the corner that is red.
using KollerCells = std::array<bool, 9>;

KollerCells KollerCellsOf(int id);

/// What `id` is read as in a mirror: a code as good as any.
int MirroredKollerId(int id);

struct KollerReading {
  int id = 0;
  int turns = 0;  // quarter turns clockwise by which its own top left is from the picture's
};

/// InvalidArgument, in words for a person, for what is no square of this kind.
absl::StatusOr<KollerReading> ReadKollerCells(const KollerCells& red);

}  // namespace saccade
