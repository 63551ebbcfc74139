#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "server/sim/paint.hpp"

namespace saccade {

cv::Mat PaintPlaster(std::uint64_t seed, const cv::Scalar& base) {
  cv::RNG rng = RngFor(seed, "plaster");
  cv::Mat image(640, 1024, CV_8UC3, base);
  Modulate(image, Cloud(rng, image.size(), {5, 4}), 0.025);
  Modulate(image, Cloud(rng, image.size(), {40, 25}), 0.018);
  Grain(image, rng, 3.0, 2);
  Grain(image, rng, 1.5, 1);
  for (int k = 0; k < 26; ++k) {  // knocks, filled holes, scuffs low down
    const cv::Point at(rng.uniform(0, 1024),
                       640 - static_cast<int>(std::pow(rng.uniform(0.0, 1.0), 2) * 630));
    const cv::Scalar tone = Shade(base, rng.uniform(0, 2) ? -0.16 : 0.35);
    if (k % 3 == 0) {
      cv::line(image, at, at + cv::Point(rng.uniform(-14, 15), rng.uniform(-4, 5)), tone, 1,
               cv::LINE_AA);
    } else {
      cv::ellipse(image, at, {rng.uniform(1, 3), rng.uniform(1, 3)}, 0, 0, 360, tone, cv::FILLED,
                  cv::LINE_AA);
    }
  }
  return image;
}

cv::Mat PaintFloor(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "floor");
  const int side = 1536, rows = 32, height = side / rows;  // 4 m: planks 12.5 cm wide
  cv::Mat image(side, side, CV_8UC3);
  for (int row = 0; row < rows; ++row) {
    for (int x = -rng.uniform(0, 400); x < side;) {
      const int length = rng.uniform(300, 520);
      const cv::Rect plank = cv::Rect(x, row * height, length, height) & cv::Rect(0, 0, side, side);
      x += length;
      if (plank.empty()) continue;
      const cv::Scalar base = Shade(Rgb(168, 122, 80), rng.uniform(-0.20, 0.10));
      cv::Mat wood = Wood(rng, {length, height}, base);
      wood(cv::Rect(0, 0, plank.width, plank.height)).copyTo(image(plank));
      DrawFrame(image, plank, Rgb(88, 60, 38), 1);
    }
  }
  return image;
}

cv::Mat PaintCeiling(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "ceiling");
  cv::Mat image(512, 512, CV_8UC3, Rgb(226, 226, 222));  // 1.2 m: tiles of 60 cm
  Grain(image, rng, 3.0, 2);
  for (int k = 0; k < 900; ++k) {
    cv::circle(image, {rng.uniform(0, 512), rng.uniform(0, 512)}, rng.uniform(0, 2),
               Rgb(176, 176, 172), cv::FILLED, cv::LINE_AA);
  }
  for (int k = 0; k < 2; ++k) {
    Fill(image, {k * 256, 0, 5, 512}, Rgb(245, 245, 245));
    Fill(image, {0, k * 256, 512, 5}, Rgb(245, 245, 245));
    Fill(image, {k * 256 + 5, 0, 2, 512}, Rgb(150, 150, 150));
    Fill(image, {0, k * 256 + 5, 512, 2}, Rgb(150, 150, 150));
  }
  return image;
}

cv::Mat PaintRug(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "rug");
  const cv::Size size(768, 512);
  const cv::Scalar deep = rng.uniform(0, 2) ? Rgb(112, 34, 38) : Rgb(36, 58, 92);
  const cv::Scalar cream = Rgb(206, 188, 152), ochre = Rgb(178, 128, 62);
  cv::Mat image(size, CV_8UC3, deep);
  DrawFrame(image, {10, 10, 748, 492}, cream, 8);
  DrawFrame(image, {34, 34, 700, 444}, ochre, 5);
  DrawFrame(image, {78, 78, 612, 356}, cream, 4);
  for (int x = 56; x < 740; x += 34) {
    for (const int y : {56, 456}) {
      cv::ellipse(image, {x, y}, {9, 6}, 45, 0, 360, x % 68 < 34 ? cream : ochre, cv::FILLED,
                  cv::LINE_AA);
    }
  }
  for (int y = 90; y < 440; y += 34) {
    for (const int x : {56, 712}) {
      cv::ellipse(image, {x, y}, {6, 9}, 45, 0, 360, y % 68 < 34 ? cream : ochre, cv::FILLED,
                  cv::LINE_AA);
    }
  }
  for (int k = 0; k < 3; ++k) {  // medallions
    const cv::Point centre(184 + 200 * k, 256);
    for (int ring = 0; ring < 4; ++ring) {
      const cv::Scalar tone = ring % 2 ? deep : (ring == 2 ? ochre : cream);
      std::vector<cv::Point> star;
      for (int i = 0; i < 16; ++i) {
        const double radius = (i % 2 ? 0.72 : 1.0) * (88 - 22 * ring);
        star.emplace_back(centre.x + static_cast<int>(radius * std::cos(i * CV_PI / 8)),
                          centre.y + static_cast<int>(1.35 * radius * std::sin(i * CV_PI / 8)));
      }
      cv::fillPoly(image, std::vector<std::vector<cv::Point>>{star}, tone, cv::LINE_AA);
    }
  }
  Modulate(image, Cloud(rng, size, {12, 8}), 0.10);
  Grain(image, rng, 9.0, 2);
  return image;
}

