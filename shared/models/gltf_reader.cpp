#include "shared/models/gltf_reader.hpp"

#include <absl/strings/str_cat.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>

#include "shared/models/gltf_preflight.hpp"

namespace saccade {
namespace {

constexpr int kMostDepth = 64;

absl::Status BadModel(absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("model: ", why));
}

/// The numbers of an accessor, whatever their type; checked to lie within the file.
class Reader {
 public:
  static absl::StatusOr<Reader> Make(const tinygltf::Model& model, int index, const char* what,
                                     int components) {
    const auto missing = [&](const char* part) {
      return BadModel(absl::StrCat(what, ": its ", part, " is missing; export it again"));
    };
    if (index < 0 || index >= static_cast<int>(model.accessors.size())) return missing("accessor");
    const tinygltf::Accessor& accessor = model.accessors[static_cast<std::size_t>(index)];
    if (accessor.bufferView < 0 ||
        accessor.bufferView >= static_cast<int>(model.bufferViews.size())) {
      return missing("buffer view");
    }
    const auto& view = model.bufferViews[static_cast<std::size_t>(accessor.bufferView)];
    if (view.buffer < 0 || view.buffer >= static_cast<int>(model.buffers.size())) {
      return missing("buffer");
    }
    const auto& data = model.buffers[static_cast<std::size_t>(view.buffer)].data;
    const int size =
        tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
    const int count = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
    if (size <= 0 || count != components) {
      return BadModel(absl::StrCat(what, ": of the wrong type; export it again"));
    }
    Reader reader;
    reader.type_ = accessor.componentType;
    reader.size_ = static_cast<std::size_t>(size);
    reader.count_ = accessor.count;
    const std::size_t element = reader.size_ * static_cast<std::size_t>(components);
    reader.stride_ = view.byteStride == 0 ? element : view.byteStride;
    // Each term is below the file's size or refused: no sum overflows.
    const std::size_t end_of_view = view.byteOffset + view.byteLength;
    const bool inside =
        view.byteOffset <= data.size() && view.byteLength <= data.size() - view.byteOffset &&
        accessor.byteOffset <= view.byteLength && reader.stride_ >= element &&
        (reader.count_ == 0 ||
         (element <= view.byteLength - accessor.byteOffset &&
          reader.count_ - 1 <= (view.byteLength - accessor.byteOffset - element) / reader.stride_));
    if (!inside) {
      return BadModel(absl::StrCat(what, ": ", reader.count_, " elements run beyond the buffer of ",
                                   std::min(end_of_view, data.size()), " bytes; the file is torn"));
    }
    reader.first_ = data.data() + view.byteOffset + accessor.byteOffset;
    return reader;
  }

  std::size_t count() const { return count_; }
  bool IsFloat() const { return type_ == TINYGLTF_COMPONENT_TYPE_FLOAT; }
  bool IsIndex() const {
    return type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
           type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
           type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  }

  Eigen::Vector3d Point(std::size_t i) const {
    float p[3];
    std::memcpy(p, first_ + i * stride_, sizeof p);
    return {p[0], p[1], p[2]};
  }
  std::uint32_t Index(std::size_t i) const {
    std::uint32_t value = 0;  // little-endian
    std::memcpy(&value, first_ + i * stride_, size_);
    return value;
  }

 private:
  const unsigned char* first_ = nullptr;
  std::size_t stride_ = 0, size_ = 0, count_ = 0;
  int type_ = 0;
};

Eigen::Affine3d LocalTransform(const tinygltf::Node& node) {
  Eigen::Affine3d local = Eigen::Affine3d::Identity();
  if (node.matrix.size() == 16) {
    local.matrix() = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());
    return local;
  }
  if (node.translation.size() == 3) {
    local.translate(Eigen::Map<const Eigen::Vector3d>(node.translation.data()));
  }
  if (node.rotation.size() == 4) {
    const Eigen::Quaterniond q(node.rotation[3], node.rotation[0], node.rotation[1],
                               node.rotation[2]);
    local.rotate(q.normalized());
  }
  if (node.scale.size() == 3) local.scale(Eigen::Map<const Eigen::Vector3d>(node.scale.data()));
  return local;
}

