#include <cmath>

#include "server/sim/room_parts.hpp"

namespace saccade {
namespace {

constexpr float kTop = 0.74f;  // height of the desk

void Table(RoomBuilder& room, const RoomMaterials& m) {
  room.SetLightSpacing(0.025f);
  BoxPaint top(m.light_wood);
  top.top = RoomMaterials::Whole(room.AddTexture(PaintDeskTop(m.seed), false));
  room.Box(top, {1.08f, kTop - 0.03f, 0.01f}, {1.84f, 0.03f, 0.75f}, true);
  room.SetLightSpacing(0.08f);
  const BoxPaint steel(m.Plain(kCharcoal));
  for (const float x : {1.12f, 2.83f}) {
    room.Box(steel, {x, 0, 0.06f}, {0.05f, kTop - 0.03f, 0.05f});
    room.Box(steel, {x, 0, 0.66f}, {0.05f, kTop - 0.03f, 0.05f});
  }
  BoxPaint cabinet(m.light_wood);
  room.Box(cabinet, {2.32f, 0.04f, 0.08f}, {0.46f, 0.64f, 0.58f});
  for (int k = 0; k < 3; ++k) {
    const float y = 0.06f + 0.205f * static_cast<float>(k);
    room.Box(BoxPaint(m.light_wood), {2.33f, y, 0.66f}, {0.44f, 0.195f, 0.012f}, true);
    room.Box(BoxPaint(m.Plain(kSteel)), {2.48f, y + 0.13f, 0.672f}, {0.14f, 0.014f, 0.018f}, true);
  }
  room.Name("desk front edge", {1.95f, kTop, 0.76f});
}

void Monitor(RoomBuilder& room, const RoomMaterials& m) {
  room.Push({1.42f, kTop, 0.24f}, 0.32f);
  room.SetLightSpacing(0.05f);
  BoxPaint shell(m.Plain(kBlack));
  room.Box(shell, {-0.11f, 0, -0.09f}, {0.22f, 0.012f, 0.17f});
  room.Box(shell, {-0.025f, 0.012f, -0.045f}, {0.05f, 0.16f, 0.02f});
  room.Box(shell, {-0.27f, 0.11f, -0.025f}, {0.54f, 0.33f, 0.035f}, true);
  Paint screen = RoomMaterials::Whole(room.AddTexture(PaintScreen(m.seed), false));
  screen.glow = 0.85f;
  room.Quad(screen, {-0.255f, 0.425f, 0.0105f}, {0.51f, 0, 0}, {0, -0.287f, 0});
  room.Name("screen window corner",
            {-0.255f + 0.51f * 580 / 1024, 0.425f - 0.287f * 40 / 576, 0.0105f});
  room.Pop();
}

void Keyboard(RoomBuilder& room, const RoomMaterials& m) {
  room.SetLightSpacing(0.025f);
  room.Push({1.38f, kTop, 0.46f}, 0.10f);
  BoxPaint keys(m.Plain(kBlack));
  keys.top = RoomMaterials::Whole(room.AddTexture(PaintKeyboard(m.seed), false));
  room.Box(keys, {0, 0, 0}, {0.44f, 0.018f, 0.138f});
  room.Name("keyboard corner", {0.44f * 12 / 960, 0.018f, 0.138f * 14 / 300});
  room.Name("keyboard enter key", {0.44f * 700 / 960, 0.018f, 0.138f * 146 / 300});
  room.Pop();
  room.Push({1.93f, kTop, 0.50f}, -0.15f);  // mouse on its mat
  room.Box(BoxPaint(m.Plain(kNavy)), {-0.09f, 0, -0.02f}, {0.20f, 0.003f, 0.17f});
  room.Box(BoxPaint(m.Plain(kLightGrey)), {-0.03f, 0.003f, 0.02f}, {0.06f, 0.028f, 0.10f});
  room.Box(BoxPaint(m.Plain(kCharcoal)), {-0.004f, 0.031f, 0.03f}, {0.008f, 0.004f, 0.022f});
  room.Name("mouse wheel", {0, 0.035f, 0.041f});
  room.Pop();
}

void Mug(RoomBuilder& room, const RoomMaterials& m) {
  room.SetLightSpacing(0.02f);
  room.Push({2.13f, kTop, 0.36f}, -0.25f);
  Paint print = RoomMaterials::Whole(room.AddTexture(PaintMug(m.seed)));
  print.origin.x() = 0.25f;
  room.Tube(print, {0, 0, 0}, 0.041f, 0.041f, 0.098f, 24);
  room.Tube(m.Plain(kCream), {0, 0.01f, 0}, 0.037f, 0.037f, 0.088f, 24, true);
  room.Disc(m.Plain(kSoil), {0, 0.075f, 0}, 0.037f, 24);
  const BoxPaint handle(m.Plain(kCream));
  room.Box(handle, {0.039f, 0.072f, -0.007f}, {0.030f, 0.012f, 0.014f}, true);
  room.Box(handle, {0.039f, 0.020f, -0.007f}, {0.030f, 0.012f, 0.014f}, true);
  room.Box(handle, {0.060f, 0.020f, -0.007f}, {0.010f, 0.064f, 0.014f}, true);
  room.Name("mug", {0, 0.098f * (1 - 108.0f / 256), 0.041f});
  room.Pop();
}

void PenCup(RoomBuilder& room, const RoomMaterials& m) {
  cv::RNG rng = RngFor(m.seed, "pens");
  room.SetLightSpacing(0.03f);
  room.Push({2.02f, kTop, 0.16f});
  room.Tube(m.Plain(kCharcoal), {0, 0, 0}, 0.04f, 0.04f, 0.10f, 16);
  room.Disc(m.Plain(kBlack), {0, 0.09f, 0}, 0.039f, 12);
  int k = 0;
  for (const PaletteCell color : {kRed, kBlue, kYellow, kGreen, kOrange, kSteel}) {
    room.Push({0, 0.03f, 0}, 1.05f * static_cast<float>(k++),
              static_cast<float>(rng.uniform(0.10, 0.30)));
    room.Tube(m.Plain(color), {0, 0, 0}, 0.0045f, 0.0045f,
              static_cast<float>(rng.uniform(0.12, 0.17)), 6);
    room.Pop();
  }
  room.Pop();
}

/// A screwdriver that lies on the desk, its point towards local +x.
void Screwdriver(RoomBuilder& room, const RoomMaterials& m, const Eigen::Vector3f& at, float turn,
                 PaletteCell grip) {
  room.Push(at, turn);
  room.Box(BoxPaint(m.Plain(grip)), {0, 0, -0.012f}, {0.10f, 0.024f, 0.024f});
  room.Box(BoxPaint(m.Plain(kBlack)), {0.022f, 0.0005f, -0.0125f}, {0.012f, 0.0245f, 0.025f});
  room.Box(BoxPaint(m.Plain(kSteel)), {0.10f, 0.009f, -0.003f}, {0.11f, 0.006f, 0.006f}, true);
  room.Pop();
}

void Workplace(RoomBuilder& room, const RoomMaterials& m) {
  room.SetLightSpacing(0.025f);
  const Eigen::Vector3f mat(2.22f, kTop, 0.40f);
  BoxPaint cutting(m.Plain(kDarkGreen));
  cutting.top = RoomMaterials::Whole(room.AddTexture(PaintCuttingMat(m.seed), false));
  room.Box(cutting, mat, {0.45f, 0.003f, 0.31f});
  room.Name("cutting mat corner",
            mat + Eigen::Vector3f(0.45f * 30 / 640, 0.003f, 0.31f * 410 / 440));
  room.Push(mat + Eigen::Vector3f(0.30f, 0.003f, 0.05f), -0.35f);
  BoxPaint meter(m.Plain(kYellow));
  meter.top = RoomMaterials::Whole(room.AddTexture(PaintMeter(m.seed), false));
  room.Box(meter, {0, 0, 0}, {0.085f, 0.032f, 0.152f});
  room.Name("multimeter dial", {0.0425f, 0.032f, 0.152f * 226 / 400});
  room.Pop();
  Screwdriver(room, m, mat + Eigen::Vector3f(0.05f, 0.003f, 0.10f), 0.25f, kRed);
  Screwdriver(room, m, mat + Eigen::Vector3f(0.06f, 0.003f, 0.17f), 0.05f, kYellow);
  room.Name("screwdriver grip", mat + Eigen::Vector3f(0.05f + 0.034f * std::cos(0.25f), 0.028f,
                                                      0.10f - 0.034f * std::sin(0.25f)));
  room.Tube(m.Plain(kOrange), mat + Eigen::Vector3f(0.20f, 0.003f, 0.25f), 0.035f, 0.035f, 0.022f,
            20);  // tape
  room.Disc(m.Plain(kBrown), mat + Eigen::Vector3f(0.20f, 0.0245f, 0.25f), 0.035f, 20);
  room.Disc(m.Plain(kBlack), mat + Eigen::Vector3f(0.20f, 0.0252f, 0.25f), 0.019f, 16);

  BoxPaint drawers(m.Plain(kNavy));
  drawers.front = RoomMaterials::Whole(room.AddTexture(PaintDrawers(m.seed), false));
  room.Box(drawers, {2.40f, kTop, 0.03f}, {0.34f, 0.215f, 0.14f});
  room.Name("drawer label A3",
            {2.40f + 0.34f * 320 / 640, kTop + 0.215f * (1 - 28.0f / 480), 0.17f});
}

void Papers(RoomBuilder& room, const RoomMaterials& m) {
  const auto sheet = [&](int kind, const Eigen::Vector3f& at, float turn, float thickness) {
    room.Push(at, turn);
    BoxPaint paper(m.Plain(kPaper));
    paper.top = RoomMaterials::Cell(m.papers, kind % 2, kind / 2, 2, 2);
    const float scale = kind == 2 ? 0.72f : 1.0f;
    room.Box(paper, {0, 0, 0}, {0.21f * scale, thickness, 0.297f * scale});
    room.Pop();
  };
  room.SetLightSpacing(0.03f);
  sheet(0, {1.11f, kTop, 0.36f}, 0.12f, 0.002f);
  sheet(1, {1.13f, kTop + 0.002f, 0.44f}, -0.10f, 0.002f);
  sheet(3, {1.70f, kTop, 0.20f}, 0.05f, 0.001f);
  sheet(2, {1.66f, kTop, 0.61f - 0.03f}, 0.35f, 0.010f);
  room.Push({1.66f, kTop, 0.58f}, 0.35f);
  room.Name("notebook", {0.21f * 0.72f * 54 / 416, 0.010f, 0.297f * 0.72f * 50 / 576});
  room.Pop();
  // A telephone, and books that lie on each other.
  room.Push({2.00f, kTop, 0.68f}, -0.3f);
  room.Box(BoxPaint(m.Plain(kBlack)), {-0.036f, 0, -0.075f}, {0.072f, 0.008f, 0.15f});
  room.Box(BoxPaint(m.Plain(kBlue)), {-0.032f, 0.008f, -0.066f}, {0.064f, 0.0006f, 0.13f});
  room.Pop();
  float y = kTop;
  for (int k = 0; k < 3; ++k) {
    const float thickness = 0.026f + 0.007f * static_cast<float>(k % 2);
    room.Push({2.79f, y, 0.50f}, 0.12f * static_cast<float>(k) - 0.1f);
    const int kind = static_cast<int>(m.seed % 7) + 9 * k;
    const Paint spine =
        RoomMaterials::Cell(m.spines, kind % kSpineColumns, 0, kSpineColumns, kSpineRows);
    BoxPaint book(m.Plain(kPaper));
    book.top = m.Plain(k == 2 ? kTeal : kDarkRed);
    // The spine lies: its texture runs along the book.
    room.Box(book, {-0.10f, 0, -0.075f}, {0.20f, thickness, 0.15f});
    room.Push({0, 0, 0.0755f}, 0, 0, 1.5707963f);
    room.Quad(spine, {0, 0.10f, 0}, {thickness, 0, 0}, {0, -0.20f, 0});
    room.Pop();
    room.Pop();
    y += thickness;
  }
  room.Name("top book corner", {2.79f, y, 0.50f});
}

void Lamp(RoomBuilder& room, const RoomMaterials& m) {
  room.SetLightSpacing(0.03f);
  room.Push({2.86f, kTop, 0.22f});
  room.Tube(m.Plain(kDarkGreen), {0, 0, 0}, 0.075f, 0.07f, 0.02f, 24);
  room.Disc(m.Plain(kDarkGreen), {0, 0.02f, 0}, 0.07f, 24);
  room.Tube(m.Plain(kBrass), {0, 0.02f, 0}, 0.008f, 0.008f, 0.44f, 10);
  room.Push({0, 0.45f, 0}, 0, 0, 1.45f);
  room.Tube(m.Plain(kBrass), {0, 0, 0}, 0.007f, 0.007f, 0.21f, 10);
  room.Pop();
  room.Tube(m.Plain(kDarkGreen), {-0.20f, 0.40f, 0.08f}, 0.085f, 0.035f, 0.10f, 24);
  room.Tube(m.Plain(kPaper), {-0.20f, 0.40f, 0.08f}, 0.083f, 0.033f, 0.10f, 24, true);
  room.Disc(m.Plain(kDarkGreen), {-0.20f, 0.50f, 0.08f}, 0.035f, 20);
  room.Name("lamp shade rim", {-0.20f, 0.40f, 0.08f + 0.085f});
  room.Pop();
}

void WallShelf(RoomBuilder& room, const RoomMaterials& m) {
  cv::RNG rng = RngFor(m.seed, "shelf");
  const float y = 1.46f;
  room.SetLightSpacing(0.05f);
  room.Box(BoxPaint(m.dark_wood), {1.20f, y, 0}, {1.62f, 0.025f, 0.22f}, true);
  for (const float x : {1.32f, 2.66f}) {
    room.Box(BoxPaint(m.Plain(kCharcoal)), {x, y - 0.14f, 0}, {0.02f, 0.14f, 0.012f}, true);
    room.Box(BoxPaint(m.Plain(kCharcoal)), {x, y - 0.014f, 0}, {0.02f, 0.014f, 0.19f}, true);
  }
  room.Name("shelf edge", {1.60f, y + 0.0125f, 0.22f});
  const float top = y + 0.025f;
  BookRow(room, m, rng, 1.23f, 1.74f, top, 0.20f, 0.30f);
  Carton(room, m, 2, {1.80f, top, 0.02f}, {0.22f, 0.13f, 0.18f});
  room.SetLightSpacing(0.03f);
  room.Tube(m.Plain(kSteel), {2.10f, top, 0.11f}, 0.045f, 0.045f, 0.12f, 18);  // tins of paint
  room.Disc(m.Plain(kRed), {2.10f, top + 0.12f, 0.11f}, 0.045f, 18);
  room.Tube(m.Plain(kYellow), {2.10f, top + 0.03f, 0.11f}, 0.0455f, 0.0455f, 0.06f, 18);
  room.Tube(m.Plain(kSteel), {2.21f, top, 0.12f}, 0.05f, 0.05f, 0.14f, 18);
  room.Tube(m.Plain(kBlue), {2.21f, top + 0.03f, 0.12f}, 0.0505f, 0.0505f, 0.07f, 18);
  room.Disc(m.Plain(kSteel), {2.21f, top + 0.14f, 0.12f}, 0.05f, 18);
  room.Name("blue tin", {2.21f, top + 0.10f, 0.12f + 0.0505f});
  BookRow(room, m, rng, 2.34f, 2.78f, top, 0.19f, 0.30f);
}

}  // namespace

void BuildDesk(RoomBuilder& room, const RoomMaterials& m) {
  Table(room, m);
  WallShelf(room, m);
  Monitor(room, m);
  Keyboard(room, m);
  Mug(room, m);
  PenCup(room, m);
  Workplace(room, m);
  Papers(room, m);
  Lamp(room, m);
}

}  // namespace saccade
