#include "server/eval/scene/figure_things.hpp"

#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "server/eval/scene/figure_room.hpp"
#include "server/scene/placement.hpp"
#include "shared/models/overlay_things.hpp"
#include "shared/models/shapes.hpp"

namespace saccade {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kOak = 0xb98a55ff, kWalnut = 0x7a5436ff, kCushion = 0x3f6f9fff,
                        kScreen = 0xd8d2c2ff, kFrame = 0x555f66ff, kGridColor = 0x2fd0e0ff,
                        kRouteColor = 0x22c05aff, kArrowColor = 0xe0261eff;
constexpr std::uint32_t kWires[] = {0xf2b21bff, 0x3a7bd5ff, 0xe0261eff};

PlacedMesh Placed(TriangleMesh mesh, const Vector3d& at, double turn_rad, SceneMaterial material) {
  return {std::make_shared<const TriangleMesh>(std::move(mesh)),
          {Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Vector3d::UnitY())), at},
          material};
}

/// A box that stands `height` above the thing's base.
void AddBox(const Vector3d& base, const Vector3d& size, std::uint32_t color, TriangleMesh& mesh) {
  Append(BoxMesh(size, color), {Eigen::Quaterniond::Identity(), base}, 1.0, mesh);
}

/// Open to its front, which is at -z.
TriangleMesh Shelf() {
  TriangleMesh mesh;
  for (const double x : {-0.39, 0.39}) AddBox({x, 0, 0}, {0.02, 1.5, 0.32}, kOak, mesh);
  for (int k = 0; k < 5; ++k) AddBox({0, -0.06 - 0.355 * k, 0}, {0.76, 0.02, 0.32}, kOak, mesh);
  AddBox({0, -0.06, 0.155}, {0.76, 1.44, 0.01}, kWalnut, mesh);
  return mesh;
}

TriangleMesh Table() {
  TriangleMesh mesh;
  for (const double x : {-0.54, 0.54}) {
    for (const double z : {-0.29, 0.29}) AddBox({x, 0, z}, {0.06, 0.70, 0.06}, kWalnut, mesh);
  }
  AddBox({0, -0.70, 0}, {1.2, 0.04, 0.7}, kOak, mesh);
  return mesh;
}

TriangleMesh Armchair() {
  TriangleMesh mesh;
  AddBox({0, 0, 0}, {0.72, 0.38, 0.62}, kCushion, mesh);
  AddBox({0, -0.38, 0.24}, {0.72, 0.46, 0.14}, kCushion, mesh);
  for (const double x : {-0.31, 0.31}) {
    AddBox({x, -0.38, -0.07}, {0.10, 0.20, 0.48}, 0x355f8aff, mesh);
  }
  return mesh;
}

/// Pushed along `push`, then lowered.
absl::StatusOr<PlacedMesh> Push(TriangleMesh mesh, const Vector3d& from, double turn_rad,
                                const Vector3d& push, const std::vector<Obstacle>& obstacles) {
  PlacedMesh placed = Placed(std::move(mesh), from, turn_rad, SceneMaterial::kVirtual);
  PlacementRequest request;
  request.world_from_body = placed.world_from_mesh;
  request.push = push;
  const absl::StatusOr<Placement> rest =
      Place(CollisionScene(obstacles), Body(*placed.mesh), request);
  if (!rest.ok()) return rest.status();
  placed.world_from_mesh = rest->world_from_body;
  return placed;
}

std::vector<Obstacle> Obstacles(const TriangleMesh& room) { return {{"room", "room", room}}; }

void Stand(const PlacedMesh& thing, std::vector<Obstacle>& obstacles) {
  Obstacle& one = obstacles.emplace_back(Obstacle{"thing", "thing", {}});
  Append(*thing.mesh, thing.world_from_mesh, 1.0, one.in_world);
}

/// A hose on its reel, as whoever opened the cabinet has photographed it.
cv::Mat PaintHose(int columns, int rows) {
  constexpr int kFine = 6;
  cv::Mat picture(rows * kFine, columns * kFine, CV_8UC3, cv::Scalar(58, 54, 52));
  const cv::Point middle(columns * kFine / 2, rows * kFine * 9 / 20);
  const int reach = columns * kFine * 2 / 5;
  cv::rectangle(picture, {6, 6, picture.cols - 12, picture.rows - 12}, cv::Scalar(96, 92, 90), 10);
  for (int k = 0; k < 6; ++k) {
    const int radius = reach - k * reach / 8;
    cv::circle(picture, middle, radius, cv::Scalar(30, 30, 60), reach / 9, cv::LINE_AA);
    cv::circle(picture, middle, radius, cv::Scalar(52, 60, 205), reach / 13, cv::LINE_AA);
  }
  cv::circle(picture, middle, reach / 6, cv::Scalar(200, 205, 210), cv::FILLED, cv::LINE_AA);
  cv::circle(picture, middle, reach / 14, cv::Scalar(60, 60, 60), cv::FILLED, cv::LINE_AA);
  const cv::Point end(middle.x + reach, picture.rows * 17 / 20);
  cv::line(picture, {middle.x + reach - 4, middle.y}, end, cv::Scalar(52, 60, 205), reach / 11,
           cv::LINE_AA);
  cv::line(picture, end, {end.x - reach * 4 / 5, end.y + 6}, cv::Scalar(60, 180, 215), reach / 8,
           cv::LINE_AA);
  cv::Mat small;
  cv::resize(picture, small, {columns, rows}, 0, 0, cv::INTER_AREA);
  return small;
}