std::uint32_t ColorOf(const tinygltf::Model& model, int material) {
  if (material < 0 || material >= static_cast<int>(model.materials.size())) return 0xb4b4b4ff;
  const std::vector<double>& factor =
      model.materials[static_cast<std::size_t>(material)].pbrMetallicRoughness.baseColorFactor;
  std::uint32_t color = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const double linear = factor.size() == 4 ? std::clamp(factor[k], 0.0, 1.0) : 1.0;
    const double shown = k < 3 ? std::pow(linear, 1.0 / 2.2) : linear;
    color = color << 8 | static_cast<std::uint32_t>(std::lround(255.0 * shown));
  }
  return color;
}

/// Walks the nodes and collects triangles.
class Collector {
 public:
  Collector(const tinygltf::Model& model, const GltfLimits& limits)
      : model_(model), limits_(limits) {}

  absl::StatusOr<TriangleMesh> Collect() {
    // glTF: y up, z to the viewer. Here: y down, z away.
    Eigen::Affine3d root = Eigen::Affine3d::Identity();
    root.linear().diagonal() << 1, -1, -1;
    for (const int node : Roots()) {
      if (absl::Status done = Visit(node, root, 0); !done.ok()) return done;
    }
    if (mesh_.empty()) return BadModel("has no triangles");
    return std::move(mesh_);
  }

 private:
  std::vector<int> Roots() const {
    if (!model_.scenes.empty()) {
      const int scene =
          std::clamp(model_.defaultScene, 0, static_cast<int>(model_.scenes.size()) - 1);
      return model_.scenes[static_cast<std::size_t>(scene)].nodes;
    }
    std::vector<bool> child(model_.nodes.size());
    for (const tinygltf::Node& node : model_.nodes) {
      for (const int c : node.children) {
        if (c >= 0 && c < static_cast<int>(child.size())) child[static_cast<std::size_t>(c)] = true;
      }
    }
    std::vector<int> roots;
    for (std::size_t i = 0; i < child.size(); ++i) {
      if (!child[i]) roots.push_back(static_cast<int>(i));
    }
    return roots;
  }

