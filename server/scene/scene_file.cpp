#include "server/scene/scene_file.hpp"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <utility>

#include "shared/io/regular_file.hpp"
#include "shared/models/shapes.hpp"

namespace saccade {
namespace {

using nlohmann::json;

constexpr std::size_t kMostFileBytes = std::size_t{1} << 20;
constexpr std::array<std::pair<const char*, SceneShape>, 4> kShapes = {
    {{"plane", SceneShape::kPlane},
     {"box", SceneShape::kBox},
     {"room", SceneShape::kRoom},
     {"model", SceneShape::kModel}}};
constexpr std::array<std::pair<const char*, SceneMaterial>, 4> kMaterials = {
    {{"real", SceneMaterial::kReal},
     {"virtual", SceneMaterial::kVirtual},
     {"guide", SceneMaterial::kGuide},
     {"hidden", SceneMaterial::kHidden}}};

absl::Status Bad(absl::string_view at, absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat(at, ": ", why));
}

/// Reads the keys of one object; the first problem stays.
class Fields {
 public:
  Fields(const json& object, std::string at) : object_(object), at_(std::move(at)) {
    if (!object_.is_object()) status_ = Bad(at_, "is no object; write { ... }");
  }

  const json* Find(const char* name) {
    known_.emplace_back(name);
    if (!status_.ok()) return nullptr;
    const auto found = object_.find(name);
    return found == object_.end() ? nullptr : &*found;
  }
  void Require(const char* name) {
    if (status_.ok() && !object_.contains(name)) status_ = Bad(Name(name), "is missing");
  }
  void Text(const char* name, std::string& out) {
    const json* value = Find(name);
    if (value == nullptr) return;
    if (!value->is_string()) return Fail(name, "is no text; write it in quotes");
    out = value->get<std::string>();
  }
  void Number(const char* name, double& out) {
    const json* value = Find(name);
    if (value == nullptr) return;
    if (!value->is_number()) return Fail(name, "is no number");
    out = value->get<double>();
  }
  template <int kSize>
  void Vector(const char* name, Eigen::Matrix<double, kSize, 1>& out) {
    const json* value = Find(name);
    if (value == nullptr) return;
    if (!value->is_array() || value->size() != kSize) {
      return Fail(name, absl::StrCat("give ", kSize, " numbers in brackets"));
    }
    for (int i = 0; i < kSize; ++i) {
      const json& number = (*value)[static_cast<std::size_t>(i)];
      if (!number.is_number()) return Fail(name, absl::StrCat("number ", i, " is none"));
      out[i] = number.get<double>();
    }
  }
  template <typename Enum, std::size_t kCount>
  void Choice(const char* name, const std::array<std::pair<const char*, Enum>, kCount>& choices,
              Enum& out) {
    std::string text;
    Text(name, text);
    if (!status_.ok() || !object_.contains(name)) return;
    std::string names;
    for (const auto& [word, value] : choices) {
      if (text == word) {
        out = value;
        return;
      }
      absl::StrAppend(&names, names.empty() ? "" : ", ", word);
    }
    Fail(name, absl::StrCat("'", text, "' is none of ", names));
  }
  void Fail(const char* name, absl::string_view why) {
    if (status_.ok()) status_ = Bad(Name(name), why);
  }
  std::string Name(const char* name) const { return absl::StrCat(at_, ".", name); }

  absl::Status Finish() {
    if (!status_.ok()) return status_;
    for (const auto& [key, value] : object_.items()) {
      if (std::find(known_.begin(), known_.end(), key) == known_.end()) {
        return Bad(absl::StrCat(at_, ".", key), "is not known here; see docs/scene.md");
      }
    }
    return absl::OkStatus();
  }

