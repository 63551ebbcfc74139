#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "server/sim/paint.hpp"

namespace saccade {
namespace {

void Polygon(cv::Mat& image, const std::vector<cv::Point>& points, const cv::Scalar& color) {
  cv::fillPoly(image, std::vector<std::vector<cv::Point>>{points}, color, cv::LINE_AA);
}

/// A line drawn by hand.
void Stroke(cv::Mat& image, cv::RNG& rng, const cv::Point& from, const cv::Point& to,
            const cv::Scalar& ink) {
  cv::Point last = from;
  for (int k = 1; k <= 8; ++k) {
    const cv::Point next =
        from + (to - from) * (k / 8.0) + cv::Point(rng.uniform(-2, 3), rng.uniform(-2, 3));
    cv::line(image, last, next, ink, 3, cv::LINE_AA);
    last = next;
  }
}

/// A line of handwriting from `at`, `width` px long.
void Scribble(cv::Mat& image, cv::RNG& rng, cv::Point at, int width, int height,
              const cv::Scalar& ink) {
  cv::Point last = at;
  const int end = at.x + width;
  while (at.x < end) {
    at.x += rng.uniform(2, 6);
    const cv::Point next(at.x, at.y + rng.uniform(-height, height + 1));
    if (rng.uniform(0, 7) == 0) {
      at.x += height;
      last = {at.x, at.y};
      continue;
    }
    cv::line(image, last, next, ink, 2, cv::LINE_AA);
    last = next;
  }
}

/// A tool hung up at `at` (its top), about 160 px long, with its shadow.
void Tool(cv::Mat& image, const cv::Point& at, int kind, const cv::Scalar& grip) {
  const cv::Scalar steel = Rgb(172, 176, 182), dark = Rgb(70, 72, 78);
  const auto bar = [&](int x, int y, int w, int h, const cv::Scalar& color) {
    Fill(image, {at.x + x, at.y + y, w, h}, color);
    Fill(image, {at.x + x, at.y + y, std::max(1, w / 4), h}, Shade(color, 0.3));
  };
  switch (kind) {
    case 0:  // hammer
      DropShadow(image, {at.x - 34, at.y, 68, 24}, 10, 0.5);
      DropShadow(image, {at.x - 7, at.y + 20, 14, 150}, 10, 0.5);
      bar(-7, 20, 14, 150, grip);
      bar(-34, 0, 68, 24, dark);
      Polygon(image, {at + cv::Point(-34, 0), at + cv::Point(-52, 8), at + cv::Point(-34, 24)},
              steel);
      break;
    case 1:  // screwdriver
      DropShadow(image, {at.x - 11, at.y, 22, 74}, 10, 0.5);
      DropShadow(image, {at.x - 4, at.y + 74, 8, 90}, 8, 0.5);
      bar(-11, 0, 22, 74, grip);
      bar(-4, 74, 8, 90, steel);
      break;
    case 2:  // spanner
      DropShadow(image, {at.x - 10, at.y + 20, 20, 130}, 10, 0.5);
      bar(-9, 24, 18, 124, steel);
      cv::circle(image, at + cv::Point(0, 18), 25, steel, cv::FILLED, cv::LINE_AA);
      Fill(image, {at.x - 9, at.y - 10, 18, 24}, Rgb(206, 180, 138));
      cv::circle(image, at + cv::Point(0, 154), 21, steel, cv::FILLED, cv::LINE_AA);
      cv::circle(image, at + cv::Point(0, 154), 11, Rgb(150, 122, 86), cv::FILLED, cv::LINE_AA);
      break;
    case 3:  // pliers
      DropShadow(image, {at.x - 18, at.y, 36, 160}, 10, 0.45);
      Polygon(image,
              {at + cv::Point(-14, 0), at + cv::Point(14, 0), at + cv::Point(20, 56),
               at + cv::Point(-20, 56)},
              dark);
      cv::circle(image, at + cv::Point(0, 56), 10, steel, cv::FILLED, cv::LINE_AA);
      cv::line(image, at + cv::Point(-10, 62), at + cv::Point(-26, 158), grip, 13, cv::LINE_AA);
      cv::line(image, at + cv::Point(10, 62), at + cv::Point(26, 158), grip, 13, cv::LINE_AA);
      break;
    default:  // saw
      DropShadow(image, {at.x - 28, at.y + 50, 56, 150}, 10, 0.45);
      Polygon(image,
              {at + cv::Point(-26, 56), at + cv::Point(30, 56), at + cv::Point(14, 206),
               at + cv::Point(-8, 206)},
              steel);
      Polygon(image,
              {at + cv::Point(-34, 0), at + cv::Point(34, 0), at + cv::Point(38, 62),
               at + cv::Point(-34, 62)},
              grip);
      cv::ellipse(image, at + cv::Point(0, 30), {14, 18}, 0, 0, 360, Rgb(206, 180, 138), cv::FILLED,
                  cv::LINE_AA);
  }
}

}  // namespace

cv::Mat PaintWhiteboard(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "whiteboard");
  cv::Mat image(720, 1120, CV_8UC3, Rgb(240, 242, 243));
  Modulate(image, Cloud(rng, image.size(), {9, 6}), 0.02);
  const cv::Scalar blue = Rgb(34, 66, 150), red = Rgb(178, 40, 44), green = Rgb(36, 116, 66),
                   black = Rgb(40, 42, 46);
  Text(image, "Monday: pump test", {70, 70}, 34, blue, 3, true);
  for (int k = 0; k < 5; ++k) {
    Stroke(image, rng, {76, 130 + 48 * k}, {92, 130 + 48 * k}, red);
    Scribble(image, rng, {110, 132 + 48 * k}, rng.uniform(150, 330), 10, black);
  }
  const cv::Rect boxes[4] = {
      {560, 90, 150, 84}, {840, 90, 170, 84}, {560, 290, 150, 84}, {840, 290, 170, 84}};
  static const char* const kNames[4] = {"inlet", "valve", "sensor", "motor"};
  for (int k = 0; k < 4; ++k) {
    const cv::Rect& b = boxes[k];
    Stroke(image, rng, b.tl(), {b.x + b.width, b.y}, blue);
    Stroke(image, rng, {b.x + b.width, b.y}, b.br(), blue);
    Stroke(image, rng, b.br(), {b.x, b.y + b.height}, blue);
    Stroke(image, rng, {b.x, b.y + b.height}, b.tl(), blue);
    Text(image, kNames[k], {b.x + b.width / 2, b.y + 42}, 24, green, 2);
  }
  Stroke(image, rng, {710, 132}, {838, 132}, red);
  Stroke(image, rng, {924, 174}, {924, 288}, red);
  Stroke(image, rng, {840, 332}, {712, 332}, red);
  Stroke(image, rng, {820, 120}, {838, 132}, red);
  Stroke(image, rng, {820, 144}, {838, 132}, red);
  Stroke(image, rng, {110, 660}, {520, 660}, black);
  Stroke(image, rng, {110, 660}, {110, 430}, black);
  cv::Point last(110, 640);
  for (int x = 0; x < 400; x += 8) {
    const cv::Point next(112 + x, 640 - static_cast<int>(190 * (1 - std::exp(-x / 110.0)) +
                                                         12 * std::sin(x * 0.11)));
    cv::line(image, last, next, red, 3, cv::LINE_AA);
    last = next;
  }
  Text(image, "p = 2.4 bar", {620, 480}, 30, black, 2, true);
  Text(image, "Q = 14 l/min", {620, 540}, 30, black, 2, true);
  Scribble(image, rng, {620, 610}, 380, 14, green);
  Scribble(image, rng, {620, 660}, 260, 14, green);
  return image;
}

