#include "shared/wire/surface.hpp"

#include <absl/strings/str_cat.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "shared/wire/to_proto.hpp"

namespace saccade::wire {
namespace {

/// As surface.proto has it: little endian, as every machine that this runs on.
struct CodedCorner {
  std::uint16_t place[3];
  std::uint8_t color_rgb[3];
  std::uint8_t zero[3];
};
static_assert(sizeof(CodedCorner) == 12);

constexpr std::uint32_t kMostCorners = 65'535;
constexpr std::uint32_t kMostTriangles = 4 * kMostCorners;

absl::Status BadChunk(absl::string_view field, absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("surface chunk: ", field, ": ", why));
}

}  // namespace

v1::SurfaceChunk ToProto(const SurfaceChunk& chunk) {
  [[maybe_unused]] static const bool versions = [] {
    meshopt_encodeVertexVersion(0);
    meshopt_encodeIndexVersion(1);
    return true;
  }();
  v1::SurfaceChunk message;
  message.set_x(chunk.index[0]);
  message.set_y(chunk.index[1]);
  message.set_z(chunk.index[2]);
  *message.mutable_origin_in_world_m() =
      ToProto(Eigen::Vector3d(chunk.origin_in_world.cast<double>()));
  message.set_step_m(chunk.step_m);
  if (chunk.triangles.empty()) return message;

  std::vector<std::uint32_t> corners_of;
  corners_of.reserve(3 * chunk.triangles.size());
  for (const SurfaceChunk::Triangle& triangle : chunk.triangles) {
    corners_of.insert(corners_of.end(), triangle.begin(), triangle.end());
  }
  std::vector<CodedCorner> corners(chunk.positions.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i] = {};
    std::copy(chunk.positions[i].begin(), chunk.positions[i].end(), corners[i].place);
    std::copy(chunk.colors_rgb[i].begin(), chunk.colors_rgb[i].end(), corners[i].color_rgb);
  }
  // Neighbours beside each other: that is what the codecs live on.
  meshopt_optimizeVertexCacheStrip(corners_of.data(), corners_of.data(), corners_of.size(),
                                   corners.size());
  corners.resize(meshopt_optimizeVertexFetch(corners.data(), corners_of.data(), corners_of.size(),
                                             corners.data(), corners.size(), sizeof(CodedCorner)));
  message.set_corner_count(static_cast<std::uint32_t>(corners.size()));
  message.set_triangle_count(static_cast<std::uint32_t>(chunk.triangles.size()));

  std::string& coded_corners = *message.mutable_corners();
  coded_corners.resize(meshopt_encodeVertexBufferBound(corners.size(), sizeof(CodedCorner)));
  coded_corners.resize(meshopt_encodeVertexBuffer(
      reinterpret_cast<unsigned char*>(coded_corners.data()), coded_corners.size(), corners.data(),
      corners.size(), sizeof(CodedCorner)));
  std::string& coded_triangles = *message.mutable_triangles();
  coded_triangles.resize(meshopt_encodeIndexBufferBound(corners_of.size(), corners.size()));
  coded_triangles.resize(
      meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(coded_triangles.data()),
                                coded_triangles.size(), corners_of.data(), corners_of.size()));
  return message;
}

absl::StatusOr<SurfaceChunk> FromProto(const v1::SurfaceChunk& message) {
  SurfaceChunk chunk;
  chunk.index = {message.x(), message.y(), message.z()};
  const v1::Vector3& origin = message.origin_in_world_m();
  chunk.origin_in_world = Eigen::Vector3d(origin.x(), origin.y(), origin.z()).cast<float>();
  chunk.step_m = message.step_m();
  if (!chunk.origin_in_world.allFinite() || !std::isfinite(chunk.step_m) || chunk.step_m < 0.0f) {
    return BadChunk("origin_in_world_m, step_m", "not finite");
  }
  if (message.corner_count() == 0) return chunk;
  if (message.corner_count() > kMostCorners) return BadChunk("corner_count", "more than 65535");
  if (message.triangle_count() > kMostTriangles) return BadChunk("triangle_count", "too many");

  std::vector<CodedCorner> corners(message.corner_count());
  if (meshopt_decodeVertexBuffer(corners.data(), corners.size(), sizeof(CodedCorner),
                                 reinterpret_cast<const unsigned char*>(message.corners().data()),
                                 message.corners().size()) != 0) {
    return BadChunk("corners", "damaged, or not of vertex codec 0");
  }
  std::vector<std::uint32_t> corners_of(3 * std::size_t{message.triangle_count()});
  if (meshopt_decodeIndexBuffer(corners_of.data(), corners_of.size(), sizeof(std::uint32_t),
                                reinterpret_cast<const unsigned char*>(message.triangles().data()),
                                message.triangles().size()) != 0) {
    return BadChunk("triangles", "damaged, or not of index codec 1");
  }
  if (std::any_of(corners_of.begin(), corners_of.end(),
                  [&](std::uint32_t corner) { return corner >= corners.size(); })) {
    return BadChunk("triangles", "a corner that is not there");
  }
  chunk.span = 0;
  for (const CodedCorner& corner : corners) {
    for (const std::uint16_t at : corner.place) chunk.span = std::max(chunk.span, at);
    chunk.positions.push_back({corner.place[0], corner.place[1], corner.place[2]});
    chunk.colors_rgb.push_back({corner.color_rgb[0], corner.color_rgb[1], corner.color_rgb[2]});
  }
  for (std::size_t i = 0; i < corners_of.size(); i += 3) {
    chunk.triangles.push_back({static_cast<std::uint16_t>(corners_of[i]),
                               static_cast<std::uint16_t>(corners_of[i + 1]),
                               static_cast<std::uint16_t>(corners_of[i + 2])});
  }
  return chunk;
}

}  // namespace saccade::wire