void AddTube(const Vector3d& from, const Vector3d& to, double radius, std::uint32_t color,
             TriangleMesh& mesh) {
  Append(TubeMesh(std::array{from, to}, radius, color), Rigid3(), 1.0, mesh);
}

TriangleMesh Person() {
  constexpr std::uint32_t kTrousers = 0x34455cff, kShirt = 0xd9822bff, kSkin = 0xd8b090ff,
                          kShoe = 0x33302eff;
  TriangleMesh mesh;
  for (const double x : {-1.0, 1.0}) {
    AddBox({0.1 * x, 0, -0.04}, {0.10, 0.07, 0.27}, kShoe, mesh);
    AddTube({0.1 * x, -0.05, 0}, {0.1 * x, -0.48, 0}, 0.06, kTrousers, mesh);
    AddTube({0.1 * x, -0.44, 0}, {0.09 * x, -0.88, 0}, 0.08, kTrousers, mesh);
    AddTube({0.2 * x, -1.40, 0}, {0.26 * x, -1.12, 0.02}, 0.055, kShirt, mesh);
    AddTube({0.26 * x, -1.14, 0.02}, {0.27 * x, -0.86, -0.05}, 0.042, kSkin, mesh);
  }
  constexpr std::array kTorso = {0.165, 0.16, 0.155, 0.16, 0.17, 0.18, 0.185, 0.175, 0.14};
  for (std::size_t k = 0; k < kTorso.size(); ++k) {
    const double y = -0.84 - 0.07 * static_cast<double>(k);
    AddTube({0, y, 0}, {0, y - 0.07, 0}, kTorso[k], kShirt, mesh);
  }
  AddTube({0, -1.45, 0}, {0, -1.56, 0}, 0.055, kSkin, mesh);
  constexpr int kSlices = 12;
  for (int k = 0; k < kSlices; ++k) {  // a head, higher than wide
    const double t = 2.0 * (k + 0.5) / kSlices - 1.0, y = -1.65 - 0.13 * t;
    AddTube({0, y + 0.011, 0}, {0, y - 0.011, 0}, 0.105 * std::sqrt(1.0 - t * t), kSkin, mesh);
  }
  return mesh;
}

/// Where the room's coordinates begin, as their figure 6 shows it.
PlacedMesh Axes() {
  constexpr double kLength_m = 0.5, kThick_m = 0.012;
  const Vector3d corner(kThick_m, -kThick_m, -kThick_m);
  TriangleMesh mesh;
  for (const auto& [way, color] : {std::pair{Vector3d(1, 0, 0), 0xe0261effU},
                                   {Vector3d(0, -1, 0), 0x2fb04aff},
                                   {Vector3d(0, 0, -1), 0x2f6fe0ff}}) {
    Append(ArrowMesh(corner, corner + kLength_m * way, kThick_m, color), Rigid3(), 1.0, mesh);
  }
  return Placed(mesh, Vector3d::Zero(), 0, SceneMaterial::kGuide);
}

}  // namespace

absl::StatusOr<std::vector<PlacedMesh>> PushedFurniture(const TriangleMesh& room) {
  std::vector<Obstacle> obstacles = Obstacles(room);
  auto shelf = Push(Shelf(), {0.75, -0.1, -1.3}, 0.0, {0, 0, 1}, obstacles);
  if (!shelf.ok()) return shelf.status();
  Stand(*shelf, obstacles);
  auto table = Push(Table(), {1.9, -0.1, -1.5}, 0.0, {0, 0, 1}, obstacles);
  if (!table.ok()) return table.status();
  auto chair = Push(Armchair(), {1.0, -0.1, -1.62}, -0.5 * M_PI, {-1, 0, 0}, obstacles);
  if (!chair.ok()) return chair.status();
  return std::vector<PlacedMesh>{*shelf, *table, *chair, Axes()};
}

absl::StatusOr<std::vector<PlacedMesh>> FurnitureBehindCartons(const TriangleMesh& room) {
  std::vector<Obstacle> obstacles = Obstacles(room);
  auto shelf = Push(Shelf(), {0.62, -0.1, -0.38}, 0.0, {0, 0, 1}, obstacles);
  if (!shelf.ok()) return shelf.status();
  auto table = Push(Table(), {2.1, -0.1, -1.5}, 0.0, {-1, 0, 0}, obstacles);
  if (!table.ok()) return table.status();
  return std::vector<PlacedMesh>{*shelf, *table, Axes()};
}

