#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "server/sim/paint.hpp"

namespace saccade {
namespace {

constexpr int kWidth = 600, kHeight = 840;  // posters of 50 x 70 cm

cv::Mat Sheet(const cv::Scalar& color) { return {kHeight, kWidth, CV_8UC3, color}; }

void PrintPolygon(cv::Mat& image, const std::vector<cv::Point>& points, const cv::Scalar& color) {
  cv::fillPoly(image, std::vector<std::vector<cv::Point>>{points}, color, cv::LINE_AA);
}

/// Warning sign `kind` in a box with its corner at `at`, 150 px wide.
void Pictogram(cv::Mat& image, const cv::Point& at, int kind) {
  const cv::Point c = at + cv::Point(75, 70);
  const cv::Scalar ink = Rgb(20, 20, 20), white = Rgb(245, 245, 245), blue = Rgb(28, 84, 160);
  if (kind % 3 == 0) {
    PrintPolygon(image, {c + cv::Point(0, -64), c + cv::Point(70, 56), c + cv::Point(-70, 56)},
                 ink);
    PrintPolygon(image, {c + cv::Point(0, -46), c + cv::Point(55, 47), c + cv::Point(-55, 47)},
                 Rgb(244, 200, 30));
  } else {
    cv::circle(image, c, 64, kind % 3 == 1 ? blue : Rgb(190, 30, 34), cv::FILLED, cv::LINE_AA);
    if (kind % 3 == 2) cv::circle(image, c, 50, white, cv::FILLED, cv::LINE_AA);
  }
  const cv::Scalar mark = kind % 3 == 1 ? white : ink;
  switch (kind) {
    case 0:  // lightning
      PrintPolygon(image,
                   {c + cv::Point(6, -30), c + cv::Point(-14, 14), c + cv::Point(0, 12),
                    c + cv::Point(-8, 40), c + cv::Point(16, 2), c + cv::Point(2, 4)},
                   mark);
      break;
    case 1:  // goggles
      cv::circle(image, c + cv::Point(-22, 0), 18, mark, 7, cv::LINE_AA);
      cv::circle(image, c + cv::Point(22, 0), 18, mark, 7, cv::LINE_AA);
      break;
    case 2:  // no open flame
      cv::ellipse(image, c, {12, 30}, 0, 0, 360, mark, cv::FILLED, cv::LINE_AA);
      cv::line(image, c + cv::Point(-40, -40), c + cv::Point(40, 40), Rgb(190, 30, 34), 12,
               cv::LINE_AA);
      break;
    case 3:  // hot surface
      for (int k = -1; k <= 1; ++k)
        cv::ellipse(image, c + cv::Point(18 * k, 14), {6, 22}, 0, 90, 270, mark, 5, cv::LINE_AA);
      cv::line(image, c + cv::Point(-34, 40), c + cv::Point(34, 40), mark, 6);
      break;
    case 4:  // gloves
      Fill(image, {c.x - 18, c.y - 6, 36, 42}, mark);
      for (int k = 0; k < 4; ++k) Fill(image, {c.x - 18 + 10 * k, c.y - 36, 7, 34}, mark);
      break;
    default:  // no hand
      cv::circle(image, c, 20, mark, cv::FILLED, cv::LINE_AA);
      cv::line(image, c + cv::Point(-40, 40), c + cv::Point(40, -40), Rgb(190, 30, 34), 12,
               cv::LINE_AA);
  }
}

}  // namespace

cv::Mat PaintChessboard() {
  cv::Mat image(720, 960, CV_8UC3, Rgb(242, 242, 240));  // 480 x 360 mm, squares of 80 px
  for (int j = 0; j < 7; ++j) {
    for (int i = 0; i < 10; ++i) {
      if ((i + j) % 2 == 0) Fill(image, {80 + 80 * i, 80 + 80 * j, 80, 80}, Rgb(26, 26, 27));
    }
  }
  Text(image, "9 x 6 / 40 mm", {86, 680}, 14, Rgb(90, 90, 92), 1, true);
  return image;
}

cv::Mat PaintLandscape(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "landscape");
  cv::Mat image = Sheet(Rgb(236, 228, 206));
  const cv::Rect view(30, 30, 540, 640);
  for (int y = 0; y < view.height; ++y) {
    const double t = static_cast<double>(y) / view.height;
    cv::line(image, {view.x, view.y + y}, {view.x + view.width, view.y + y},
             Rgb(90 + 160 * t, 140 + 70 * t, 190 - 40 * t));
  }
  const cv::Point sun(rng.uniform(120, 480), rng.uniform(120, 230));
  cv::circle(image, sun, 62, Rgb(252, 216, 120), cv::FILLED, cv::LINE_AA);
  cv::circle(image, sun, 46, Rgb(255, 240, 190), cv::FILLED, cv::LINE_AA);
  for (int range = 0; range < 4; ++range) {
    const double base = 300 + 80 * range;
    std::vector<cv::Point> ridge = {{view.x, 670}};
    const double phase = rng.uniform(0.0, 6.0);
    for (int x = 0; x <= view.width; x += 6) {
      const double h = 60 * std::sin(x * 0.011 + phase) + 34 * std::sin(x * 0.031 + 2 * phase) +
                       rng.uniform(-7.0, 7.0) - 40 + 18 * range;
      ridge.emplace_back(view.x + x, std::min(668, static_cast<int>(base + h)));
    }
    ridge.emplace_back(view.x + view.width, 670);
    PrintPolygon(image, ridge, Shade(Rgb(44, 74, 98), 0.5 - 0.2 * range));
    if (range == 1) {
      for (std::size_t k = 2; k + 2 < ridge.size(); k += 2) {
        if (ridge[k].y < 330)
          cv::line(image, ridge[k], ridge[k] + cv::Point(rng.uniform(-8, 9), rng.uniform(10, 40)),
                   Rgb(238, 242, 246), 4, cv::LINE_AA);
      }
    }
  }
  for (int k = 0; k < 46; ++k) {  // firs
    const cv::Point foot(rng.uniform(44, 556), rng.uniform(590, 668));
    const int h = rng.uniform(30, 70);
    PrintPolygon(image,
                 {foot + cv::Point(0, -h), foot + cv::Point(h / 4, 0), foot + cv::Point(-h / 4, 0)},
                 Shade(Rgb(26, 52, 40), rng.uniform(-0.2, 0.2)));
  }
  Fill(image, {0, 671, kWidth, 169}, Rgb(236, 228, 206));
  Text(image, "ALPINE TRAILS", {300, 722}, 44, Rgb(44, 62, 80), 3);
  Text(image, "summer walks from hut to hut", {300, 775}, 19, Rgb(150, 80, 50), 1);
  return image;
}

