#include "server/sim/room_parts.hpp"

namespace saccade {

void Hang(RoomBuilder& room, const RoomMaterials& m, const Paint& picture, float x, float y,
          float width, float height, float frame_m) {
  room.SetLightSpacing(0.09f);
  if (frame_m > 0) {
    const BoxPaint wood(m.Plain(kCharcoal));
    room.Box(wood, {x - frame_m, y - frame_m, 0}, {frame_m, height + 2 * frame_m, 0.022f}, true);
    room.Box(wood, {x + width, y - frame_m, 0}, {frame_m, height + 2 * frame_m, 0.022f}, true);
    room.Box(wood, {x, y + height, 0}, {width, frame_m, 0.022f}, true);
    room.Box(wood, {x, y - frame_m, 0}, {width, frame_m, 0.022f}, true);
  }
  room.Quad(picture, {x, y + height, 0.005f}, {width, 0, 0}, {0, -height, 0});
}

namespace {

/// Hangs a picture and names a point on it, given as a fraction from its lower left corner.
void HangNamed(RoomBuilder& room, const RoomMaterials& m, const cv::Mat& picture, const char* name,
               const Eigen::Vector2f& corner, const Eigen::Vector2f& size,
               const Eigen::Vector2f& named_at, float frame_m = 0) {
  const Paint paint = RoomMaterials::Whole(room.AddTexture(picture, false));
  Hang(room, m, paint, corner.x(), corner.y(), size.x(), size.y(), frame_m);
  room.Name(name,
            {corner.x() + named_at.x() * size.x(), corner.y() + named_at.y() * size.y(), 0.005f});
}

void Chessboard(RoomBuilder& room, const RoomMaterials& m) {
  BoxPaint board(m.Plain(kPaper));
  board.front = RoomMaterials::Whole(room.AddTexture(PaintChessboard(), false));
  room.SetLightSpacing(0.05f);
  room.Box(board, {1.76f, 0.94f, 0}, {0.48f, 0.36f, 0.008f}, true);
  room.Name("chessboard middle", {2.00f, 1.14f, 0.008f});
}

}  // namespace

void BuildPictures(RoomBuilder& room, const RoomMaterials& m) {
  PushWall(room, Wall::kDesk);
  Chessboard(room, m);
  HangNamed(room, m, PaintLandscape(m.seed), "landscape poster", {0.34f, 1.12f}, {0.5f, 0.7f},
            {0.5f, 0.14f}, 0.018f);
  HangNamed(room, m, PaintPegboard(m.seed), "pegboard", {2.34f, 0.98f}, {0.60f, 0.44f},
            {0.20f, 0.9f});
  HangNamed(room, m, PaintCork(m.seed), "cork board", {3.08f, 1.22f}, {0.64f, 0.48f}, {0.5f, 0.5f});
  room.Pop();

  PushWall(room, Wall::kRight);
  HangNamed(room, m, PaintBlueprint(m.seed), "blueprint", {0.22f, 1.42f}, {0.66f, 0.44f},
            {0.29f, 0.55f});
  HangNamed(room, m, PaintElements(m.seed), "parts chart", {1.08f, 1.28f}, {0.96f, 0.60f},
            {0.5f, 0.92f});
  HangNamed(room, m, PaintCityMap(m.seed), "city map", {2.24f, 1.22f}, {0.88f, 0.66f},
            {0.85f, 0.12f}, 0.02f);
  HangNamed(room, m, PaintSlogan(m.seed), "slogan poster", {3.32f, 1.16f}, {0.50f, 0.70f},
            {0.5f, 0.85f});
  room.Pop();

  PushWall(room, Wall::kBack);
  HangNamed(room, m, PaintClock(m.seed), "clock", {0.65f, 2.14f}, {0.26f, 0.26f}, {0.5f, 0.5f},
            0.008f);
  HangNamed(room, m, PaintWhiteboard(m.seed), "whiteboard", {1.66f, 0.98f}, {1.26f, 0.81f},
            {0.57f, 0.82f}, 0.016f);
  room.Box(BoxPaint(m.Plain(kSteel)), {1.86f, 0.952f, 0.02f}, {0.80f, 0.012f, 0.06f}, true);
  int k = 0;
  for (const PaletteCell ink : {kBlue, kRed, kGreen}) {
    const float x = 2.0f + 0.17f * static_cast<float>(k++);
    room.Box(BoxPaint(m.Plain(ink)), {x, 0.964f, 0.04f}, {0.13f, 0.016f, 0.016f});
  }
  HangNamed(room, m, PaintSafety(m.seed), "safety poster", {3.24f, 1.12f}, {0.50f, 0.70f},
            {0.5f, 0.93f});
  room.Pop();

  PushWall(room, Wall::kLeft);
  HangNamed(room, m, PaintShapes(m.seed), "exhibition poster", {0.02f, 1.10f}, {0.44f, 0.62f},
            {0.5f, 0.14f});
  HangNamed(room, m, PaintCalendar(m.seed), "calendar", {3.54f, 1.24f}, {0.34f, 0.49f},
            {0.5f, 0.49f});
  room.Pop();
}

}  // namespace saccade
