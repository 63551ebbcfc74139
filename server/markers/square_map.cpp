#include "server/markers/square_map.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>
#include <set>

#include "shared/io/toml_file.hpp"

namespace saccade {
namespace {

constexpr double kSmallest_m = 0.005, kLargest_m = 5.0;

std::string NameOf(const KnownSquare& square) {
  return absl::StrCat(square.family, " ", square.id);
}

std::vector<double> Numbers(const toml::value& table, const std::string& key, std::size_t count) {
  std::vector<double> numbers;
  for (const toml::value& each : toml::find(table, key).as_array()) {
    numbers.push_back(each.is_integer() ? static_cast<double>(each.as_integer())
                                        : each.as_floating());
  }
  if (numbers.size() != count) {
    throw std::runtime_error(absl::StrCat(key, ": give ", count, " numbers"));
  }
  return numbers;
}

KnownSquare ReadSquare(const toml::value& table) {
  const std::set<std::string> known = {"family", "id", "side_m", "middle_m", "rotation_xyzw"};
  for (const auto& [key, value] : table.as_table()) {
    if (!known.contains(key)) throw std::runtime_error(absl::StrCat("unknown key ", key));
  }
  KnownSquare square;
  square.family = toml::find<std::string>(table, "family");
  square.id = toml::find<int>(table, "id");
  square.side_m = toml::find<double>(table, "side_m");
  const auto middle = Numbers(table, "middle_m", 3), turn = Numbers(table, "rotation_xyzw", 4);
  square.world_from_square.translation = {middle[0], middle[1], middle[2]};
  square.world_from_square.rotation = Eigen::Quaterniond(turn[3], turn[0], turn[1], turn[2]);
  return square;
}

}  // namespace

std::array<Eigen::Vector3d, 4> SquareCorners(absl::string_view family, double side_m) {
  const double h = 0.5 * side_m;
  if (absl::StartsWith(family, "apriltag")) {
    return {{{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}}};
  }
  return {{{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}}};
}

std::array<Eigen::Vector3d, 4> KnownSquare::CornersInWorld() const {
  std::array<Eigen::Vector3d, 4> corners = SquareCorners(family, side_m);
  for (Eigen::Vector3d& corner : corners) corner = world_from_square * corner;
  return corners;
}

const KnownSquare* SquareMap::Find(absl::string_view family, int id) const {
  for (const KnownSquare& square : squares) {
    if (square.id == id && square.family == family) return &square;
  }
  return nullptr;
}

absl::Status SquareMap::Validate() const {
  std::set<std::string> seen;
  for (const KnownSquare& square : squares) {
    const std::string name = NameOf(square);
    if (!seen.insert(name).second) {
      return absl::InvalidArgumentError(
          absl::StrCat("square ", name, " is there twice; give each square an id of its own"));
    }
    if (!(square.side_m >= kSmallest_m && square.side_m <= kLargest_m)) {
      return absl::InvalidArgumentError(absl::StrCat("square ", name, ": side_m: ", square.side_m,
                                                     "; give a length from ", kSmallest_m, " to ",
                                                     kLargest_m, " m"));
    }
    const Rigid3& pose = square.world_from_square;
    if (!pose.translation.allFinite()) {
      return absl::InvalidArgumentError(absl::StrCat("square ", name, ": middle_m: not finite"));
    }
    if (!(std::abs(pose.rotation.norm() - 1.0) < 1e-3)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "square ", name, ": rotation_xyzw: its length is ", pose.rotation.norm(), "; give 1"));
    }
  }
  return absl::OkStatus();
}

std::string SquareMap::ToToml() const {
  std::string text;
  for (const KnownSquare& square : squares) {
    const Eigen::Vector3d& middle = square.world_from_square.translation;
    const Eigen::Quaterniond& turn = square.world_from_square.rotation;
    absl::StrAppendFormat(&text,
                          "[[square]]\nfamily = \"%s\"\nid = %d\nside_m = %.9f\n"
                          "middle_m = [%.9f, %.9f, %.9f]\n"
                          "rotation_xyzw = [%.12f, %.12f, %.12f, %.12f]\n\n",
                          square.family, square.id, square.side_m, middle.x(), middle.y(),
                          middle.z(), turn.x(), turn.y(), turn.z(), turn.w());
  }
  return text;
}

absl::StatusOr<SquareMap> LoadSquareMap(const std::filesystem::path& file) {
  const absl::StatusOr<toml::value> root = ParseTomlFile(file);
  if (!root.ok()) return root.status();
  SquareMap map;
  try {
    for (const auto& [key, value] : root->as_table()) {
      if (key != "square") throw std::runtime_error(absl::StrCat("unknown key ", key));
    }
    for (const toml::value& each : toml::find(*root, "square").as_array()) {
      try {
        map.squares.push_back(ReadSquare(each));
      } catch (const std::exception& error) {
        throw std::runtime_error(
            absl::StrCat("square number ", map.squares.size() + 1, ": ", error.what()));
      }
    }
  } catch (const std::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat(file.string(), ": ", error.what()));
  }
  if (const absl::Status valid = map.Validate(); !valid.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(file.string(), ": ", valid.message()));
  }
  for (KnownSquare& square : map.squares) square.world_from_square.rotation.normalize();
  return map;
}

}  // namespace saccade