cv::Mat PaintSafety(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "safety");
  cv::Mat image = Sheet(Rgb(246, 244, 236));
  Fill(image, {0, 0, kWidth, 150}, Rgb(244, 198, 28));
  for (int x = -40; x < kWidth; x += 60) {
    PrintPolygon(image, {{x, 150}, {x + 30, 150}, {x + 54, 174}, {x + 24, 174}}, Rgb(24, 24, 24));
  }
  Text(image, "WORK SAFE", {300, 58}, 52, Rgb(24, 24, 24), 4);
  Text(image, "in this workshop", {300, 116}, 26, Rgb(24, 24, 24), 2);
  static const char* const kWords[6] = {"Live parts",  "Wear goggles", "No flames",
                                        "Hot surface", "Wear gloves",  "Keep off"};
  for (int k = 0; k < 6; ++k) {
    const cv::Point at(40 + 180 * (k % 3), 200 + 290 * (k / 3));
    Pictogram(image, at, k);
    Text(image, kWords[k], at + cv::Point(75, 164), 18, Rgb(30, 30, 34), 2);
    Lines(image, rng, {at.x + 4, at.y + 188, 146, 80}, 7, Rgb(92, 92, 96));
  }
  Fill(image, {0, 770, kWidth, 70}, Rgb(30, 120, 66));
  Text(image, "FIRST AID: ROOM 3.02  TEL 112", {300, 805}, 21, Rgb(246, 246, 246), 2);
  return image;
}

cv::Mat PaintElements(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "elements");
  cv::Mat image(600, 960, CV_8UC3, Rgb(30, 34, 44));
  Text(image, "RESISTORS, CAPACITORS, DIODES", {480, 46}, 30, Rgb(236, 230, 210), 2);
  const cv::Scalar tones[6] = {Rgb(196, 74, 60),  Rgb(220, 154, 58), Rgb(84, 150, 96),
                               Rgb(66, 124, 178), Rgb(140, 96, 160), Rgb(188, 186, 178)};
  for (int j = 0; j < 6; ++j) {
    for (int i = 0; i < 14; ++i) {
      if ((j == 0 && i > 1 && i < 11) || (j == 1 && i > 2 && i < 9)) continue;
      const cv::Rect cell(24 + 65 * i, 90 + 78 * j, 60, 72);
      Fill(image, cell, Shade(tones[(i / 3 + j) % 6], rng.uniform(-0.15, 0.15)));
      const std::string name = {static_cast<char>('A' + rng.uniform(0, 26)),
                                static_cast<char>('a' + rng.uniform(0, 26))};
      Text(image, name, {cell.x + 30, cell.y + 32}, 24, Rgb(20, 22, 26), 2);
      Text(image, std::to_string(j * 14 + i + 1), {cell.x + 5, cell.y + 10}, 9, Rgb(20, 22, 26), 1,
           true);
      Lines(image, rng, {cell.x + 8, cell.y + 54, 44, 14}, 4, Rgb(30, 32, 38));
    }
  }
  Lines(image, rng, {240, 96, 440, 60}, 8, Rgb(190, 186, 172));
  return image;
}

