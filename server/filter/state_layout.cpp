#include "server/filter/state_layout.hpp"

#include <algorithm>
#include <numeric>

namespace saccade {

int StateLayout::dim() const { return std::accumulate(dims_.begin(), dims_.end(), 0); }

std::vector<BlockId> StateLayout::Blocks(int island) const {
  std::vector<BlockId> ids;
  for (BlockId id = 0; id < std::ssize(blocks_); ++id) {
    if ((*this)[id].island == island) ids.push_back(id);
  }
  std::sort(ids.begin(), ids.end(),
            [&](BlockId a, BlockId b) { return (*this)[a].offset < (*this)[b].offset; });
  return ids;
}

void StateLayout::Clear() { *this = StateLayout(); }

int StateLayout::AddIsland() {
  const auto empty = std::find(dims_.begin(), dims_.end(), 0);
  if (empty != dims_.end()) return static_cast<int>(empty - dims_.begin());
  dims_.push_back(0);
  return islands() - 1;
}

BlockId StateLayout::Add(BlockKind kind, int size, int island) {
  int& dim = dims_[static_cast<std::size_t>(island)];
  const Block block{kind, island, dim, size};
  dim += size;
  if (free_.empty()) {
    blocks_.push_back(block);
    return static_cast<BlockId>(blocks_.size()) - 1;
  }
  const BlockId id = free_.back();
  free_.pop_back();
  blocks_[static_cast<std::size_t>(id)] = block;
  return id;
}

std::vector<int> StateLayout::Remove(int island, std::span<const BlockId> gone) {
  int& dim = dims_[static_cast<std::size_t>(island)];
  std::vector<char> dropped(static_cast<std::size_t>(dim), 0);
  for (const BlockId id : gone) {
    Block& block = blocks_[static_cast<std::size_t>(id)];
    if (block.island != island) continue;
    std::fill_n(dropped.begin() + block.offset, block.size, char{1});
    block = Block();
    free_.push_back(id);
  }
  std::vector<int> keep, moved(dropped.size(), 0);
  keep.reserve(dropped.size());
  for (std::size_t row = 0; row < dropped.size(); ++row) {
    moved[row] = static_cast<int>(keep.size());
    if (!dropped[row]) keep.push_back(static_cast<int>(row));
  }
  for (Block& block : blocks_) {
    if (block.island == island) block.offset = moved[static_cast<std::size_t>(block.offset)];
  }
  dim = static_cast<int>(keep.size());
  return keep;
}

void StateLayout::Join(int into, int from) {
  for (Block& block : blocks_) {
    if (block.island != from) continue;
    block.island = into;
    block.offset += dim(into);
  }
  dims_[static_cast<std::size_t>(into)] += dim(from);
  dims_[static_cast<std::size_t>(from)] = 0;
}

}  // namespace saccade
