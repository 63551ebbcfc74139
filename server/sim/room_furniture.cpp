#include <algorithm>
#include <cmath>

#include "server/sim/room_parts.hpp"

namespace saccade {

void BookRow(RoomBuilder& room, const RoomMaterials& m, cv::RNG& rng, float x0, float x1, float y,
             float z, float max_height) {
  room.SetLightSpacing(0.10f);
  for (float x = x0; x < x1;) {
    const float width = static_cast<float>(rng.uniform(0.018, 0.05));
    if (x + width > x1) break;
    const int kind = rng.uniform(0, kSpineColumns * kSpineRows);
    const float height = std::min(max_height, static_cast<float>(rng.uniform(0.17, 0.27)));
    const float depth = std::min(0.7f * height, 0.16f);
    Paint spine = RoomMaterials::Cell(m.spines, kind % kSpineColumns, kind / kSpineColumns,
                                      kSpineColumns, kSpineRows);
    BoxPaint book(spine);
    Paint cover = spine;  // the plain rim of the spine, stretched
    cover.origin += Eigen::Vector2f(0.3f * spine.size.x(), 0.005f);
    cover.size = {0.3f * spine.size.x(), 0.01f};
    book.left = book.right = cover;
    book.top = m.Plain(kPaper);
    const float back = z - static_cast<float>(rng.uniform(0.0, 0.025));
    room.Box(book, {x, y, back - depth}, {width, height, depth});
    x += width + (rng.uniform(0, 14) == 0 ? 0.05f : 0.001f);
  }
}

void Carton(RoomBuilder& room, const RoomMaterials& m, int label, const Eigen::Vector3f& corner,
            const Eigen::Vector3f& size) {
  room.SetLightSpacing(0.07f);
  BoxPaint paint(RoomMaterials::Cell(m.cartons, 1, 1, 2, 2));
  paint.front = RoomMaterials::Cell(m.cartons, label % 2, label / 2, 2, 2);
  paint.left = RoomMaterials::Cell(m.cartons, (label + 1) % 3 % 2, (label + 1) % 3 / 2, 2, 2);
  room.Box(paint, corner, size);
}

namespace {

void Bookcase(RoomBuilder& room, const RoomMaterials& m) {
  PushWall(room, Wall::kLeft);
  cv::RNG rng = RngFor(m.seed, "bookcase");
  const float x0 = 2.52f, x1 = 3.42f, depth = 0.30f, height = 1.90f, board = 0.022f;
  const BoxPaint wood(m.light_wood);
  room.SetLightSpacing(0.07f);
  room.Box(wood, {x0, 0, 0}, {board, height, depth});
  room.Box(wood, {x1 - board, 0, 0}, {board, height, depth});
  room.Quad(m.light_wood, {x0, height, 0.012f}, {x1 - x0, 0, 0}, {0, -height, 0});
  const float inner = x1 - x0 - 2 * board;
  for (int k = 0; k < 6; ++k) {
    const float y = k == 5 ? height - board : 0.06f + 0.365f * static_cast<float>(k);
    room.SetLightSpacing(0.07f);
    room.Box(wood, {x0 + board, y, 0.012f}, {inner, board, depth - 0.012f}, true);
    if (k == 5) break;
    const float floor = y + board, left = x0 + board + 0.01f;
    switch (k) {
      case 0:
        Carton(room, m, 0, {left, floor, 0.05f}, {0.36f, 0.24f, 0.22f});
        Carton(room, m, 2, {left + 0.42f, floor, 0.04f}, {0.34f, 0.28f, 0.22f});
        break;
      case 2:
        BookRow(room, m, rng, left, left + 0.42f, floor, depth - 0.03f, 0.30f);
        room.SetLightSpacing(0.04f);
        room.Tube(m.Plain(kTeal), {left + 0.58f, floor, 0.16f}, 0.05f, 0.075f, 0.16f, 16);  // vase
        room.Tube(m.Plain(kTeal), {left + 0.58f, floor + 0.16f, 0.16f}, 0.075f, 0.03f, 0.08f, 16);
        room.Name("vase", {left + 0.58f, floor + 0.08f, 0.16f + 0.0625f});
        break;
      default:
        BookRow(room, m, rng, left, x1 - board - 0.01f, floor, depth - 0.03f, 0.30f);
    }
    if (k == 3) room.Name("bookcase board", {x0 + 0.45f, y + 0.5f * board, depth});
  }
  room.Pop();
}

void Sideboard(RoomBuilder& room, const RoomMaterials& m) {
  PushWall(room, Wall::kRight);
  const float x0 = 0.95f, width = 1.65f, depth = 0.42f, height = 0.80f;
  room.SetLightSpacing(0.07f);
  room.Box(BoxPaint(m.dark_wood), {x0, 0.06f, 0}, {width, height - 0.06f, depth}, true);
  room.Box(BoxPaint(m.light_wood), {x0 - 0.01f, height, 0}, {width + 0.02f, 0.025f, depth + 0.015f},
           true);
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) {
      const float x = x0 + 0.02f + 0.54f * static_cast<float>(column);
      const float y = 0.09f + 0.235f * static_cast<float>(row);
      room.SetLightSpacing(0.09f);
      room.Box(BoxPaint(m.light_wood), {x, y, depth}, {0.525f, 0.222f, 0.014f}, true);
      room.SetLightSpacing(0.05f);
      room.Box(BoxPaint(m.Plain(kCharcoal)), {x + 0.20f, y + 0.15f, depth + 0.014f},
               {0.125f, 0.016f, 0.02f}, true);
    }
  }
  room.Name("drawer handle", {x0 + 0.02f + 0.54f + 0.20f, 0.09f + 0.47f + 0.166f, depth + 0.034f});

