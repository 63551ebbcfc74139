#include "server/team/team_file.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <set>
#include <toml.hpp>
#include <utility>

#include "shared/io/toml_file.hpp"

namespace saccade {
namespace {

constexpr std::array<const char*, 6> kModels = {"agile",      "agile-body", "deliberate",
                                                "measurable", "koller",     "planar"};

/// Reads a file of tables; the first problem is kept, and after it every call does nothing.
class Reader {
 public:
  explicit Reader(std::filesystem::path file) : file_(std::move(file)) {}

  const absl::Status& status() const { return status_; }

  void Fail(const std::string& at, const std::string& problem) {
    if (!status_.ok()) return;
    status_ = absl::InvalidArgumentError(absl::StrCat(file_.string(), ": ", at, ": ", problem));
  }

  void AllowOnly(const toml::value& table, const std::string& at,
                 std::initializer_list<const char*> keys) {
    for (const auto& [key, value] : table.as_table()) {
      const bool known = std::any_of(keys.begin(), keys.end(),
                                     [&, &name = key](const char* each) { return name == each; });
      if (!known) {
        Fail(Field(at, key), absl::StrCat("is not known; there are ", absl::StrJoin(keys, ", ")));
      }
    }
  }

  /// The tables [[key]]; none where there is no such key.
  std::vector<std::pair<std::string, const toml::value*>> Tables(const toml::value& table,
                                                                 const std::string& at,
                                                                 const char* key) {
    std::vector<std::pair<std::string, const toml::value*>> list;
    if (!table.contains(key)) return list;
    const toml::value& value = table.at(key);
    const std::string name = Field(at, key);
    if (!value.is_array()) {
      Fail(name, absl::StrCat("is not a list of tables; write [[", key, "]]"));
      return list;
    }
    for (const toml::value& each : value.as_array()) {
      if (!each.is_table()) {
        Fail(name, absl::StrCat("is not a list of tables; write [[", key, "]]"));
        return {};
      }
      list.emplace_back(absl::StrCat(name, "[", list.size(), "]"), &each);
    }
    return list;
  }

  /// A text that is not empty; `fallback` without the key, an error without both.
  std::string Text(const toml::value& table, const std::string& at, const char* key,
                   std::optional<std::string> fallback = std::nullopt) {
    if (!table.contains(key)) {
      if (!fallback) Fail(Field(at, key), "is missing; give a text in quotes");
      return fallback.value_or("");
    }
    const toml::value& value = table.at(key);
    if (!value.is_string() || value.as_string().str.empty()) {
      Fail(Field(at, key), "is not a text; write it in quotes, not empty");
      return "";
    }
    return value.as_string().str;
  }

  std::optional<double> Number(const toml::value& value) {
    if (value.is_integer()) return static_cast<double>(value.as_integer());
    if (value.is_floating() && std::isfinite(value.as_floating())) return value.as_floating();
    return std::nullopt;
  }

  std::optional<Rigid3> Pose(const toml::value& table, const std::string& at) {
    if (!table.contains("pose")) return std::nullopt;
    constexpr const char* kForm =
        "give [x, y, z, qx, qy, qz, qw]: metres and a quaternion of length 1";
    const toml::value& value = table.at("pose");
    std::array<double, 7> v{};
    bool good = value.is_array() && value.as_array().size() == v.size();
    for (std::size_t k = 0; good && k < v.size(); ++k) {
      const auto number = Number(value.as_array()[k]);
      good = number.has_value();
      if (good) v[k] = *number;
    }
    const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
    if (!good || std::abs(q.norm() - 1.0) > 0.01) {
      Fail(Field(at, "pose"), kForm);
      return std::nullopt;
    }
    return Rigid3{q.normalized(), {v[0], v[1], v[2]}};
  }

  TeamCamera Camera(const toml::value& table, const std::string& at,
                    std::optional<std::string> name) {
    AllowOnly(table, at, {"name", "source", "lens", "pose"});
    TeamCamera camera;
    camera.name = Text(table, at, "name", std::move(name));
    camera.source = Text(table, at, "source");
    camera.pose = Pose(table, at);
    const std::string lens = Text(table, at, "lens", "");
    if (!lens.empty()) camera.lens = file_.parent_path() / lens;
    return camera;
  }