std::vector<PlacedMesh> DividerAndGrid() {
  TriangleMesh panel;
  AddBox({0, -0.05, 0}, {0.68, 1.45, 0.02}, kScreen, panel);
  for (const double x : {-0.35, 0.35}) AddBox({x, 0, 0}, {0.03, 1.55, 0.035}, kFrame, panel);
  for (const double y : {-0.05, -1.50}) AddBox({0, y, 0}, {0.68, 0.03, 0.03}, kFrame, panel);
  const double turn = 0.45, step = 0.73 * std::cos(turn);
  const Vector3d first(0.75, 0, -1.05);
  std::vector<PlacedMesh> things;
  for (int k = 0; k < 3; ++k) {
    things.push_back(Placed(panel, first + Vector3d(step * k, 0, 0), k % 2 == 0 ? turn : -turn,
                            SceneMaterial::kVirtual));
  }
  things.push_back(
      Placed(FloorGridMesh(3, 2.5, 0.25, kGridColor), {1.52, 0, -1.27}, 0, SceneMaterial::kGuide));
  return things;
}

std::vector<PlacedMesh> HiddenWires() {
  std::vector<PlacedMesh> things;
  const auto add = [&](const std::vector<Vector3d>& way, double radius, std::uint32_t color) {
    things.push_back(
        Placed(TubeMesh(way, radius, color), Vector3d::Zero(), 0, SceneMaterial::kHidden));
  };
  // Within the wall with the door: three wires to the button, down to a box, off to the ceiling.
  for (int k = 0; k < 3; ++k) {
    const double x = 1.59 + 0.03 * k, y = -0.31 - 0.03 * k;
    add({{x, -2.45, 0.04}, {x, y, 0.04}, {0.02, y, 0.04}}, 0.008, kWires[k]);
  }
  // In the other: hot and cold water, and a drain.
  add({{-0.05, -0.42, -0.1}, {-0.05, -0.42, -1.7}, {-0.05, -2.45, -1.7}}, 0.02, 0xd0452fff);
  add({{-0.05, -0.55, -0.1}, {-0.05, -0.55, -1.58}, {-0.05, -2.45, -1.58}}, 0.02, 0x2f7fd0ff);
  add({{0.0, -0.14, 0.08}, {2.62, -0.19, 0.08}, {2.62, -2.45, 0.08}}, 0.045, 0x8d9499ff);
  return things;
}

std::vector<PlacedMesh> EscapeRoute() {
  const std::vector<Vector3d> way = {
      {0.7, 0, -0.5}, {0.95, 0, -1.25}, {2.6, 0, -1.25}, {3.28, 0, -1.05}, {3.3, 0, -0.35}};
  TriangleMesh sign;
  AddBox({0, 0, 0}, {0.5, 0.2, 0.02}, kRouteColor, sign);
  Append(ArrowMesh({0, -0.18, -0.02}, {0, -0.02, -0.02}, 0.018, 0xf4f8f4ff), Rigid3(), 1.0, sign);
  return {Placed(RouteMesh(way, 0.26, kRouteColor), Vector3d::Zero(), 0, SceneMaterial::kGuide),
          Placed(sign, {3.3, -2.14, -0.06}, 0, SceneMaterial::kGuide)};
}

std::vector<PlacedMesh> RedArrow() {
  const Vector3d tip = FigureRoom::kAlarm + Vector3d(0.05, -0.04, -0.07);
  return {Placed(ArrowMesh(tip + Vector3d(0.52, -0.40, -0.30), tip, 0.026, kArrowColor),
                 Vector3d::Zero(), 0, SceneMaterial::kGuide)};
}

std::vector<PlacedMesh> HoseInCabinet() {
  constexpr int kColumns = 100, kRows = 132;
  const cv::Mat picture = PaintHose(kColumns, kRows);
  std::vector<std::uint32_t> pixels;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const auto& p = picture.at<cv::Vec3b>(row, column);
      pixels.push_back(std::uint32_t{p[2]} << 24 | std::uint32_t{p[1]} << 16 |
                       std::uint32_t{p[0]} << 8 | 0xff);
    }
  }
  return {Placed(PictureMesh(pixels, kColumns, FigureRoom::kCabinetWidth_m),
                 FigureRoom::kCabinetBase, 0, SceneMaterial::kGuide)};
}

std::vector<PlacedMesh> GridAndPerson() {
  return {
      Placed(FloorGridMesh(3, 2.5, 0.5, kGridColor), {1.52, 0, -1.27}, 0, SceneMaterial::kGuide),
      Placed(Person(), {1.27, 0, -1.02}, 0.2, SceneMaterial::kVirtual)};
}

}  // namespace saccade
