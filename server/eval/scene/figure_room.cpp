#include "server/eval/scene/figure_room.hpp"

#include "server/eval/scene/room_mesh.hpp"
#include "server/markers/marker_detector.hpp"
#include "server/markers/marker_pattern.hpp"
#include "server/sim/light_bake.hpp"
#include "server/sim/room_parts.hpp"

namespace saccade {
namespace {

constexpr std::uint64_t kSeed = 6;
constexpr int kCell_px = 32;

/// A square with a margin of one cell, as it is printed.
absl::StatusOr<cv::Mat> PaintSquare(int id) {
  const absl::StatusOr<MarkerPattern> pattern = PatternOf(kKollerFamily, id);
  if (!pattern.ok()) return pattern.status();
  const int cells = pattern->cells;
  cv::Mat paper((cells + 2) * kCell_px, (cells + 2) * kCell_px, CV_8UC3, Rgb(238, 237, 232));
  for (int row = 0; row < cells; ++row) {
    for (int column = 0; column < cells; ++column) {
      const bool red = pattern->At(row, column) == CellShade::kRed;
      Fill(paper, {(column + 1) * kCell_px, (row + 1) * kCell_px, kCell_px, kCell_px},
           red ? Rgb(206, 28, 32) : Rgb(18, 18, 20));
    }
  }
  return paper;
}

/// Hangs a square with its middle at (x, y) of the wall of the current frame.
absl::Status HangSquare(RoomBuilder& room, const RoomMaterials& materials, int id, float x, float y,
                        SquareMap& squares) {
  const absl::StatusOr<cv::Mat> paper = PaintSquare(id);
  if (!paper.ok()) return paper.status();
  const auto side = static_cast<float>(FigureRoom::kSide_m);
  const float half = 0.5f * side * 10.0f / 8.0f;
  Hang(room, materials, RoomMaterials::Whole(room.AddTexture(*paper, false)), x - half, y - half,
       2 * half, 2 * half);
  const Eigen::Vector3f middle = room.ToWorld({x, y, 0.005f});
  Eigen::Matrix3d axes;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3f tip =
        room.ToWorld(Eigen::Vector3f(x, y, 0.005f) + Eigen::Vector3f(Eigen::Vector3f::Unit(k)));
    axes.col(k) = (tip - middle).cast<double>();
  }
  squares.squares.push_back({kKollerFamily,
                             id,
                             FigureRoom::kSide_m,
                             {Eigen::Quaterniond(axes).normalized(), middle.cast<double>()}});
  return absl::OkStatus();
}

absl::Status HangSquares(RoomBuilder& room, const RoomMaterials& materials, SquareMap& squares) {
  int id = 0;
  PushWall(room, Wall::kDesk);
  for (const auto& [x, y] :
       {std::pair{0.42f, 1.18f}, {1.06f, 0.92f}, {0.62f, 1.86f}, {1.30f, 1.95f}}) {
    if (absl::Status hung = HangSquare(room, materials, id++, x, y, squares); !hung.ok())
      return hung;
  }
  room.Pop();
  PushWall(room, Wall::kLeft);
  for (const auto& [x, y] :
       {std::pair{3.55f, 1.02f}, {3.05f, 1.30f}, {3.50f, 1.75f}, {2.95f, 1.98f}}) {
    if (absl::Status hung = HangSquare(room, materials, id++, x, y, squares); !hung.ok())
      return hung;
  }
  room.Pop();
  return absl::OkStatus();
}

void BuildFittings(RoomBuilder& room, const RoomMaterials& m) {
  room.SetLightSpacing(0.08f);
  BoxPaint leaf(m.light_wood);
  leaf.front = RoomMaterials::Whole(room.AddTexture(PaintDoor(m.seed), false));
  room.Box(leaf, {2.88f, 0.005f, 0}, {0.84f, 1.98f, 0.03f});
  const BoxPaint frame(m.Plain(kCream));
  room.Box(frame, {2.80f, 0, 0}, {0.08f, 2.07f, 0.05f});
  room.Box(frame, {3.72f, 0, 0}, {0.08f, 2.07f, 0.05f});
  room.Box(frame, {2.80f, 1.99f, 0}, {1.00f, 0.08f, 0.05f}, true);
  // A grey cabinet with a handle; what is in it nobody sees.
  room.Box(BoxPaint(m.Plain(kLightGrey)), {2.08f, 0.84f, 0}, {0.56f, 0.74f, 0.16f}, true);
  room.Box(BoxPaint(m.Plain(kSteel)), {2.56f, 1.15f, 0.16f}, {0.02f, 0.12f, 0.02f}, true);
  // The alarm button, in its housing.
  room.SetLightSpacing(0.03f);
  room.Box(BoxPaint(m.Plain(kRed)), {1.56f, 1.39f, 0}, {0.12f, 0.12f, 0.04f}, true);
  room.Box(BoxPaint(m.Plain(kPaper)), {1.585f, 1.415f, 0.04f}, {0.07f, 0.07f, 0.006f}, true);
  room.Box(BoxPaint(m.Plain(kBlack)), {1.605f, 1.435f, 0.046f}, {0.03f, 0.03f, 0.008f}, true);
}

void BuildCartons(RoomBuilder& room, const RoomMaterials& m) {
  Carton(room, m, 0, {0.78f, 0, 0.62f}, {0.62f, 0.48f, 0.46f});
  Carton(room, m, 1, {0.84f, 0.48f, 0.64f}, {0.52f, 0.44f, 0.40f});
  Carton(room, m, 2, {0.90f, 0.92f, 0.66f}, {0.40f, 0.34f, 0.34f});
}

std::vector<AreaLight> Lights(const RoomBuilder& room) {
  const Eigen::Vector3f origin = room.ToWorld(Eigen::Vector3f::Zero());
  const auto light = [&](const Eigen::Vector3f& centre, const Eigen::Vector3f& u,
                         const Eigen::Vector3f& v, const Eigen::Vector3f& facing,
                         const Eigen::Vector3f& rgb) {
    return AreaLight{.centre = room.ToWorld(centre),
                     .half_u = room.ToWorld(u) - origin,
                     .half_v = room.ToWorld(v) - origin,
                     .normal = room.ToWorld(facing) - origin,
                     .rgb = rgb,
                     .samples = 3};
  };
  const Eigen::Vector3f day(11.0f, 12.0f, 13.2f), lamp(19.0f, 18.2f, 16.8f);
  return {light({0.03f, 1.5f, 2.45f}, {0, 0, 0.62f}, {0, 0.57f, 0}, {1, 0, 0}, day),
          light({1.5f, 2.46f, 1.8f}, {0.29f, 0, 0}, {0, 0, 0.29f}, {0, -1, 0}, lamp),
          light({2.7f, 2.46f, 2.4f}, {0.29f, 0, 0}, {0, 0, 0.29f}, {0, -1, 0}, lamp)};
}

}  // namespace

absl::StatusOr<FigureRoom> BuildFigureRoom(bool cartons) {
  Eigen::Isometry3d world_from_room = Eigen::Isometry3d::Identity();
  world_from_room.rotate(Eigen::Quaterniond(0, 1, 0, 0));  // half a turn about x
  RoomBuilder room(world_from_room);
  const RoomMaterials materials(kSeed, room);
  FigureRoom built;
  BuildShell(room, materials);
  if (absl::Status hung = HangSquares(room, materials, built.squares); !hung.ok()) return hung;
  BuildFittings(room, materials);
  if (cartons) BuildCartons(room, materials);
  const std::vector<AreaLight> lights = Lights(room);
  built.scene = room.Take();
  BakeLight(lights, 2, built.scene);
  built.real = RoomMeshOf(built.scene);
  return built;
}

}  // namespace saccade