cv::Mat PaintCork(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "cork");
  cv::Mat image(480, 640, CV_8UC3, Rgb(176, 132, 86));
  Grain(image, rng, 16.0, 3);
  Grain(image, rng, 10.0, 1);
  const cv::Scalar papers[6] = {Rgb(248, 240, 150), Rgb(246, 246, 240), Rgb(250, 190, 196),
                                Rgb(176, 222, 240), Rgb(196, 236, 170), Rgb(246, 246, 240)};
  for (int k = 0; k < 11; ++k) {
    const int w = rng.uniform(84, 150), h = rng.uniform(80, 150);
    const cv::Rect note = cv::Rect(24 + 150 * (k % 4) + rng.uniform(-10, 16),
                                   20 + 150 * (k / 4) + rng.uniform(-8, 16), w, h) &
                          cv::Rect(8, 8, 622, 462);
    DropShadow(image, note, 8, 0.5);
    Fill(image, note, papers[rng.uniform(0, 6)]);
    Lines(image, rng, {note.x + 10, note.y + 22, note.width - 20, note.height - 34},
          rng.uniform(5, 9), Rgb(60, 60, 80));
    cv::circle(image, {note.x + note.width / 2, note.y + 8}, 6,
               k % 2 ? Rgb(200, 36, 36) : Rgb(36, 90, 190), cv::FILLED, cv::LINE_AA);
    cv::circle(image, {note.x + note.width / 2 - 2, note.y + 6}, 2, Rgb(255, 255, 255), cv::FILLED,
               cv::LINE_AA);
  }
  DrawFrame(image, {4, 4, 631, 471}, Rgb(120, 84, 52), 12);
  return image;
}

