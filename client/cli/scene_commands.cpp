#include "client/cli/scene_commands.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <sstream>

#include "client/cli/option_values.hpp"
#include "client/cli/session_file.hpp"
#include "client/cli/text.hpp"
#include "client/net/scene_client.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade::cli {
namespace {

constexpr std::size_t kMostModelBytes = std::size_t{32} << 20, kMostPointsBytes = 1 << 20;
constexpr std::array<const char*, 4> kShapes = {"plane", "box", "room", "model"};
constexpr std::array<const char*, 4> kMaterials = {"real", "virtual", "guide", "hidden"};

const CLI::Validator& Xyz() {
  static const CLI::Validator xyz(
      [](std::string& text) {
        return ParseNumbers(text, 3).ok() ? std::string()
                                          : absl::StrCat("'", text, "' is not X,Y,Z");
      },
      "X,Y,Z");
  return xyz;
}

Eigen::Vector3d Vector(const std::string& text) {
  const std::vector<double> numbers = *ParseNumbers(text, 3);
  return {numbers[0], numbers[1], numbers[2]};
}

nlohmann::json SceneJson(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// What it moves with; null: no marker.
nlohmann::json MarkerJson(const SceneObject& object) {
  if (object.parent != SceneParent::kMarker) return nullptr;
  return {
      {"family", object.marker_family}, {"id", object.marker_id}, {"side_m", object.marker_side_m}};
}

nlohmann::json SceneJson(const SceneObject& object) {
  const Eigen::Quaterniond& q = object.parent_from_object.rotation;
  return {{"id", object.id},
          {"name", object.name},
          {"shape", kShapes[static_cast<std::size_t>(object.shape)]},
          {"material", kMaterials[static_cast<std::size_t>(object.material)]},
          {"model", object.model},
          {"size_m", SceneJson(object.size_m)},
          {"scale", object.scale},
          {"annotation_id", object.annotation_id},
          {"marker", MarkerJson(object)},
          {"position_m", SceneJson(object.parent_from_object.translation)},
          {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}

nlohmann::json SceneJson(const net::ModelFacts& model) {
  return {{"id", model.id},
          {"name", model.name},
          {"triangles", model.triangles},
          {"bytes", model.bytes},
          {"size_m", SceneJson(model.size_m)}};
}

nlohmann::json SceneJson(const net::Touch& touch) {
  return {{"object_id", touch.object_id},
          {"object_name", touch.object_name},
          {"point_m", SceneJson(touch.point_in_world)},
          {"moved_m", touch.moved_m}};
}

std::string Line(const SceneObject& object) {
  const Eigen::Vector3d& p = object.parent_from_object.translation;
  return absl::StrFormat("%s  %-7s %-7s %-20s at %.3f, %.3f, %.3f m\n", object.id.substr(0, 8),
                         kShapes[static_cast<std::size_t>(object.shape)],
                         kMaterials[static_cast<std::size_t>(object.material)], object.name, p.x(),
                         p.y(), p.z());
}

void Print(const Options& options, const SceneObject& object) {
  std::cout << (options.json ? Dump(SceneJson(object)) + "\n" : Line(object));
}

absl::Status RunList(const Options& options, net::SceneClient& client) {
  const absl::StatusOr<net::SceneList> list = client.List();
  if (!list.ok()) return list.status();
  if (options.json) {
    nlohmann::json objects = nlohmann::json::array(), models = nlohmann::json::array();
    for (const SceneObject& object : list->objects) objects.push_back(SceneJson(object));
    for (const net::ModelFacts& model : list->models) models.push_back(SceneJson(model));
    std::cout << Dump({{"revision", list->revision}, {"objects", objects}, {"models", models}}, 2)
              << "\n";
    return absl::OkStatus();
  }
  for (const SceneObject& object : list->objects) std::cout << Line(object);
  for (const net::ModelFacts& model : list->models) {
    std::cout << absl::StrFormat("%s  a model: %s, %d triangles, %.3f x %.3f x %.3f m\n",
                                 model.id.substr(0, 8), model.name, model.triangles,
                                 model.size_m.x(), model.size_m.y(), model.size_m.z());
  }
  if (list->objects.empty() && list->models.empty()) std::cout << "the scene is empty\n";
  return absl::OkStatus();
}

/// The one object whose id begins so.
absl::StatusOr<SceneObject> FindObject(const std::string& prefix, net::SceneClient& client) {
  const absl::StatusOr<net::SceneList> list = client.List();
  if (!list.ok()) return list.status();
  std::vector<SceneObject> found;
  for (const SceneObject& object : list->objects) {
    if (absl::StartsWith(object.id, prefix)) found.push_back(object);
  }
  if (found.size() == 1) return found.front();
  return absl::NotFoundError(
      absl::StrCat(found.empty() ? "there is no object '" : "more than one object begins with '",
                   prefix, "'; 'saccade scene list' lists those there are"));
}

/// Of a file that is uploaded, or of a model that is there.
absl::StatusOr<std::string> ModelId(const Options& options, net::SceneClient& client) {
  const std::string& model = options.scene.model;
  if (!absl::EndsWith(model, ".glb")) {
    const absl::StatusOr<net::SceneList> list = client.List();
    if (!list.ok()) return list.status();
    for (const net::ModelFacts& one : list->models) {
      if (one.name == model || absl::StartsWith(one.id, model)) return one.id;
    }
    return absl::NotFoundError(
        absl::StrCat("--model ", model, ": neither a .glb file nor a model that is there"));
  }
  const absl::StatusOr<std::string> glb = ReadRegularFile(model, kMostModelBytes, "a model (.glb)");
  if (!glb.ok()) return glb.status();
  const absl::StatusOr<net::ModelFacts> facts =
      client.Upload(std::filesystem::path(model).stem().string(), *glb, [&](std::size_t received) {
        if (received < glb->size()) {
          std::cerr << absl::StrFormat("uploaded %d of %d bytes\n", received, glb->size());
        }
      });
  if (!facts.ok()) return facts.status();
  return facts->id;
}

absl::StatusOr<SceneObject> ObjectOf(const Options& options, net::SceneClient& client) {
  const Options::Scene& typed = options.scene;
  SceneObject object;
  if (!options.id.empty()) {
    absl::StatusOr<SceneObject> known = FindObject(options.id, client);
    if (!known.ok()) return known;
    object = *std::move(known);
  } else if (!typed.model.empty()) {
    absl::StatusOr<std::string> id = ModelId(options, client);
    if (!id.ok()) return id.status();
    object.shape = SceneShape::kModel;
    object.model = *std::move(id);
    object.name = std::filesystem::path(typed.model).stem().string();
  } else if (!typed.shape.empty() && !typed.size.empty()) {
    for (std::size_t i = 0; i < kShapes.size(); ++i) {
      if (typed.shape == kShapes[i]) object.shape = static_cast<SceneShape>(i);
    }
    object.size_m = Vector(typed.size);
    object.name = typed.shape;
  } else {
    return absl::InvalidArgumentError("scene: give --model FILE.glb, or --shape with --size X,Y,Z");
  }
  for (std::size_t i = 0; i < kMaterials.size(); ++i) {
    if (typed.material == kMaterials[i]) object.material = static_cast<SceneMaterial>(i);
  }
  if (typed.scale) object.scale = *typed.scale;
  if (!typed.name.empty()) object.name = typed.name;
  if (!typed.at.empty()) object.parent_from_object.translation = Vector(typed.at);
  if (typed.yaw_deg) {
    object.parent_from_object.rotation =
        Eigen::AngleAxisd(*typed.yaw_deg * M_PI / 180.0, Eigen::Vector3d::UnitY());
  }
  return object;
}

absl::Status RunAdd(const Options& options, net::SceneClient& client) {
  absl::StatusOr<SceneObject> object = ObjectOf(options, client);
  if (!object.ok()) return object.status();
  const absl::StatusOr<SceneObject> put = client.Put(*object);
  if (put.ok()) Print(options, *put);
  return put.status();
}

absl::Status RunPlace(const Options& options, net::SceneClient& client) {
  const Options::Scene& typed = options.scene;
  absl::StatusOr<SceneObject> object = ObjectOf(options, client);
  if (!object.ok()) return object.status();
  std::optional<Eigen::Vector3d> push, gravity;
  if (!typed.push.empty()) push = Vector(typed.push);
  if (!typed.gravity.empty()) gravity = Vector(typed.gravity).normalized();
  const absl::StatusOr<net::PlacedThing> placed = client.Place(*object, push, gravity);
  if (!placed.ok()) return placed.status();
  if (options.json) {
    nlohmann::json json = {{"object", SceneJson(placed->object)},
                           {"support", SceneJson(placed->support)}};
    if (placed->stop) json["stop"] = SceneJson(*placed->stop);
    std::cout << Dump(json) << "\n";
    return absl::OkStatus();
  }
  if (placed->stop) {
    std::cout << absl::StrFormat("pushed %.4f m until it touched '%s'\n", placed->stop->moved_m,
                                 placed->stop->object_name);
  }
  std::cout << absl::StrFormat("lowered %.4f m until it rested on '%s'\n%s",
                               placed->support.moved_m, placed->support.object_name,
                               Line(placed->object));
  return absl::OkStatus();
}

absl::Status RunRemove(const Options& options, net::SceneClient& client) {
  const absl::StatusOr<SceneObject> object = FindObject(options.id, client);
  if (!object.ok()) return object.status();
  if (absl::Status removed = client.Remove(object->id); !removed.ok()) return removed;
  if (options.json) {
    std::cout << Dump({{"removed", object->id}}) << "\n";
  } else {
    std::cout << "removed '" << object->name << "'\n";
  }
  return absl::OkStatus();
}

/// Lines of six numbers: a point in the object, the same in the world.
absl::StatusOr<std::vector<net::PointPair>> ReadPoints(const std::string& file) {
  const absl::StatusOr<std::string> text = ReadRegularFile(file, kMostPointsBytes, "points (CSV)");
  if (!text.ok()) return text.status();
  std::vector<net::PointPair> points;
  std::istringstream lines(*text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (line.empty() || line[0] == '#') continue;
    const absl::StatusOr<std::vector<double>> six = ParseNumbers(line, 6);
    if (!six.ok()) {
      return absl::InvalidArgumentError(absl::StrCat(
          file, ": line ", number, ": give six numbers: x,y,z in the object, x,y,z in the world"));
    }
    const std::vector<double>& n = *six;
    points.push_back({{n[0], n[1], n[2]}, {n[3], n[4], n[5]}});
  }
  return points;
}

absl::Status RunRegister(const Options& options, net::SceneClient& client) {
  const auto points = ReadPoints(options.scene.points);
  if (!points.ok()) return points.status();
  const absl::StatusOr<SceneObject> object = FindObject(options.id, client);
  if (!object.ok()) return object.status();
  const absl::StatusOr<net::RegisteredThing> found =
      client.Register(object->id, *points, options.scene.with_scale, options.scene.accept);
  if (!found.ok()) return found.status();
  if (options.json) {
    std::cout << Dump({{"object", SceneJson(found->object)},
                       {"accepted", options.scene.accept},
                       {"rms_mm", found->rms_mm},
                       {"left_out_rms_mm", found->left_out_rms_mm},
                       {"errors_mm", found->errors_mm},
                       {"left_out_errors_mm", found->left_out_errors_mm}})
              << "\n";
    return absl::OkStatus();
  }
  for (std::size_t i = 0; i < found->errors_mm.size(); ++i) {
    std::cout << absl::StrFormat("point %d: %.1f mm; by the others alone %.1f mm\n", i + 1,
                                 found->errors_mm[i], found->left_out_errors_mm[i]);
  }
  std::cout << absl::StrFormat("all: %.1f mm; expect %.1f mm elsewhere\n%s", found->rms_mm,
                               found->left_out_rms_mm, Line(found->object));
  std::cout << (options.scene.accept ? "accepted\n" : "not moved yet: --accept does that\n");
  return absl::OkStatus();
}

void AddObjectOptions(CLI::App& command, Options& options) {
  Options::Scene& typed = options.scene;
  command.add_option("--model", typed.model, "A .glb file, or the name or id of a model there is");
  command.add_option("--shape", typed.shape, "plane, box or room")
      ->check(CLI::IsMember({"plane", "box", "room"}));
  command.add_option("--size", typed.size, "X,Y,Z: sides [m]; of a plane X and Z")->check(Xyz());
  command.add_option("--scale", typed.scale, "Of a model")->check(Number(1e-4, 1e4));
  command.add_option("--name", typed.name, "What the others see it called")->check(Utf8());
  command.add_option("--at", typed.at, "X,Y,Z of the middle of its base in world [m]")
      ->check(Xyz());
  command.add_option("--yaw", typed.yaw_deg, "Turned so far about y (down) [deg]")
      ->check(Number(-360, 360));
}

}  // namespace

void AddScene(CLI::App& app, Options& options) {
  CLI::App* scene = app.add_subcommand("scene", "Known geometry and virtual things");
  scene->require_subcommand(1);
  scene->add_subcommand("list", "What there is");
  CLI::App* add = scene->add_subcommand("add", "Add something where it is said to be");
  AddObjectOptions(*add, options);
  add->add_option("--material", options.scene.material,
                  "real (the default), virtual, guide or hidden: docs/scene.md")
      ->check(CLI::IsMember({"real", "virtual", "guide", "hidden"}));
  CLI::App* place = scene->add_subcommand(
      "place", "Let something virtual go: pushed until it touches, lowered until it rests");
  AddObjectOptions(*place, options);
  place->add_option("--id", options.id, "Something that is there: its id, or the beginning of it");
  place->add_option("--push", options.scene.push, "X,Y,Z: direction to push it first")
      ->check(Xyz());
  place->add_option("--gravity", options.scene.gravity, "X,Y,Z in world; else 0,1,0")->check(Xyz());
  CLI::App* remove = scene->add_subcommand("remove", "Remove something");
  remove->add_option("id", options.id, "Its id, or the beginning of it")->required();
  CLI::App* found = scene->add_subcommand(
      "register", "Where something lies, by at least four points; tells the error first");
  found->add_option("id", options.id, "Its id, or the beginning of it")->required();
  found
      ->add_option("--points", options.scene.points,
                   "CSV: x,y,z in the object and x,y,z in the world [m], a line each")
      ->required();
  found->add_flag("--with-scale", options.scene.with_scale, "Of a model, in a map without metres");
  found->add_flag("--accept", options.scene.accept, "Move it there");
}

bool IsSceneCommand(Command command) {
  return command == Command::kSceneList || command == Command::kSceneAdd ||
         command == Command::kScenePlace || command == Command::kSceneRemove ||
         command == Command::kSceneRegister;
}

absl::Status RunScene(const Options& typed) {
  Options options = typed;
  // What is placed is virtual; what is added is there, unless it is said otherwise.
  if (options.command == Command::kScenePlace) options.scene.material = "virtual";
  net::ConnectionOptions to = options.connection;
  to.session_id = LoadSession(to.server, to.display_name);
  net::SceneClient client(to);
  if (absl::Status joined = client.Join(); !joined.ok()) return joined;
  if (client.session_id() != to.session_id) {
    SaveSession(to.server, to.display_name, client.session_id());
  }
  switch (options.command) {
    case Command::kSceneList:
      return RunList(options, client);
    case Command::kSceneAdd:
      return RunAdd(options, client);
    case Command::kScenePlace:
      return RunPlace(options, client);
    case Command::kSceneRemove:
      return RunRemove(options, client);
    default:
      return RunRegister(options, client);
  }
}

}  // namespace saccade::cli