  const float top = height + 0.025f;
  BoxPaint printer(m.Plain(kLightGrey));
  printer.front = RoomMaterials::Whole(room.AddTexture(PaintPrinter(m.seed), false));
  room.SetLightSpacing(0.06f);
  room.Box(printer, {x0 + 0.06f, top, 0.04f}, {0.42f, 0.23f, 0.34f});
  room.Box(BoxPaint(m.Plain(kCharcoal)), {x0 + 0.12f, top + 0.23f, 0.10f}, {0.30f, 0.02f, 0.22f});
  room.Name("printer", {x0 + 0.06f + 0.42f * 0.80f, top + 0.23f * 0.90f, 0.38f});
  Carton(room, m, 0, {x0 + 0.58f, top, 0.06f}, {0.34f, 0.24f, 0.28f});
  Carton(room, m, 1, {x0 + 0.62f, top + 0.24f, 0.09f}, {0.26f, 0.17f, 0.22f});
  room.Name("screw carton", {x0 + 0.58f + 0.34f * 0.12f, top + 0.24f * 0.80f, 0.34f});
  // A red tool box with two clasps and a handle.
  room.SetLightSpacing(0.05f);
  const Eigen::Vector3f box(x0 + 1.10f, top, 0.08f);
  room.Box(BoxPaint(m.Plain(kRed)), box, {0.42f, 0.14f, 0.22f});
  room.Box(BoxPaint(m.Plain(kDarkRed)), box + Eigen::Vector3f(-0.006f, 0.14f, -0.006f),
           {0.432f, 0.05f, 0.232f}, true);
  for (const float x : {0.07f, 0.31f}) {
    room.Box(BoxPaint(m.Plain(kSteel)), box + Eigen::Vector3f(x, 0.11f, 0.226f),
             {0.04f, 0.05f, 0.008f}, true);
  }
  room.Box(BoxPaint(m.Plain(kBlack)), box + Eigen::Vector3f(0.12f, 0.22f, 0.10f),
           {0.18f, 0.018f, 0.024f}, true);
  room.Box(BoxPaint(m.Plain(kBlack)), box + Eigen::Vector3f(0.12f, 0.19f, 0.10f),
           {0.018f, 0.03f, 0.024f});
  room.Box(BoxPaint(m.Plain(kBlack)), box + Eigen::Vector3f(0.282f, 0.19f, 0.10f),
           {0.018f, 0.03f, 0.024f});
  room.Name("tool box clasp", box + Eigen::Vector3f(0.09f, 0.135f, 0.234f));
  // Cartons on the floor in the corner.
  Carton(room, m, 2, {3.22f, 0, 0.06f}, {0.55f, 0.40f, 0.42f});
  Carton(room, m, 1, {3.30f, 0.40f, 0.10f}, {0.40f, 0.30f, 0.32f});
  room.Name("floor carton", {3.30f + 0.40f * 0.5f, 0.40f + 0.30f * 0.74f, 0.42f});
  room.Pop();
}