cv::Mat PaintCityMap(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "map");
  cv::Mat image(720, 960, CV_8UC3, Rgb(234, 228, 212));
  for (int j = 0; j < 16; ++j) {  // blocks between crooked streets
    for (int i = 0; i < 22; ++i) {
      const cv::Rect block(10 + 43 * i + rng.uniform(0, 8), 10 + 44 * j + rng.uniform(0, 8),
                           rng.uniform(24, 36), rng.uniform(24, 36));
      const int kind = rng.uniform(0, 12);
      Fill(image, block,
           kind == 0   ? Rgb(164, 196, 132)
           : kind == 1 ? Rgb(224, 170, 140)
                       : Shade(Rgb(206, 196, 178), rng.uniform(-0.12, 0.1)));
      if (kind > 8) DrawFrame(image, block, Rgb(150, 140, 124), 1);
    }
  }
  std::vector<cv::Point> river;
  const double phase = rng.uniform(0.0, 6.0);
  for (int x = -20; x < 1000; x += 10)
    river.emplace_back(x, 380 + static_cast<int>(120 * std::sin(x * 0.006 + phase)));
  cv::polylines(image, river, false, Rgb(122, 170, 206), 44, cv::LINE_AA);
  cv::polylines(image, river, false, Rgb(150, 192, 222), 32, cv::LINE_AA);
  for (int k = 0; k < 7; ++k) {
    cv::line(image, {rng.uniform(0, 960), 0}, {rng.uniform(0, 960), 720},
             k < 4 ? Rgb(250, 246, 236) : Rgb(232, 176, 74), k < 4 ? 9 : 7, cv::LINE_AA);
    cv::line(image, {0, rng.uniform(0, 720)}, {960, rng.uniform(0, 720)}, Rgb(250, 246, 236), 8,
             cv::LINE_AA);
  }
  static const char* const kPlaces[8] = {"Harbour", "Old Town",   "Mill Lane", "Station",
                                         "Park",    "North Gate", "Market",    "Docks"};
  for (int k = 0; k < 8; ++k)
    Text(image, kPlaces[k], {110 + 240 * (k % 4), 120 + 400 * (k / 4) + rng.uniform(-50, 50)}, 20,
         Rgb(60, 50, 46), 2);
  Fill(image, {690, 590, 250, 110}, Rgb(246, 242, 232));
  DrawFrame(image, {690, 590, 250, 110}, Rgb(60, 50, 46), 2);
  Text(image, "CITY MAP", {815, 622}, 28, Rgb(60, 50, 46), 2);
  Lines(image, rng, {710, 650, 210, 40}, 7, Rgb(120, 110, 100));
  DrawFrame(image, {4, 4, 952, 712}, Rgb(60, 50, 46), 6);
  return image;
}

cv::Mat PaintShapes(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "shapes");
  cv::Mat image = Sheet(Rgb(238, 226, 200));
  const cv::Scalar tones[5] = {Rgb(196, 58, 42), Rgb(30, 78, 126), Rgb(230, 172, 46),
                               Rgb(34, 34, 36), Rgb(92, 138, 124)};
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 3; ++i) {
      const cv::Rect cell(30 + 182 * i, 30 + 164 * j, 176, 158);
      const cv::Scalar back = tones[rng.uniform(0, 5)], front = tones[rng.uniform(0, 5)];
      Fill(image, cell, Shade(back, 0.45));
      const cv::Point c(cell.x + 88, cell.y + 79);
      switch (rng.uniform(0, 4)) {
        case 0:
          cv::circle(image, c, 66, front, cv::FILLED, cv::LINE_AA);
          cv::circle(image, c, 30, Shade(back, 0.2), cv::FILLED, cv::LINE_AA);
          break;
        case 1:
          cv::ellipse(image, {cell.x, cell.y + 158}, {150, 150}, 0, 270, 360, front, cv::FILLED,
                      cv::LINE_AA);
          break;
        case 2:
          PrintPolygon(
              image,
              {{cell.x, cell.y + 158}, {cell.x + 176, cell.y + 158}, {cell.x + 88, cell.y + 8}},
              front);
          break;
        default:
          for (int k = 0; k < 5; ++k)
            Fill(image, {cell.x + 14 + 32 * k, cell.y + 12, 16, 134}, front);
      }
    }
  }
  Text(image, "FORM  &  FUNCTION", {300, 726}, 36, tones[3], 3);
  Text(image, "exhibition of industrial design", {300, 778}, 18, tones[0], 1);
  return image;
}