 private:
  const json& object_;
  const std::string at_;
  std::vector<std::string> known_;
  absl::Status status_;
};

void ReadColor(Fields& fields, std::uint32_t& rgba) {
  std::string text;
  fields.Text("color", text);
  if (text.empty()) return;
  std::uint32_t value = 0;
  const bool hex = text.size() == 7 && text[0] == '#' &&
                   absl::SimpleHexAtoi(absl::string_view(text).substr(1), &value);
  if (!hex) return fields.Fail("color", "write it as #rrggbb");
  rgba = value << 8 | 0xff;
}

absl::Status ReadMarker(const json& value, const std::string& at, SceneObject& object) {
  Fields fields(value, at);
  fields.Require("family");
  fields.Require("id");
  fields.Text("family", object.marker_family);
  double id = -1;
  fields.Number("id", id);
  if (!(id >= 0 && id < 1e6) || id != static_cast<double>(static_cast<std::uint32_t>(id))) {
    fields.Fail("id", "give a whole number from 0");
  } else {
    object.marker_id = static_cast<std::uint32_t>(id);
  }
  fields.Require("side_m");
  fields.Number("side_m", object.marker_side_m);
  object.parent = SceneParent::kMarker;
  return fields.Finish();
}

absl::StatusOr<SceneObject> ReadObject(const json& value, const std::string& at) {
  SceneObject object;
  Fields fields(value, at);
  for (const char* name : {"name", "shape"}) fields.Require(name);
  fields.Text("name", object.name);
  fields.Choice("shape", kShapes, object.shape);
  fields.Choice("material", kMaterials, object.material);
  const bool model = object.shape == SceneShape::kModel;
  fields.Require(model ? "model" : "size_m");
  if (model) {
    fields.Text("model", object.model);
    fields.Number("scale", object.scale);
  } else {
    fields.Vector<3>("size_m", object.size_m);
    ReadColor(fields, object.color_rgba);
  }
  fields.Vector<3>("position_m", object.parent_from_object.translation);
  Eigen::Vector4d rotation(0, 0, 0, 1);
  fields.Vector<4>("rotation_xyzw", rotation);
  object.parent_from_object.rotation =
      Eigen::Quaterniond(rotation.w(), rotation.x(), rotation.y(), rotation.z());
  const json* marker = fields.Find("marker");
  fields.Text("annotation", object.annotation_id);
  if (!object.annotation_id.empty()) object.parent = SceneParent::kAnchor;
  absl::Status read = fields.Finish();
  if (read.ok() && marker != nullptr) {
    if (object.parent == SceneParent::kAnchor) {
      return Bad(at, "has both marker and annotation; give one");
    }
    read = ReadMarker(*marker, fields.Name("marker"), object);
  }
  if (!read.ok()) return read;
  if (const absl::Status valid = Validate(object); !valid.ok()) {
    return absl::Status(valid.code(), absl::StrCat(at, ".", valid.message()));
  }
  object.parent_from_object.rotation.normalize();
  return object;
}

absl::Status ReadModels(const std::filesystem::path& folder, const GltfLimits& limits,
                        SceneContents& contents) {
  for (std::size_t i = 0; i < contents.objects.size(); ++i) {
    const std::string& id = contents.objects[i].model;
    const auto same = [&](const auto& model) { return model->id == id; };
    if (id.empty() || std::any_of(contents.models.begin(), contents.models.end(), same)) continue;
    const std::string at = absl::StrFormat("objects[%d].model", i);
    const std::filesystem::path path = std::filesystem::path(id).lexically_normal();
    if (path.is_absolute() || path.empty() || *path.begin() == "..") {
      return Bad(at, absl::StrCat("'", id, "' lies outside the scene's folder; put it beside it"));
    }
    absl::StatusOr<std::string> bytes =
        ReadRegularFile(folder / path, limits.bytes, "a model (.glb)");
    if (!bytes.ok()) {
      return absl::Status(bytes.status().code(), absl::StrCat(at, ": ", bytes.status().message()));
    }
    absl::StatusOr<std::shared_ptr<const SceneModel>> model =
        MakeModel(id, path.stem().string(), *std::move(bytes), limits);
    if (!model.ok()) {
      return absl::Status(model.status().code(),
                          absl::StrCat(at, ": '", id, "': ", model.status().message()));
    }
    contents.models.push_back(*std::move(model));
  }
  return absl::OkStatus();
}

template <typename Enum, std::size_t kCount>
const char* Word(const std::array<std::pair<const char*, Enum>, kCount>& choices, Enum value) {
  for (const auto& [word, each] : choices) {
    if (each == value) return word;
  }
  return "";
}

}  // namespace

