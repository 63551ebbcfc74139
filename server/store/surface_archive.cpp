#include "server/store/surface_archive.hpp"

#include <algorithm>
#include <vector>

#include "server/map/archive.hpp"

namespace saccade {
namespace {

constexpr std::size_t kLeastChunk = 54;  // bytes of one, in a file

template <typename Archive, typename Triple>
void Triples(Archive& archive, std::vector<Triple>& list) {
  archive.Count(list, sizeof(Triple));
  archive.Block(list.data(), list.size() * sizeof(Triple));
}

template <typename Archive>
void Fields(Archive& archive, SurfaceChunk& chunk) {
  for (std::int32_t& at : chunk.index) archive.Number(at);
  for (int axis = 0; axis < 3; ++axis) archive.Number(chunk.origin_in_world[axis]);
  archive.Number(chunk.step_m);
  archive.Number(chunk.span);
  Triples(archive, chunk.positions);
  Triples(archive, chunk.colors_rgb);
  Triples(archive, chunk.triangles);
  archive.Check(chunk.positions.size() == chunk.colors_rgb.size() && chunk.step_m >= 0.0f);
  for (const SurfaceChunk::Triangle& triangle : chunk.triangles) {
    for (const std::uint16_t corner : triangle) archive.Check(corner < chunk.positions.size());
  }
}

}  // namespace

std::string EncodeSurface(const SurfaceSnapshot& surface) {
  std::vector<SurfaceChunk> chunks;
  for (const auto& [index, chunk] : surface.chunks) {
    if (!chunk->triangles.empty()) chunks.push_back(*chunk);
  }
  ArchiveWriter writer;
  float voxel = surface.voxel;
  writer.Number(voxel);
  writer.Count(chunks, kLeastChunk);
  for (SurfaceChunk& chunk : chunks) Fields(writer, chunk);
  return writer.Take();
}

std::shared_ptr<const SurfaceSnapshot> DecodeSurface(absl::string_view bytes) {
  ArchiveReader reader(bytes);
  auto surface = std::make_shared<SurfaceSnapshot>();
  std::vector<SurfaceChunk> chunks;
  reader.Number(surface->voxel);
  reader.Check(surface->voxel > 0.0f);
  reader.Count(chunks, kLeastChunk);
  for (SurfaceChunk& chunk : chunks) {
    Fields(reader, chunk);
    if (!reader.ok()) return nullptr;
    const SurfaceChunk::Index index = chunk.index;
    surface->chunks[index] = std::make_shared<const SurfaceChunk>(std::move(chunk));
  }
  if (!reader.ok() || !reader.at_end()) return nullptr;
  return surface;
}

}  // namespace saccade
