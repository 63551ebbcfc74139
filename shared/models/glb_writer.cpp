#include "shared/models/glb_writer.hpp"

#include <bit>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

namespace saccade {
namespace {

using nlohmann::json;

static_assert(std::endian::native == std::endian::little, "GLB is little-endian");

constexpr int kFloat = 5126, kUint = 5125;
constexpr std::uint32_t kGrey = 0xb4b4b4ff;

template <typename Number>
void AppendNumber(Number number, std::string& to) {
  to.append(reinterpret_cast<const char*>(&number), sizeof number);
}

void AppendChunk(std::uint32_t type, std::string data, char filler, std::string& to) {
  data.resize((data.size() + 3) / 4 * 4, filler);
  AppendNumber(static_cast<std::uint32_t>(data.size()), to);
  AppendNumber(type, to);
  to += data;
}

/// As ReadGlb undoes it.
json LinearOf(std::uint32_t color_rgba) {
  json factor = json::array();
  for (int k = 3; k >= 0; --k) {
    const double shown = static_cast<double>(color_rgba >> (8 * k) & 255u) / 255.0;
    factor.push_back(k > 0 ? std::pow(shown, 2.2) : shown);
  }
  return factor;
}

/// y up, z to the viewer.
Eigen::Vector3f ToGltf(const Eigen::Vector3f& p) { return {p.x(), -p.y(), -p.z()}; }

struct GlbParts {
  std::string binary;
  json views = json::array(), accessors = json::array(), primitives = json::array(),
       materials = json::array();

  std::size_t AddAccessor(std::size_t begin, json accessor) {
    views.push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", binary.size() - begin}});
    accessor["bufferView"] = views.size() - 1;
    accessors.push_back(std::move(accessor));
    return accessors.size() - 1;
  }

  void AddPart(const std::vector<Eigen::Vector3f>& corners, std::uint32_t color_rgba) {
    Eigen::Vector3f low = corners.front(), high = low;
    std::size_t begin = binary.size();
    for (const Eigen::Vector3f& p : corners) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
      for (int axis = 0; axis < 3; ++axis) AppendNumber(p[axis], binary);
    }
    const std::size_t positions = AddAccessor(begin, {{"componentType", kFloat},
                                                      {"count", corners.size()},
                                                      {"type", "VEC3"},
                                                      {"min", {low.x(), low.y(), low.z()}},
                                                      {"max", {high.x(), high.y(), high.z()}}});
    begin = binary.size();
    for (std::uint32_t i = 0; i < corners.size(); ++i) AppendNumber(i, binary);
    const std::size_t indices = AddAccessor(
        begin, {{"componentType", kUint}, {"count", corners.size()}, {"type", "SCALAR"}});
    primitives.push_back({{"attributes", {{"POSITION", positions}}},
                          {"indices", indices},
                          {"material", materials.size()}});
    materials.push_back({{"pbrMetallicRoughness",
                          {{"baseColorFactor", LinearOf(color_rgba)}, {"metallicFactor", 0}}}});
  }
};

}  // namespace

std::string WriteGlb(const TriangleMesh& mesh) {
  std::map<std::uint32_t, std::vector<Eigen::Vector3f>> corners;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    std::vector<Eigen::Vector3f>& part =
        corners[mesh.colors_rgba.empty() ? kGrey : mesh.colors_rgba[i]];
    for (const std::uint32_t corner : mesh.triangles[i]) {
      part.push_back(ToGltf(mesh.positions[corner]));
    }
  }
  GlbParts parts;
  for (const auto& [color, part] : corners) parts.AddPart(part, color);
  const json root = {{"asset", {{"version", "2.0"}}},
                     {"scene", 0},
                     {"scenes", {{{"nodes", {0}}}}},
                     {"nodes", {{{"mesh", 0}}}},
                     {"meshes", {{{"primitives", parts.primitives}}}},
                     {"materials", parts.materials},
                     {"accessors", parts.accessors},
                     {"bufferViews", parts.views},
                     {"buffers", {{{"byteLength", parts.binary.size()}}}}};
  std::string body;
  AppendChunk(0x4e4f534a, root.dump(), ' ', body);
  AppendChunk(0x004e4942, std::move(parts.binary), '\0', body);
  std::string file;
  for (const std::uint32_t word : {0x46546c67u, 2u, static_cast<std::uint32_t>(12 + body.size())}) {
    AppendNumber(word, file);
  }
  return file + body;
}

}  // namespace saccade