absl::StatusOr<std::vector<SceneObject>> ParseSceneObjects(absl::string_view text) {
  const json root = json::parse(text.begin(), text.end(), nullptr, false, true);
  if (root.is_discarded()) return Bad("scene", "is not JSON; check commas and brackets");
  Fields fields(root, "scene");
  fields.Require("objects");
  const json* objects = fields.Find("objects");
  if (absl::Status read = fields.Finish(); !read.ok()) return read;
  if (!objects->is_array()) return Bad("objects", "is no list; write [ ... ]");
  if (objects->size() > kMostSceneObjects) {
    return Bad("objects", absl::StrCat(objects->size(), "; at most ", kMostSceneObjects));
  }
  std::vector<SceneObject> all;
  for (std::size_t i = 0; i < objects->size(); ++i) {
    absl::StatusOr<SceneObject> object =
        ReadObject((*objects)[i], absl::StrFormat("objects[%d]", i));
    if (!object.ok()) return object.status();
    all.push_back(*std::move(object));
  }
  return all;
}

absl::StatusOr<SceneContents> ParseScene(absl::string_view text,
                                         const std::filesystem::path& folder,
                                         const GltfLimits& limits) {
  absl::StatusOr<std::vector<SceneObject>> objects = ParseSceneObjects(text);
  if (!objects.ok()) return objects.status();
  SceneContents contents{*std::move(objects), {}};
  if (absl::Status read = ReadModels(folder, limits, contents); !read.ok()) return read;
  return contents;
}

absl::StatusOr<SceneContents> ReadSceneFile(const std::filesystem::path& file,
                                            const GltfLimits& limits) {
  const absl::StatusOr<std::string> text = ReadRegularFile(file, kMostFileBytes, "a scene (JSON)");
  if (!text.ok()) return text.status();
  absl::StatusOr<SceneContents> contents = ParseScene(*text, file.parent_path(), limits);
  if (contents.ok()) return contents;
  return absl::Status(contents.status().code(),
                      absl::StrCat(file.string(), ": ", contents.status().message()));
}

std::string SceneToJson(const std::vector<SceneObject>& objects) {
  json list = json::array();
  for (const SceneObject& object : objects) {
    json one = {{"name", object.name},
                {"shape", Word(kShapes, object.shape)},
                {"material", Word(kMaterials, object.material)}};
    if (object.shape == SceneShape::kModel) {
      one["model"] = object.model;
      one["scale"] = object.scale;
    } else {
      one["size_m"] = {object.size_m.x(), object.size_m.y(), object.size_m.z()};
      one["color"] = absl::StrFormat("#%06x", object.color_rgba >> 8);
    }
    const Eigen::Vector3d& p = object.parent_from_object.translation;
    const Eigen::Quaterniond& q = object.parent_from_object.rotation;
    one["position_m"] = {p.x(), p.y(), p.z()};
    one["rotation_xyzw"] = {q.x(), q.y(), q.z(), q.w()};
    if (object.parent == SceneParent::kMarker) {
      one["marker"] = {{"family", object.marker_family},
                       {"id", object.marker_id},
                       {"side_m", object.marker_side_m}};
    }
    if (object.parent == SceneParent::kAnchor) one["annotation"] = object.annotation_id;
    list.push_back(std::move(one));
  }
  return json{{"objects", std::move(list)}}.dump(1, ' ', false, json::error_handler_t::replace);
}

absl::StatusOr<std::shared_ptr<const SceneModel>> MakeModel(std::string id, std::string name,
                                                            std::string bytes,
                                                            const GltfLimits& limits) {
  absl::StatusOr<TriangleMesh> mesh = ReadGlb(bytes, limits);
  if (!mesh.ok()) return mesh.status();
  auto model = std::make_shared<SceneModel>();
  model->id = std::move(id);
  model->name = std::move(name);
  model->mesh = *std::move(mesh);
  model->file = std::make_shared<const std::string>(std::move(bytes));
  return model;
}

}  // namespace saccade
