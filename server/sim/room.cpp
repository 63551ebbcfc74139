#include "server/sim/room.hpp"

#include <opencv2/imgproc.hpp>

#include "server/sim/light_bake.hpp"
#include "server/sim/room_builder.hpp"
#include "server/sim/wearer.hpp"

namespace saccade {

ChessboardTarget SimChessboard() {
  return {.columns = 9, .rows = 6, .square_m = 0.04, .hint_px = {}};
}

namespace {
cv::Mat Noise(cv::RNG& rng, int w, int h, cv::Scalar base, double sigma) {
  cv::Mat image(h, w, CV_8UC3, base);
  cv::Mat noise(h, w, CV_16SC3), sum;
  rng.fill(noise, cv::RNG::NORMAL, 0, sigma);
  cv::add(image, noise, sum, cv::noArray(), CV_8U);
  return sum;
}
cv::Mat Board() {
  cv::Mat image(720, 960, CV_8UC3, cv::Scalar(240, 242, 243));
  for (int j = 0; j < 7; ++j)
    for (int i = 0; i < 10; ++i)
      if ((i + j) % 2 == 0)
        image(cv::Rect(80 + 80 * i, 80 + 80 * j, 80, 80)) = cv::Scalar(25, 25, 25);
  return image;
}
}  // namespace

RoomScene BuildRoom(std::uint64_t seed) {
  cv::RNG rng(seed);
  const Rigid3 pose = WorldFromRoom();
  Eigen::Isometry3d iso = Eigen::Isometry3d::Identity();
  iso.translate(pose.translation);
  iso.rotate(pose.rotation);
  RoomBuilder room(iso);
  const Paint wall{.texture = room.AddTexture(Noise(rng, 512, 512, {205, 215, 220}, 14))};
  const Paint floor{.texture = room.AddTexture(Noise(rng, 512, 512, {90, 120, 150}, 25))};
  const Paint wood{.texture = room.AddTexture(Noise(rng, 512, 512, {80, 130, 180}, 30))};
  const Paint board{.texture = room.AddTexture(Board(), false)};
  room.SetLightSpacing(0.1f);
  room.Quad(wall, {0, 2.5f, 0}, {4, 0, 0}, {0, -2.5f, 0});
  room.Quad(wall, {4, 2.5f, 4}, {-4, 0, 0}, {0, -2.5f, 0});
  room.Quad(wall, {0, 2.5f, 4}, {0, 0, -4}, {0, -2.5f, 0});
  room.Quad(wall, {4, 2.5f, 0}, {0, 0, 4}, {0, -2.5f, 0});
  room.Quad(floor, {0, 0, 0}, {4, 0, 0}, {0, 0, 4});
  room.Quad(wall, {0, 2.5f, 4}, {4, 0, 0}, {0, 0, -4});
  room.SetLightSpacing(0.04f);
  room.Box(BoxPaint(wood), {1.1f, 0.71f, 0}, {1.8f, 0.03f, 0.75f}, true);
  BoxPaint chess(wall);
  chess.front = board;
  room.Box(chess, {1.76f, 0.94f, 0}, {0.48f, 0.36f, 0.008f}, true);
  room.Name("chessboard", {1.84f, 1.22f, 0.008f});
  RoomScene scene = room.Take();
  BakeLight({{.centre = {0.16f, 1.22f - 2.45f, -2},
              .half_u = {0.3f, 0, 0},
              .half_v = {0, 0, 0.3f},
              .normal = {0, 1, 0},
              .rgb = {18, 18, 17}}},
            2, scene);
  return scene;
}

}  // namespace saccade
