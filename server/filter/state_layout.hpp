#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace saccade {

/// What a block of the state is.
enum class BlockKind : std::uint8_t {
  kRobot,    // pose and velocities of a moving camera, as its motion model has
             // them
  kCamera,   // pose of a camera that stands still
  kReadout,  // read-out time of a camera's rolling shutter
  kClone,    // pose that a camera once had: what features hang on
  kFeature,  // a point, as its parametrisation has it
};

/// Names a block as long as it lives; used again afterwards.
using BlockId = int;
inline constexpr BlockId kNoBlock = -1;

/// What stands where in the state: blocks by name, each with its rows.
///
/// Blocks that share no knowledge stand in different islands. An island has rows 0 .. dim - 1 of
/// its own; covariances across islands are zero and are kept nowhere.
class StateLayout {
 public:
  struct Block {
    BlockKind kind = BlockKind::kRobot;
    int island = -1;  // below 0: no such block
    int offset = 0;   // first row in the island
    int size = 0;
  };

  const Block& operator[](BlockId id) const { return blocks_[static_cast<std::size_t>(id)]; }
  int islands() const { return static_cast<int>(dims_.size()); }
  int dim(int island) const { return dims_[static_cast<std::size_t>(island)]; }
  /// Rows of all islands.
  int dim() const;
  /// The blocks of an island, in the order of their rows.
  std::vector<BlockId> Blocks(int island) const;

  void Clear();
  /// An island without blocks; one that has lost its own, if there is.
  int AddIsland();
  /// Appends a block to an island.
  BlockId Add(BlockKind kind, int size, int island);
  /// Takes blocks out of an island (those of others are left alone); its rows that stay, rising.
  std::vector<int> Remove(int island, std::span<const BlockId> gone);
  /// Puts the rows of `from` behind those of `into`; `from` is without blocks then.
  void Join(int into, int from);

 private:
  std::vector<Block> blocks_;  // by id
  std::vector<BlockId> free_;  // ids to be used again
  std::vector<int> dims_;      // by island
};

}  // namespace saccade
