#include "server/markers/koller_code.hpp"

#include <bit>

namespace saccade {
namespace {

constexpr std::array<int, 4> kCorners = {0, 2, 8, 6};  // clockwise
constexpr std::array<int, 4> kBits = {1, 3, 5, 7};
constexpr int kParity = 4;

/// A quarter turn counter-clockwise.
KollerCells Turned(const KollerCells& cells) {
  KollerCells turned{};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      turned[3 * row + column] = cells[3 * column + 2 - row];
    }
  }
  return turned;
}

}  // namespace

KollerCells KollerCellsOf(int id) {
  KollerCells cells{};
  cells[0] = true;
  for (std::size_t k = 0; k < kBits.size(); ++k) cells[kBits[k]] = ((id >> k) & 1) != 0;
  cells[kParity] = std::popcount(static_cast<unsigned>(id)) % 2 != 0;
  return cells;
}

int MirroredKollerId(int id) {
  // About the diagonal through the red corner: the upper and the left cell change places, and the
  // right and the lower one.
  return (id & 1) << 1 | (id & 2) >> 1 | (id & 4) << 1 | (id & 8) >> 1;
}

absl::StatusOr<KollerReading> ReadKollerCells(const KollerCells& red) {
  int turns = -1, corners = 0;
  for (std::size_t k = 0; k < kCorners.size(); ++k) {
    if (!red[kCorners[k]]) continue;
    turns = static_cast<int>(k);
    ++corners;
  }
  if (corners == 0) return absl::InvalidArgumentError("no corner cell is red");
  if (corners > 1) return absl::InvalidArgumentError("more than one corner cell is red");
  KollerCells upright = red;
  for (int k = 0; k < turns; ++k) upright = Turned(upright);
  KollerReading reading{0, turns};
  for (std::size_t k = 0; k < kBits.size(); ++k) reading.id |= upright[kBits[k]] ? 1 << k : 0;
  if (upright != KollerCellsOf(reading.id)) {
    return absl::InvalidArgumentError("the parity cell does not fit the others");
  }
  return reading;
}

}  // namespace saccade