cv::Mat PaintPegboard(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "pegboard");
  cv::Mat image(640, 880, CV_8UC3, Rgb(206, 180, 138));
  Modulate(image, Cloud(rng, image.size(), {14, 10}), 0.05);
  for (int y = 20; y < 640; y += 32) {
    for (int x = 20; x < 880; x += 32)
      cv::circle(image, {x, y}, 4, Rgb(88, 66, 44), cv::FILLED, cv::LINE_AA);
  }
  const cv::Scalar grips[6] = {Rgb(196, 40, 36), Rgb(224, 160, 30), Rgb(30, 90, 170),
                               Rgb(40, 130, 70), Rgb(60, 60, 66),   Rgb(150, 96, 56)};
  const int upper[7] = {0, 1, 1, 2, 3, 1, 4}, lower[7] = {3, 2, 1, 0, 4, 2, 1};
  for (int k = 0; k < 7; ++k) {
    Tool(image, {78 + 120 * k + rng.uniform(-8, 9), 50 + rng.uniform(0, 24)}, upper[k],
         grips[rng.uniform(0, 6)]);
    Tool(image, {78 + 120 * k + rng.uniform(-8, 9), 350 + rng.uniform(0, 24)}, lower[k],
         grips[rng.uniform(0, 6)]);
  }
  DrawFrame(image, {2, 2, 875, 635}, Rgb(120, 92, 58), 8);
  return image;
}

cv::Mat PaintClock(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "clock");
  cv::Mat image(256, 256, CV_8UC3, Rgb(30, 30, 32));
  cv::circle(image, {128, 128}, 116, Rgb(246, 246, 242), cv::FILLED, cv::LINE_AA);
  for (int k = 0; k < 60; ++k) {
    const double a = k * CV_PI / 30;
    const double inner = k % 5 ? 106 : 96;
    cv::line(
        image,
        {128 + static_cast<int>(inner * std::sin(a)), 128 - static_cast<int>(inner * std::cos(a))},
        {128 + static_cast<int>(112 * std::sin(a)), 128 - static_cast<int>(112 * std::cos(a))},
        Rgb(20, 20, 20), k % 5 ? 1 : 4, cv::LINE_AA);
    if (k % 5 == 0)
      Text(image, std::to_string(k == 0 ? 12 : k / 5),
           {128 + static_cast<int>(80 * std::sin(a)), 128 - static_cast<int>(80 * std::cos(a))}, 17,
           Rgb(20, 20, 20), 2);
  }
  const double hour = rng.uniform(0.0, 6.28);
  cv::line(
      image, {128, 128},
      {128 + static_cast<int>(52 * std::sin(hour)), 128 - static_cast<int>(52 * std::cos(hour))},
      Rgb(20, 20, 20), 7, cv::LINE_AA);
  cv::line(image, {128, 128},
           {128 + static_cast<int>(78 * std::sin(12 * hour)),
            128 - static_cast<int>(78 * std::cos(12 * hour))},
           Rgb(20, 20, 20), 4, cv::LINE_AA);
  cv::circle(image, {128, 128}, 7, Rgb(190, 30, 30), cv::FILLED, cv::LINE_AA);
  return image;
}

}  // namespace saccade
