#include "shared/models/glb_writer.hpp"

#include <tiny_gltf.h>

#include <cmath>
#include <cstring>
#include <map>
#include <sstream>
#include <utility>

namespace saccade {
namespace {

constexpr std::uint32_t kGrey = 0xb4b4b4ff;

/// glTF's colours are linear, ours as a screen shows them; as ReadGlb undoes it.
double Linear(std::uint8_t value) { return std::pow(value / 255.0, 2.2); }

class SceneWriter {
 public:
  SceneWriter() {
    model_.asset.version = "2.0";
    model_.asset.generator = "saccade";
    model_.buffers.emplace_back();
    tinygltf::Node root;  // half a turn about x: y up, z to the viewer
    root.name = "saccade";
    root.rotation = {1.0, 0.0, 0.0, 0.0};
    model_.nodes.push_back(root);
    tinygltf::Scene scene;
    scene.nodes = {0};
    model_.scenes.push_back(scene);
    model_.defaultScene = 0;
    model_.extensionsUsed = {"KHR_materials_unlit"};
  }

  void Add(const GlbPart& part) {
    const bool lines = part.triangles.empty();
    const std::vector<std::uint32_t>& indices = lines ? part.lines : part.triangles;
    if (indices.empty() || part.positions.empty()) return;
    tinygltf::Primitive primitive;
    primitive.mode = lines ? TINYGLTF_MODE_LINE : TINYGLTF_MODE_TRIANGLES;
    primitive.attributes["POSITION"] = AddPositions(part.positions);
    if (!part.colors_rgba.empty()) primitive.attributes["COLOR_0"] = AddColors(part.colors_rgba);
    primitive.indices = AddIndices(indices);
    primitive.material = AddMaterial(part);
    tinygltf::Mesh mesh;
    mesh.name = part.name;
    mesh.primitives = {primitive};
    model_.meshes.push_back(mesh);
    tinygltf::Node node;
    node.name = part.name;
    node.mesh = static_cast<int>(model_.meshes.size()) - 1;
    model_.nodes.push_back(node);
    model_.nodes[0].children.push_back(static_cast<int>(model_.nodes.size()) - 1);
  }

  absl::StatusOr<std::string> Finish() {
    if (model_.meshes.empty()) {
      return absl::InvalidArgumentError("scene: there are neither surfaces nor marks in it");
    }
    std::ostringstream out;
    tinygltf::TinyGLTF writer;
    if (!writer.WriteGltfSceneToStream(&model_, out, /*prettyPrint=*/false, /*writeBinary=*/true)) {
      return absl::InternalError("scene: could not be written as GLB");
    }
    return std::move(out).str();
  }

 private:
  template <typename T>
  int AddView(const T* data, std::size_t count, int target) {
    std::vector<unsigned char>& bytes = model_.buffers[0].data;
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = bytes.size();
    view.byteLength = count * sizeof(T);
    view.target = target;
    bytes.resize(bytes.size() + view.byteLength);
    std::memcpy(bytes.data() + view.byteOffset, data, view.byteLength);
    bytes.resize((bytes.size() + 3) / 4 * 4);
    model_.bufferViews.push_back(view);
    return static_cast<int>(model_.bufferViews.size()) - 1;
  }

  int AddAccessor(int view, int component, int type, std::size_t count) {
    tinygltf::Accessor accessor;
    accessor.bufferView = view;
    accessor.componentType = component;
    accessor.type = type;
    accessor.count = count;
    model_.accessors.push_back(accessor);
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  int AddPositions(const std::vector<Eigen::Vector3f>& positions) {
    static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
    const int view = AddView(positions.data(), positions.size(), TINYGLTF_TARGET_ARRAY_BUFFER);
    const int at =
        AddAccessor(view, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3, positions.size());
    Eigen::Vector3f low = positions[0], high = positions[0];
    for (const Eigen::Vector3f& position : positions) {
      low = low.cwiseMin(position);
      high = high.cwiseMax(position);
    }
    tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(at)];
    accessor.minValues = {low.x(), low.y(), low.z()};  // the format asks for them
    accessor.maxValues = {high.x(), high.y(), high.z()};
    return at;
  }

  int AddColors(const std::vector<std::uint8_t>& rgba) {
    std::vector<std::uint16_t> linear(rgba.size());
    for (std::size_t i = 0; i < rgba.size(); ++i) {
      const double value = i % 4 == 3 ? rgba[i] / 255.0 : Linear(rgba[i]);
      linear[i] = static_cast<std::uint16_t>(std::lround(65'535.0 * value));
    }
    const int view = AddView(linear.data(), linear.size(), TINYGLTF_TARGET_ARRAY_BUFFER);
    const int at = AddAccessor(view, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_VEC4,
                               rgba.size() / 4);
    model_.accessors[static_cast<std::size_t>(at)].normalized = true;
    return at;
  }

  int AddIndices(const std::vector<std::uint32_t>& indices) {
    const int view = AddView(indices.data(), indices.size(), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
    return AddAccessor(view, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR,
                       indices.size());
  }

  int AddMaterial(const GlbPart& part) {
    tinygltf::Material material;
    material.doubleSided = true;
    material.extensions["KHR_materials_unlit"] = tinygltf::Value(tinygltf::Value::Object());
    if (part.colors_rgba.empty()) {
      const auto channel = [&part](int shift) {
        return static_cast<std::uint8_t>(part.color_rgba >> shift);
      };
      material.pbrMetallicRoughness.baseColorFactor = {Linear(channel(24)), Linear(channel(16)),
                                                       Linear(channel(8)), channel(0) / 255.0};
    }
    model_.materials.push_back(material);
    return static_cast<int>(model_.materials.size()) - 1;
  }

  tinygltf::Model model_;
};

}  // namespace

absl::StatusOr<std::string> WriteGlb(const std::vector<GlbPart>& parts) {
  SceneWriter writer;
  for (const GlbPart& part : parts) writer.Add(part);
  return writer.Finish();
}

absl::StatusOr<std::string> WriteGlb(const TriangleMesh& mesh) {
  std::map<std::uint32_t, GlbPart> parts;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const std::uint32_t color = mesh.colors_rgba.empty() ? kGrey : mesh.colors_rgba[i];
    GlbPart& part = parts[color];
    part.color_rgba = color;
    for (const std::uint32_t corner : mesh.triangles[i]) {
      part.triangles.push_back(static_cast<std::uint32_t>(part.positions.size()));
      part.positions.push_back(mesh.positions[corner]);
    }
  }
  std::vector<GlbPart> list;
  for (auto& [color, part] : parts) list.push_back(std::move(part));
  return WriteGlb(list);
}

}  // namespace saccade