cv::Mat PaintDeskTop(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "desk");
  const cv::Size size(1536, 640);
  cv::Mat image(size, CV_8UC3);
  for (int k = 0; k < 5; ++k) {  // glued staves
    Wood(rng, {size.width, 128}, Shade(Rgb(190, 146, 98), rng.uniform(-0.10, 0.08)))
        .copyTo(image(cv::Rect(0, k * 128, size.width, 128)));
  }
  for (int k = 0; k < 9; ++k) {  // knots
    const cv::Point at(rng.uniform(0, size.width), rng.uniform(0, size.height));
    const int radius = rng.uniform(4, 10);
    for (int r = radius; r > 0; r -= 2) {
      cv::ellipse(image, at, {2 * r, r}, 0, 0, 360, Shade(Rgb(120, 80, 45), 0.06 * r), 2,
                  cv::LINE_AA);
    }
  }
  for (int k = 0; k < 3; ++k) {  // rings left by mugs
    cv::circle(image, {rng.uniform(200, 1300), rng.uniform(150, 560)}, 36, Rgb(150, 108, 68), 3,
               cv::LINE_AA);
  }
  for (int k = 0; k < 34; ++k) {  // scratches and specks of paint
    const cv::Point at(rng.uniform(0, size.width), rng.uniform(0, size.height));
    cv::line(image, at, at + cv::Point(rng.uniform(-60, 61), rng.uniform(-25, 26)),
             Shade(Rgb(190, 146, 98), rng.uniform(0, 2) ? 0.3 : -0.3), 1, cv::LINE_AA);
  }
  Grain(image, rng, 2.5, 1);
  return image;
}

cv::Mat PaintFurnitureWood(std::uint64_t seed, const cv::Scalar& base) {
  cv::RNG rng = RngFor(seed, "furniture");
  cv::Mat image = Wood(rng, {512, 512}, base);
  Grain(image, rng, 2.0, 1);
  return image;
}

cv::Mat PaintPalette(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "palette");
  const cv::Scalar colors[kPaletteCells] = {
      Rgb(28, 28, 30),    Rgb(58, 60, 64),    Rgb(120, 122, 126), Rgb(178, 180, 182),
      Rgb(232, 232, 230), Rgb(222, 212, 190), Rgb(150, 156, 164), Rgb(176, 146, 84),
      Rgb(186, 44, 40),   Rgb(112, 30, 32),   Rgb(218, 112, 34),  Rgb(224, 184, 48),
      Rgb(72, 140, 66),   Rgb(34, 78, 46),    Rgb(36, 124, 128),  Rgb(44, 96, 168),
      Rgb(28, 42, 82),    Rgb(98, 62, 122),   Rgb(98, 68, 46),    Rgb(176, 94, 62),
      Rgb(52, 40, 32),    Rgb(240, 238, 230), Rgb(220, 150, 160), Rgb(150, 190, 220)};
  cv::Mat image(512, 512, CV_8UC3, Rgb(128, 128, 128));
  for (int k = 0; k < kPaletteCells; ++k) Fill(image, {k % 8 * 64, k / 8 * 64, 64, 64}, colors[k]);
  Grain(image, rng, 4.0, 2);
  Grain(image, rng, 2.0, 1);
  return image;
}

cv::Mat PaintDoor(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "door");
  cv::Mat image = Wood(rng, {1024, 448}, Rgb(176, 150, 116));
  cv::rotate(image, image, cv::ROTATE_90_CLOCKWISE);  // 448 x 1024, grain upright
  for (const cv::Rect& panel : {cv::Rect(60, 70, 140, 360), cv::Rect(248, 70, 140, 360),
                                cv::Rect(60, 520, 140, 420), cv::Rect(248, 520, 140, 420)}) {
    DrawFrame(image, panel, Rgb(104, 84, 60), 4);
    DrawFrame(image, {panel.x + 14, panel.y + 14, panel.width - 28, panel.height - 28},
              Rgb(206, 182, 148), 3);
    DrawFrame(image, {panel.x + 18, panel.y + 18, panel.width - 36, panel.height - 36},
              Rgb(120, 98, 72), 2);
  }
  Fill(image, {150, 462, 148, 34}, Rgb(232, 230, 222));
  DrawFrame(image, {150, 462, 148, 34}, Rgb(90, 90, 90), 1);
  Text(image, "ROOM 3.07", {224, 479}, 14, Rgb(40, 40, 44));
  return image;
}