cv::Mat PaintBlueprint(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "blueprint");
  cv::Mat image(600, 900, CV_8UC3, Rgb(28, 66, 124));
  const cv::Scalar ink = Rgb(222, 232, 244), faint = Rgb(60, 98, 154);
  for (int k = 0; k < 900; k += 30) cv::line(image, {k, 0}, {k, 600}, faint, 1);
  for (int k = 0; k < 600; k += 30) cv::line(image, {0, k}, {900, k}, faint, 1);
  DrawFrame(image, {20, 20, 860, 560}, ink, 3);
  cv::circle(image, {260, 270}, 150, ink, 3, cv::LINE_AA);
  cv::circle(image, {260, 270}, 96, ink, 2, cv::LINE_AA);
  cv::circle(image, {260, 270}, 34, ink, 3, cv::LINE_AA);
  for (int k = 0; k < 8; ++k) {
    const double a = k * CV_PI / 4 + 0.2;
    cv::circle(
        image,
        {260 + static_cast<int>(123 * std::cos(a)), 270 + static_cast<int>(123 * std::sin(a))}, 12,
        ink, 2, cv::LINE_AA);
  }
  cv::line(image, {70, 270}, {450, 270}, ink, 1, cv::LINE_AA);
  cv::line(image, {260, 80}, {260, 460}, ink, 1, cv::LINE_AA);
  const std::vector<cv::Point> shaft = {{500, 220}, {560, 220}, {560, 170}, {640, 170},
                                        {640, 230}, {790, 230}, {790, 310}, {640, 310},
                                        {640, 370}, {560, 370}, {560, 320}, {500, 320}};
  cv::polylines(image, shaft, true, ink, 3, cv::LINE_AA);
  for (int x = 506; x < 640; x += 12)
    cv::line(image, {x, 318}, {x + 20, 222}, faint, 2, cv::LINE_AA);
  cv::line(image, {500, 420}, {790, 420}, ink, 1, cv::LINE_AA);
  Text(image, "118.5", {645, 408}, 16, ink, 1);
  Text(image, "R 75", {400, 150}, 16, ink, 1);
  Fill(image, {560, 470, 320, 110}, Rgb(34, 76, 138));
  DrawFrame(image, {560, 470, 320, 110}, ink, 2);
  Text(image, "DRIVE HUB  4-17", {720, 498}, 22, ink, 2);
  Lines(image, rng, {580, 525, 280, 46}, 7, ink);
  return image;
}

cv::Mat PaintCalendar(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "calendar");
  cv::Mat image(720, 500, CV_8UC3, Rgb(248, 247, 242));
  cv::Mat photo;
  cv::resize(PaintLandscape(seed + 11)(cv::Rect(30, 60, 540, 420)), photo, {500, 330}, 0, 0,
             cv::INTER_AREA);
  photo.copyTo(image(cv::Rect(0, 0, 500, 330)));
  Text(image, "NOVEMBER", {250, 366}, 32, Rgb(170, 40, 40), 3);
  for (int day = 0; day < 30; ++day) {
    const int slot = day + 2;
    const cv::Point at(52 + 66 * (slot % 7), 424 + 56 * (slot / 7));
    Text(image, std::to_string(day + 1), at, 19, slot % 7 > 4 ? Rgb(190, 40, 40) : Rgb(30, 30, 34),
         2);
    if (rng.uniform(0, 6) == 0) cv::circle(image, at, 24, Rgb(30, 80, 170), 3, cv::LINE_AA);
    if (rng.uniform(0, 7) == 0)
      Lines(image, rng, {at.x - 24, at.y + 14, 50, 14}, 5, Rgb(60, 110, 70));
  }
  return image;
}

cv::Mat PaintSlogan(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "slogan");
  const cv::Scalar paper = rng.uniform(0, 2) ? Rgb(198, 58, 40) : Rgb(30, 92, 108);
  cv::Mat image = Sheet(paper);
  const cv::Scalar ink = Rgb(246, 236, 214);
  Text(image, "MEASURE", {300, 130}, 82, ink, 7);
  Text(image, "TWICE", {300, 260}, 104, ink, 9);
  Text(image, "CUT", {300, 560}, 120, ink, 10);
  Text(image, "ONCE", {300, 710}, 108, ink, 9);
  for (int x = 40; x <= 560; x += 13) {  // a ruler
    cv::line(image, {x, 380}, {x, 380 + (x % 65 == 40 ? 60 : 30)}, ink, 3, cv::LINE_AA);
  }
  DrawFrame(image, {34, 372, 534, 90}, ink, 5);
  Lines(image, rng, {180, 785, 240, 20}, 8, ink);
  return image;
}

}  // namespace saccade