  TeamMarker Marker(const toml::value& table, const std::string& at) {
    AllowOnly(table, at, {"family", "id", "side_m", "pose"});
    TeamMarker marker;
    marker.family = Text(table, at, "family");
    if (!table.contains("id") || !table.at("id").is_integer() || table.at("id").as_integer() < 0 ||
        table.at("id").as_integer() > 1'000'000) {
      Fail(Field(at, "id"), "give a whole number from 0 to 1000000");
    } else {
      marker.id = static_cast<int>(table.at("id").as_integer());
    }
    const auto side = table.contains("side_m") ? Number(table.at("side_m")) : std::nullopt;
    if (!side || !(*side > 0.0 && *side <= 10.0)) {
      Fail(Field(at, "side_m"), "give the side of its black border, above 0 and at most 10 m");
    }
    marker.side_m = side.value_or(0.0);
    marker.pose = Pose(table, at);
    if (!markers_.emplace(marker.family, marker.id).second) {
      Fail(at, absl::StrCat("marker ", marker.id, " of ", marker.family,
                            " is there twice; print another one"));
    }
    return marker;
  }

  TeamRobot Robot(const toml::value& table, const std::string& at) {
    AllowOnly(table, at, {"name", "source", "mount", "model", "camera", "marker"});
    TeamRobot robot;
    robot.name = Text(table, at, "name");
    robot.source = Text(table, at, "source");
    robot.mount = Text(table, at, "mount", robot.mount);
    robot.model = Text(table, at, "model", robot.model);
    if (std::find(kModels.begin(), kModels.end(), robot.model) == kModels.end()) {
      Fail(Field(at, "model"),
           absl::StrCat("'", robot.model, "'; give one of ", absl::StrJoin(kModels, ", ")));
    }
    Named(robot.name, at);
    for (const auto& [where, each] : Tables(table, at, "camera")) {
      robot.cameras.push_back(
          Camera(*each, where, absl::StrCat("camera ", robot.cameras.size() + 1)));
      Named(absl::StrCat(robot.name, "/", robot.cameras.back().name), where);
    }
    for (const auto& [where, each] : Tables(table, at, "marker")) {
      robot.markers.push_back(Marker(*each, where));
      if (!robot.markers.back().pose) {
        Fail(Field(where, "pose"), "is missing; where a marker is on a robot must be measured");
      }
    }
    return robot;
  }

  void Named(const std::string& name, const std::string& at) {
    if (!names_.insert(name).second) {
      Fail(Field(at, "name"), absl::StrCat("'", name, "' is there twice; give another one"));
    }
  }

  static std::string Field(const std::string& at, const std::string& key) {
    return at.empty() ? key : absl::StrCat(at, ".", key);
  }

 private:
  std::filesystem::path file_;
  absl::Status status_;
  std::set<std::string> names_;
  std::set<std::pair<std::string, int>> markers_;
};

}  // namespace

absl::StatusOr<TeamDescription> LoadTeam(const std::filesystem::path& file) {
  const absl::StatusOr<toml::value> root = ParseTomlFile(file);
  if (!root.ok()) return root.status();
  Reader reader(file);
  TeamDescription team;
  reader.AllowOnly(*root, "", {"robot", "camera", "marker"});
  for (const auto& [at, each] : reader.Tables(*root, "", "robot")) {
    team.robots.push_back(reader.Robot(*each, at));
  }
  for (const auto& [at, each] : reader.Tables(*root, "", "camera")) {
    team.cameras.push_back(reader.Camera(*each, at, std::nullopt));
    reader.Named(team.cameras.back().name, at);
  }
  for (const auto& [at, each] : reader.Tables(*root, "", "marker")) {
    team.markers.push_back(reader.Marker(*each, at));
  }
  if (team.robots.empty() && team.cameras.empty()) {
    reader.Fail("robot", "there is nobody; write [[robot]] or [[camera]]");
  }
  if (!reader.status().ok()) return reader.status();
  return team;
}

}  // namespace saccade
