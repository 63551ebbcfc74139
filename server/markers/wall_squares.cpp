#include "server/markers/wall_squares.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <vector>

#include "server/capture/yaml_reader.hpp"
#include "server/markers/marker_detector.hpp"

namespace saccade {
namespace {

constexpr double kLeastDepth = 0.05;  // of the squares' spread, off one plane
constexpr YamlRange kPlace_m{-1000.0, 1000.0}, kSide_m{0.001, 10.0};

WallSquares::Square ReadSquare(YamlReader& entry) {
  entry.AllowOnly({"id", "side_m", "centre_m", "orientation_xyzw"});
  WallSquares::Square square;
  square.side_m = entry.Number("side_m", kSide_m);
  const std::vector<double> centre = entry.Numbers("centre_m", 3, false, kPlace_m);
  const std::vector<double> q = entry.Numbers("orientation_xyzw", 4);
  if (!entry.ok()) return square;
  square.world_from_square.translation = {centre[0], centre[1], centre[2]};
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  if (std::abs(rotation.norm() - 1.0) > 1e-3) {
    entry.Fail("orientation_xyzw", absl::StrCat("has length ", rotation.norm(),
                                                "; give a unit quaternion in the order x y z w"));
  }
  square.world_from_square.rotation = rotation.normalized();
  return square;
}

}  // namespace

std::array<Eigen::Vector3d, 4> WallSquares::Corners(int id) const {
  const Square& square = squares.at(id);
  const double h = 0.5 * square.side_m;
  const auto at = [&](double x, double y) {
    return square.world_from_square * Eigen::Vector3d(x, y, 0.0);
  };
  if (absl::StartsWith(family, "apriltag")) return {at(-h, -h), at(h, -h), at(h, h), at(-h, h)};
  return {at(-h, h), at(h, h), at(h, -h), at(-h, -h)};
}

double WallSquares::Depth() const {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector3d> all;
  for (const auto& [id, square] : squares) {
    for (const Eigen::Vector3d& corner : Corners(id)) all.push_back(corner);
  }
  if (all.empty()) return 0.0;
  for (const Eigen::Vector3d& corner : all) mean += corner / static_cast<double>(all.size());
  for (const Eigen::Vector3d& corner : all) spread += (corner - mean) * (corner - mean).transpose();
  const Eigen::Vector3d along =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues();
  return std::sqrt(std::max(0.0, along[0]) / along[2]);
}

absl::StatusOr<WallSquares> LoadWallSquares(const std::filesystem::path& file) {
  YamlReader yaml(file);
  yaml.AllowOnly({"family", "squares"});
  WallSquares walls;
  walls.family = yaml.Text("family");
  if (yaml.ok()) {
    const auto known = MakeMarkerDetector("aruco", {{walls.family}, 1});
    if (!known.ok()) yaml.Fail("family", known.status().message());
  }
  for (YamlReader& entry : yaml.Maps("squares")) {
    const int id = entry.Integer("id", 0, 1'000'000);
    const WallSquares::Square square = ReadSquare(entry);
    if (entry.ok() && !walls.squares.emplace(id, square).second) {
      entry.Fail("id", absl::StrCat(id, " occurs twice; print and list each square once"));
    }
    if (!entry.ok()) return entry.status();
  }
  if (yaml.ok() && walls.squares.size() < 2) yaml.Fail("squares", "list at least two");
  if (yaml.ok() && walls.Depth() < kLeastDepth) {
    yaml.Fail("squares",
              "all lie in one plane, which says nothing of a lens in one view; add some "
              "on a second wall, or use an aprilgrid");
  }
  if (!yaml.ok()) return yaml.status();
  return walls;
}

}  // namespace saccade
