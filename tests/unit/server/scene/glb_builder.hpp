#pragma once

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace saccade {

/// Writes GLB files by hand, so that each test can say exactly what is wrong with its own.
struct GlbBuilder {
  nlohmann::json root = {{"asset", {{"version", "2.0"}}}};
  std::string binary;

  /// One mesh of these corners (3 floats each) and triangles, in one node.
  static GlbBuilder Of(const std::vector<float>& positions,
                       const std::vector<std::uint32_t>& indices) {
    GlbBuilder glb;
    const std::size_t position_bytes = positions.size() * sizeof(float);
    const std::size_t index_bytes = indices.size() * sizeof(std::uint32_t);
    glb.binary.resize(position_bytes + index_bytes);
    std::memcpy(glb.binary.data(), positions.data(), position_bytes);
    std::memcpy(glb.binary.data() + position_bytes, indices.data(), index_bytes);
    glb.root["buffers"] = {{{"byteLength", glb.binary.size()}}};
    glb.root["bufferViews"] = {
        {{"buffer", 0}, {"byteOffset", 0}, {"byteLength", position_bytes}},
        {{"buffer", 0}, {"byteOffset", position_bytes}, {"byteLength", index_bytes}}};
    glb.root["accessors"] = {{{"bufferView", 0},
                              {"componentType", 5126},
                              {"count", positions.size() / 3},
                              {"type", "VEC3"}},
                             {{"bufferView", 1},
                              {"componentType", 5125},
                              {"count", indices.size()},
                              {"type", "SCALAR"}}};
    glb.root["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}}};
    glb.root["nodes"] = {{{"mesh", 0}}};
    glb.root["scenes"] = {{{"nodes", {0}}}};
    glb.root["scene"] = 0;
    return glb;
  }

  static GlbBuilder Triangle() { return Of({0, 0, 0, 1, 0, 0, 0, 2, 0.5f}, {0, 1, 2}); }

  std::string Bytes() const {
    std::string text = root.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string body = binary;
    body.resize((body.size() + 3) / 4 * 4, '\0');
    std::string out = "glTF";
    const auto word = [&out](std::size_t value) {
      const auto narrow = static_cast<std::uint32_t>(value);
      out.append(reinterpret_cast<const char*>(&narrow), 4);
    };
    word(2);
    word(12 + 8 + text.size() + (body.empty() ? 0 : 8 + body.size()));
    word(text.size());
    out += "JSON" + text;
    if (body.empty()) return out;
    word(body.size());
    out.append("BIN\0", 4);
    return out + body;
  }
};

}  // namespace saccade
