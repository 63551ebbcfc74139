#include <cmath>

#include "server/sim/room_parts.hpp"

namespace saccade {
namespace {

constexpr float kSide = 4.0f, kHeight = 2.5f;

void Window(RoomBuilder& room, const RoomMaterials& m) {
  // In the left wall; the frame stands a little proud of it.
  PushWall(room, Wall::kLeft);
  Paint outside = RoomMaterials::Whole(room.AddTexture(PaintOutside(m.seed), false));
  outside.glow = 1.15f;
  room.Quad(outside, {0.92f, 2.1f, 0.004f}, {1.26f, 0, 0}, {0, -1.2f, 0});
  const BoxPaint frame(m.Plain(kWhite));
  room.SetLightSpacing(0.08f);
  room.Box(frame, {0.86f, 0.87f, 0}, {0.07f, 1.26f, 0.035f}, true);
  room.Box(frame, {2.17f, 0.87f, 0}, {0.07f, 1.26f, 0.035f}, true);
  room.Box(frame, {0.86f, 2.09f, 0}, {1.38f, 0.06f, 0.035f}, true);
  room.Box(frame, {0.86f, 0.87f, 0}, {1.38f, 0.05f, 0.035f}, true);
  room.Box(frame, {1.525f, 0.90f, 0}, {0.05f, 1.2f, 0.03f}, true);
  room.Box(frame, {0.92f, 1.68f, 0}, {1.26f, 0.035f, 0.025f}, true);
  room.Box(BoxPaint(m.Plain(kCream)), {0.80f, 0.835f, 0}, {1.5f, 0.03f, 0.20f}, true);  // sill
  room.Name("window handle", {1.55f, 1.45f, 0.03f});
  room.Box(BoxPaint(m.Plain(kSteel)), {1.54f, 1.40f, 0.03f}, {0.02f, 0.12f, 0.02f}, true);

  const Paint cloth = RoomMaterials::Whole(room.AddTexture(PaintCurtain(m.seed)));
  for (const float x : {0.50f, 2.22f}) {
    room.Sheet(
        cloth, 28, 1,
        [x](float s, float t) {
          const float wave = std::sin(6.2831853f * 5 * s + 0.6f * t);
          return Eigen::Vector3f(x + 0.34f * s, 2.28f - 1.62f * t, 0.10f + 0.028f * wave);
        },
        0.6f, 1.6f);
  }
  room.Box(BoxPaint(m.Plain(kSteel)), {0.42f, 2.28f, 0.08f}, {2.24f, 0.022f, 0.022f}, true);
  const Paint ribs = RoomMaterials::Whole(room.AddTexture(PaintRadiator(m.seed)));
  BoxPaint radiator(m.Plain(kWhite));
  radiator.front = ribs;
  room.Box(radiator, {1.0f, 0.14f, 0.03f}, {1.1f, 0.56f, 0.09f}, true);
  room.Pop();
}

void Door(RoomBuilder& room, const RoomMaterials& m) {
  PushWall(room, Wall::kBack);
  room.SetLightSpacing(0.10f);
  BoxPaint leaf(m.light_wood);
  leaf.front = RoomMaterials::Whole(room.AddTexture(PaintDoor(m.seed), false));
  room.Box(leaf, {0.34f, 0.005f, 0}, {0.88f, 2.0f, 0.02f});
  const BoxPaint frame(m.Plain(kCream));
  room.Box(frame, {0.26f, 0, 0}, {0.08f, 2.09f, 0.045f});
  room.Box(frame, {1.22f, 0, 0}, {0.08f, 2.09f, 0.045f});
  room.Box(frame, {0.26f, 2.005f, 0}, {1.04f, 0.085f, 0.045f}, true);
  room.SetLightSpacing(0.03f);
  room.Box(BoxPaint(m.Plain(kSteel)), {1.10f, 0.98f, 0.02f}, {0.04f, 0.16f, 0.008f}, true);
  room.Box(BoxPaint(m.Plain(kSteel)), {0.99f, 1.05f, 0.055f}, {0.13f, 0.02f, 0.02f}, true);
  room.Box(BoxPaint(m.Plain(kSteel)), {1.11f, 1.05f, 0.02f}, {0.02f, 0.02f, 0.05f}, true);
  room.Name("door sign", {0.634f, 1.10f, 0.02f});
  room.Box(BoxPaint(m.Plain(kWhite)), {1.40f, 1.06f, 0}, {0.085f, 0.085f, 0.012f}, true);
  room.Box(BoxPaint(m.Plain(kLightGrey)), {1.415f, 1.075f, 0.012f}, {0.055f, 0.055f, 0.006f}, true);
  room.Name("light switch", {1.4425f, 1.1025f, 0.018f});
  room.Pop();
}

void Skirting(RoomBuilder& room, const RoomMaterials& m) {
  const BoxPaint white(m.Plain(kCream));
  room.SetLightSpacing(0.15f);
  for (const Wall wall : {Wall::kDesk, Wall::kRight, Wall::kLeft}) {
    PushWall(room, wall);
    room.Box(white, {0, 0, 0}, {kSide, 0.08f, 0.014f});
    room.Pop();
  }
  PushWall(room, Wall::kBack);
  room.Box(white, {0, 0, 0}, {0.26f, 0.08f, 0.014f});
  room.Box(white, {1.30f, 0, 0}, {kSide - 1.30f, 0.08f, 0.014f});
  room.Pop();
}

}  // namespace

void BuildShell(RoomBuilder& room, const RoomMaterials& m) {
  const int plaster = room.AddTexture(PaintPlaster(m.seed, Rgb(228, 224, 214)));
  const int accent = room.AddTexture(PaintPlaster(m.seed + 1, Rgb(158, 178, 182)));
  room.SetLightSpacing(0.075f);
  float shift = 0;
  for (const Wall wall : {Wall::kDesk, Wall::kRight, Wall::kBack, Wall::kLeft}) {
    const Paint paint{.texture = wall == Wall::kRight ? accent : plaster,
                      .origin = {shift, 0},
                      .tile_m = {kSide, kHeight}};
    PushWall(room, wall);
    room.Quad(paint, {0, kHeight, 0}, {kSide, 0, 0}, {0, -kHeight, 0});
    room.Pop();
    shift += 0.37f;
  }
  const Paint floor = RoomMaterials::Whole(room.AddTexture(PaintFloor(m.seed)));
  room.Quad(floor, {0, 0, 0}, {kSide, 0, 0}, {0, 0, kSide});
  const Paint ceiling{.texture = room.AddTexture(PaintCeiling(m.seed)), .tile_m = {1.2f, 1.2f}};
  room.Quad(ceiling, {0, kHeight, kSide}, {kSide, 0, 0}, {0, 0, -kSide});
  for (const Eigen::Vector2f& at : {Eigen::Vector2f(1.5f, 1.8f), Eigen::Vector2f(2.7f, 2.4f)}) {
    Paint glow = m.Plain(kPaper);
    glow.glow = 2.0f;
    room.Quad(glow, {at.x() - 0.29f, 2.485f, at.y() + 0.29f}, {0.58f, 0, 0}, {0, 0, -0.58f});
    const BoxPaint rim(m.Plain(kSteel));
    for (int k = 0; k < 2; ++k) {
      const float edge = k == 0 ? -0.31f : 0.29f;
      room.Box(rim, {at.x() + edge, 2.478f, at.y() - 0.31f}, {0.02f, 0.022f, 0.62f}, true);
      room.Box(rim, {at.x() - 0.31f, 2.478f, at.y() + edge}, {0.62f, 0.022f, 0.02f}, true);
    }
  }
  Window(room, m);
  Door(room, m);
  Skirting(room, m);
}

}  // namespace saccade