void Plant(RoomBuilder& room, const RoomMaterials& m) {
  cv::RNG rng = RngFor(m.seed, "plant");
  const Paint leaf = RoomMaterials::Whole(room.AddTexture(PaintLeaf(m.seed), false));
  room.Push({3.58f, 0, 0.44f});
  room.SetLightSpacing(0.05f);
  room.Tube(m.Plain(kTerracotta), {0, 0, 0}, 0.12f, 0.17f, 0.30f, 20);
  room.Tube(m.Plain(kTerracotta), {0, 0.28f, 0}, 0.18f, 0.18f, 0.04f, 20);
  room.Disc(m.Plain(kSoil), {0, 0.31f, 0}, 0.175f, 20);
  room.Name("plant pot rim", {0, 0.30f, 0.18f});
  for (int k = 0; k < 15; ++k) {
    room.Push({0, 0.31f, 0}, 2.39996f * static_cast<float>(k), 0);
    const float length = static_cast<float>(rng.uniform(0.35, 0.75));
    const float lean = static_cast<float>(rng.uniform(0.20, 0.48));
    const float width = 0.11f * length + 0.03f;
    // A blade that rises and bends over; drawn from both sides.
    const auto blade = [=](float s, float t) {
      const float along = (1 - t) * length;
      const float half = width * std::sin(3.1415926f * (0.06f + 0.94f * (1 - t)));
      const float out = lean * along * along / length * 0.9f;
      const float up = along * (1 - 0.35f * lean * along / length);
      return Eigen::Vector3f((2 * s - 1) * half, up,
                             0.02f + out + 0.3f * half * std::abs(2 * s - 1));
    };
    room.Sheet(leaf, 2, 4, blade, 0.1f, 0.3f);
    room.Sheet(
        leaf, 2, 4, [&](float s, float t) { return blade(1 - s, t); }, 0.1f, 0.3f);
    room.Pop();
  }
  room.Pop();
}

void Chair(RoomBuilder& room, const RoomMaterials& m) {
  room.Push({3.42f, 0, 3.22f}, 2.5f);
  room.SetLightSpacing(0.06f);
  const BoxPaint cloth(m.Plain(kNavy)), metal(m.Plain(kCharcoal));
  room.Box(cloth, {-0.23f, 0.44f, -0.22f}, {0.46f, 0.06f, 0.44f}, true);
  room.Push({0, 0.50f, -0.22f}, 0, -0.15f);
  room.Box(cloth, {-0.21f, 0.10f, -0.03f}, {0.42f, 0.42f, 0.05f}, true);
  room.Box(metal, {-0.03f, -0.05f, -0.05f}, {0.06f, 0.22f, 0.02f}, true);
  room.Pop();
  room.Tube(m.Plain(kSteel), {0, 0.10f, 0}, 0.025f, 0.025f, 0.34f, 10);
  for (int k = 0; k < 5; ++k) {
    room.Push({0, 0.06f, 0}, 1.2566f * static_cast<float>(k));
    room.Box(metal, {-0.02f, 0, 0}, {0.04f, 0.035f, 0.28f}, true);
    room.Box(BoxPaint(m.Plain(kBlack)), {-0.025f, -0.06f, 0.24f}, {0.05f, 0.06f, 0.05f});
    room.Pop();
  }
  room.Pop();
}

}  // namespace

void BuildFurniture(RoomBuilder& room, const RoomMaterials& m) {
  BoxPaint rug(m.Plain(kDarkRed));
  rug.top = RoomMaterials::Whole(room.AddTexture(PaintRug(m.seed), false));
  room.SetLightSpacing(0.08f);
  room.Box(rug, {1.15f, 0, 1.45f}, {1.70f, 0.008f, 1.13f});
  room.Name("rug corner", {1.15f + 1.70f * 34.0f / 768, 0.008f, 1.45f + 1.13f * 34.0f / 512});
  Bookcase(room, m);
  Sideboard(room, m);
  Plant(room, m);
  Chair(room, m);
  room.SetLightSpacing(0.05f);  // waste paper
  room.Tube(m.Plain(kGrey), {0.78f, 0, 0.26f}, 0.11f, 0.14f, 0.32f, 18);
  room.Tube(m.Plain(kCharcoal), {0.78f, 0, 0.26f}, 0.105f, 0.135f, 0.32f, 18, true);
  room.Disc(m.Plain(kPaper), {0.78f, 0.20f, 0.26f}, 0.12f, 14);
}

}  // namespace saccade