cv::Mat PaintOutside(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "outside");
  const cv::Size size(768, 640);
  cv::Mat image(size, CV_8UC3);
  for (int y = 0; y < size.height; ++y) {
    const double t = static_cast<double>(y) / size.height;
    cv::line(image, {0, y}, {size.width, y}, Rgb(150 + 80 * t, 190 + 45 * t, 235 + 10 * t));
  }
  for (int k = 0; k < 40; ++k) {  // clouds
    cv::Mat soft = image.clone();
    cv::ellipse(soft, {rng.uniform(0, 768), rng.uniform(20, 240)},
                {rng.uniform(30, 90), rng.uniform(8, 26)}, 0, 0, 360, Rgb(250, 250, 252),
                cv::FILLED, cv::LINE_AA);
    cv::addWeighted(image, 0.75, soft, 0.25, 0, image);
  }
  for (int x = 0; x < size.width;) {  // houses across the street
    const int width = rng.uniform(70, 140), top = rng.uniform(270, 400);
    const cv::Scalar wall = Shade(Rgb(186, 150, 122), rng.uniform(-0.3, 0.3));
    Fill(image, {x, top, width, 640 - top}, wall);
    const std::vector<cv::Point> roof = {
        {x - 6, top}, {x + width / 2, top - rng.uniform(20, 50)}, {x + width + 6, top}};
    cv::fillPoly(image, std::vector<std::vector<cv::Point>>{roof}, Rgb(120, 62, 48), cv::LINE_AA);
    for (int y = top + 16; y < 560; y += 46) {
      for (int u = x + 10; u + 18 < x + width; u += 30) {
        Fill(image, {u, y, 18, 26}, Rgb(70, 84, 104));
        DrawFrame(image, {u, y, 18, 26}, Rgb(228, 226, 220), 2);
      }
    }
    x += width;
  }
  for (int k = 0; k < 420; ++k) {  // trees in front
    const int x = rng.uniform(0, 768);
    const int top = 470 + static_cast<int>(50 * std::sin(x * 0.021));
    cv::circle(image, {x, rng.uniform(top, 640)}, rng.uniform(8, 22),
               Shade(Rgb(66, 112, 52), rng.uniform(-0.45, 0.25)), cv::FILLED, cv::LINE_AA);
  }
  return image;
}

cv::Mat PaintCurtain(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "curtain");
  cv::Mat image(512, 256, CV_8UC3, Rgb(168, 160, 140));
  for (int y = 24; y < 512; y += 64) {
    for (int x = 16; x < 256; x += 48) {
      const cv::Point at(x + (y / 64 % 2) * 24, y);
      cv::ellipse(image, at, {7, 14}, 30, 0, 360, Rgb(104, 118, 96), cv::FILLED, cv::LINE_AA);
      cv::ellipse(image, at, {7, 14}, -30, 0, 360, Rgb(132, 96, 72), 2, cv::LINE_AA);
    }
  }
  Grain(image, rng, 6.0, 1);
  return image;
}

cv::Mat PaintLeaf(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "leaf");
  cv::Mat image(128, 64, CV_8UC3, Rgb(58, 110, 48));
  Modulate(image, Cloud(rng, image.size(), {4, 8}), 0.25);
  cv::line(image, {32, 0}, {32, 128}, Rgb(140, 176, 104), 2, cv::LINE_AA);
  for (int y = 8; y < 128; y += 12) {
    cv::line(image, {32, y}, {4, y + 14}, Rgb(96, 146, 76), 1, cv::LINE_AA);
    cv::line(image, {32, y}, {60, y + 14}, Rgb(96, 146, 76), 1, cv::LINE_AA);
  }
  return image;
}

cv::Mat PaintRadiator(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "radiator");
  cv::Mat image(256, 512, CV_8UC3, Rgb(226, 224, 216));
  for (int x = 0; x < 512; x += 24) {
    Fill(image, {x, 10, 6, 236}, Rgb(168, 166, 160));
    Fill(image, {x + 6, 10, 3, 236}, Rgb(246, 245, 240));
  }
  Grain(image, rng, 2.0, 2);
  return image;
}

}  // namespace saccade