  absl::Status Visit(int index, const Eigen::Affine3d& root_from_parent, int depth) {
    if (index < 0 || index >= static_cast<int>(model_.nodes.size())) {
      return BadModel(absl::StrCat("node ", index, " is missing; export it again"));
    }
    if (depth > kMostDepth || ++visited_ > limits_.nodes) {
      return BadModel("its nodes run in a circle or too deep; export it again");
    }
    const tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(index)];
    const Eigen::Affine3d root_from_node = root_from_parent * LocalTransform(node);
    if (node.mesh >= static_cast<int>(model_.meshes.size())) {
      return BadModel(absl::StrCat("mesh ", node.mesh, " is missing; export it again"));
    }
    if (node.mesh >= 0) {
      for (const auto& part : model_.meshes[static_cast<std::size_t>(node.mesh)].primitives) {
        if (absl::Status added = Add(part, root_from_node); !added.ok()) return added;
      }
    }
    for (const int child : node.children) {
      if (absl::Status done = Visit(child, root_from_node, depth + 1); !done.ok()) return done;
    }
    return absl::OkStatus();
  }

  absl::Status Add(const tinygltf::Primitive& part, const Eigen::Affine3d& root_from_node) {
    const int mode = part.mode < 0 ? TINYGLTF_MODE_TRIANGLES : part.mode;
    if (mode < TINYGLTF_MODE_TRIANGLES) return absl::OkStatus();  // points and lines
    const auto position = part.attributes.find("POSITION");
    const absl::StatusOr<Reader> points = Reader::Make(
        model_, position == part.attributes.end() ? -1 : position->second, "positions", 3);
    if (!points.ok()) return points.status();
    if (!points->IsFloat())
      return BadModel("positions are not float; export it without quantisation");
    std::vector<std::uint32_t> corners;
    if (part.indices >= 0) {
      const absl::StatusOr<Reader> indices = Reader::Make(model_, part.indices, "indices", 1);
      if (!indices.ok()) return indices.status();
      if (!indices->IsIndex()) return BadModel("indices are no whole numbers; export it again");
      if (absl::Status room = Room(points->count(), indices->count(), mode); !room.ok()) {
        return room;
      }
      for (std::size_t i = 0; i < indices->count(); ++i) corners.push_back(indices->Index(i));
    } else {
      if (absl::Status room = Room(points->count(), points->count(), mode); !room.ok()) {
        return room;
      }
      for (std::size_t i = 0; i < points->count(); ++i) {
        corners.push_back(static_cast<std::uint32_t>(i));
      }
    }
    for (const std::uint32_t corner : corners) {
      if (corner >= points->count()) {
        return BadModel(absl::StrCat("a triangle names vertex ", corner, " of ", points->count(),
                                     "; the file is damaged"));
      }
    }
    const auto base = static_cast<std::uint32_t>(mesh_.positions.size());
    for (std::size_t i = 0; i < points->count(); ++i) {
      const Eigen::Vector3d p = root_from_node * points->Point(i);
      if (!p.allFinite()) {
        return BadModel(absl::StrCat("vertex ", i, " is not a finite number; export it again"));
      }
      if (p.cwiseAbs().maxCoeff() > limits_.extent_m) {
        return BadModel(absl::StrCat("vertex ", i, " is farther than ", limits_.extent_m,
                                     " m from the origin; export it in metres"));
      }
      mesh_.positions.emplace_back(p.cast<float>());
    }
    const bool mirrored = root_from_node.linear().determinant() < 0;
    const std::uint32_t color = ColorOf(model_, part.material);
    AddTriangles(mode, corners, base, mirrored, color);
    return absl::OkStatus();
  }

  absl::Status Room(std::size_t vertices, std::size_t corners, int mode) const {
    const std::size_t triangles = mode == TINYGLTF_MODE_TRIANGLES ? corners / 3 : corners;
    // Instances count each time: a small file may ask for many.
    if (mesh_.positions.size() + vertices > limits_.vertices ||
        mesh_.triangles.size() + triangles > limits_.triangles) {
      return absl::ResourceExhaustedError(
          absl::StrCat("model: more than ", limits_.triangles, " triangles or ", limits_.vertices,
                       " vertices; simplify it (Blender: modifier Decimate) and export it again"));
    }
    return absl::OkStatus();
  }

  void AddTriangles(int mode, const std::vector<std::uint32_t>& corners, std::uint32_t base,
                    bool mirrored, std::uint32_t color) {
    const std::size_t step = mode == TINYGLTF_MODE_TRIANGLES ? 3 : 1;
    for (std::size_t i = 0; i + 2 < corners.size(); i += step) {
      TriangleMesh::Triangle t = {corners[mode == TINYGLTF_MODE_TRIANGLE_FAN ? 0 : i],
                                  corners[i + 1], corners[i + 2]};
      const bool odd = mode == TINYGLTF_MODE_TRIANGLE_STRIP && i % 2 == 1;
      if (odd != mirrored) std::swap(t[1], t[2]);
      if (t[0] == t[1] || t[1] == t[2] || t[0] == t[2]) continue;
      mesh_.triangles.push_back({base + t[0], base + t[1], base + t[2]});
      mesh_.colors_rgba.push_back(color);
    }
  }

  const tinygltf::Model& model_;
  const GltfLimits& limits_;
  std::size_t visited_ = 0;
  TriangleMesh mesh_;
};

}  // namespace

absl::StatusOr<TriangleMesh> ReadGlb(absl::string_view bytes, const GltfLimits& limits) {
  const absl::StatusOr<std::string> checked = PreflightGlb(bytes, limits);
  if (!checked.ok()) return checked.status();
  try {
    tinygltf::TinyGLTF loader;
    tinygltf::Model model;
    std::string error, warning;
    const bool read = loader.LoadBinaryFromMemory(
        &model, &error, &warning, reinterpret_cast<const unsigned char*>(checked->data()),
        static_cast<unsigned int>(checked->size()));
    if (!read) {
      std::replace(error.begin(), error.end(), '\n', ' ');
      return BadModel(absl::StrCat("cannot be read: ", error.substr(0, 200)));
    }
    return Collector(model, limits).Collect();
  } catch (const std::exception& problem) {
    return BadModel(absl::StrCat("cannot be read: ", problem.what()));
  }
}

}  // namespace saccade
