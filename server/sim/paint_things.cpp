#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "server/sim/paint.hpp"

namespace saccade {
namespace {

constexpr const char* kTitles[] = {
    "CONTROL THEORY",  "Linear Algebra", "OPTICS",         "The Sea",    "C++ IN DEPTH",
    "Motors & Drives", "ATLAS",          "Thermodynamics", "A HISTORY",  "Robot Vision",
    "GARDENING",       "Circuits II",    "Probability",    "BRIDGES",    "Field Guide",
    "Welding",         "The Long Road",  "SIGNALS",        "Metallurgy", "NETWORKS",
    "Cooking",         "Geometry",       "Workshop",       "PUMPS",      "Analysis I",
    "Typography",      "MECHANICS",      "Estimation",     "Poems",      "Norms 2024",
    "LASERS",          "Ceramics"};

/// Dark or light ink, whichever shows on `paper`.
cv::Scalar InkOn(const cv::Scalar& paper) {
  return paper[0] * 0.11 + paper[1] * 0.59 + paper[2] * 0.3 > 120 ? Rgb(30, 26, 24)
                                                                  : Rgb(240, 226, 180);
}

void Key(cv::Mat& image, const cv::Rect& key, const std::string& label) {
  Fill(image, key, Rgb(34, 35, 38));
  Fill(image, {key.x + 3, key.y + 2, key.width - 6, key.height - 7}, Rgb(62, 64, 68));
  Text(image, label, {key.x + key.width / 2, key.y + key.height / 2 - 2}, 13, Rgb(220, 222, 224));
}

cv::Mat Letter(cv::RNG& rng, const cv::Size& size, int kind) {
  cv::Mat page(size, CV_8UC3, kind == 2 ? Rgb(250, 248, 236) : Rgb(246, 246, 244));
  const int w = size.width, h = size.height;
  if (kind == 0) {
    Fill(page, {30, 30, 90, 40}, Rgb(30, 90, 150));
    Text(page, "INVOICE", {w - 130, 52}, 22, Rgb(40, 40, 44), 2);
    Lines(page, rng, {30, 100, w / 2, 60}, 7, Rgb(60, 60, 64));
    for (int k = 0; k < 7; ++k) {
      DrawFrame(page, {30, 200 + 34 * k, w - 60, 34}, Rgb(120, 120, 124));
      Lines(page, rng, {40, 212 + 34 * k, w - 160, 14}, 7, Rgb(60, 60, 64));
    }
    Lines(page, rng, {30, 470, w - 60, 70}, 7, Rgb(60, 60, 64));
  } else if (kind == 1) {
    Text(page, "Test report 118", {w / 2, 50}, 22, Rgb(30, 30, 34), 2);
    Lines(page, rng, {30, 90, w - 60, 140}, 7, Rgb(60, 60, 64));
    DrawFrame(page, {40, 250, w - 80, 180}, Rgb(40, 40, 44), 2);
    cv::Point last(42, 400);
    for (int x = 0; x < w - 84; x += 6) {
      const cv::Point next(42 + x,
                           340 - static_cast<int>(60 * std::sin(x * 0.04) * std::exp(-x * 0.004)) +
                               rng.uniform(-3, 4));
      cv::line(page, last, next, Rgb(190, 40, 40), 2, cv::LINE_AA);
      last = next;
    }
    Lines(page, rng, {30, 450, w - 60, 90}, 7, Rgb(60, 60, 64));
  } else if (kind == 2) {
    for (int y = 50; y < h - 10; y += 26)
      cv::line(page, {10, y}, {w - 10, y}, Rgb(170, 190, 220), 1);
    cv::line(page, {54, 0}, {54, h}, Rgb(220, 130, 130), 2);
    for (int y = 44; y < h - 60; y += 26) {
      if (rng.uniform(0, 5) == 0) continue;
      Lines(page, rng, {64, y - 9, rng.uniform(w / 3, w - 90), 11}, 9, Rgb(30, 44, 110));
    }
    for (int y = 20; y < h; y += 26)
      cv::circle(page, {16, y}, 5, Rgb(60, 60, 64), cv::FILLED, cv::LINE_AA);
  } else {
    DrawFrame(page, {16, 16, w - 32, h - 32}, Rgb(30, 30, 34), 2);
    cv::circle(page, {w / 2, h / 2 - 40}, 120, Rgb(30, 30, 34), 2, cv::LINE_AA);
    cv::circle(page, {w / 2, h / 2 - 40}, 60, Rgb(30, 30, 34), 2, cv::LINE_AA);
    for (int k = 0; k < 6; ++k) {
      cv::circle(page,
                 {w / 2 + static_cast<int>(90 * std::cos(k)),
                  h / 2 - 40 + static_cast<int>(90 * std::sin(k))},
                 14, Rgb(30, 30, 34), 2, cv::LINE_AA);
    }
    Fill(page, {w - 200, h - 90, 180, 70}, Rgb(232, 232, 230));
    DrawFrame(page, {w - 200, h - 90, 180, 70}, Rgb(30, 30, 34), 2);
    Text(page, "FLANGE B", {w - 110, h - 55}, 18, Rgb(30, 30, 34), 2);
  }
  return page;
}

}  // namespace

cv::Mat PaintSpines(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "spines");
  const int w = 64, h = 384;
  cv::Mat atlas(h * kSpineRows, w * kSpineColumns, CV_8UC3);
  const cv::Scalar covers[12] = {Rgb(128, 30, 34),   Rgb(24, 52, 96),    Rgb(34, 84, 60),
                                 Rgb(212, 170, 60),  Rgb(232, 224, 204), Rgb(40, 40, 44),
                                 Rgb(176, 88, 44),   Rgb(84, 56, 108),   Rgb(70, 128, 148),
                                 Rgb(150, 152, 150), Rgb(196, 60, 50),   Rgb(214, 206, 150)};
  for (int k = 0; k < kSpineColumns * kSpineRows; ++k) {
    const cv::Scalar cover = Shade(covers[rng.uniform(0, 12)], rng.uniform(-0.15, 0.1));
    const cv::Scalar ink = InkOn(cover);
    cv::Mat lying(w, h, CV_8UC3, cover);  // painted lying down, then stood up
    const int band = rng.uniform(14, 60);
    const int style = rng.uniform(0, 4);
    if (style != 0) {
      Fill(lying, {band, 0, style == 1 ? 26 : 5, w}, style == 1 ? covers[rng.uniform(0, 12)] : ink);
      Fill(lying, {h - band - 10, 0, style == 1 ? 20 : 5, w}, ink);
    }
    if (style == 3)
      Fill(lying, {70, 8, h - 160, w - 16}, Shade(cover, InkOn(cover)[0] > 100 ? -0.45 : 0.4));
    const char* title = kTitles[rng.uniform(0, static_cast<int>(std::size(kTitles)))];
    Text(lying, title, {h / 2 - 10, w / 2}, rng.uniform(17, 26),
         style == 3 ? InkOn(Shade(cover, ink[0] > 100 ? -0.45 : 0.4)) : ink, 2);
    Lines(lying, rng, {h - 52, 22, 38, 20}, 6, ink);
    cv::Mat standing;
    cv::rotate(lying, standing, cv::ROTATE_90_CLOCKWISE);
    Fill(standing, {0, 0, 2, h}, Shade(cover, -0.45));
    Fill(standing, {w - 2, 0, 2, h}, Shade(cover, -0.45));
    standing.copyTo(atlas(cv::Rect(k % kSpineColumns * w, k / kSpineColumns * h, w, h)));
  }
  Grain(atlas, rng, 3.0, 2);
  return atlas;
}

cv::Mat PaintCartons(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "cartons");
  cv::Mat atlas(768, 1024, CV_8UC3, Rgb(182, 142, 98));
  for (int x = 0; x < 1024; x += 6) cv::line(atlas, {x, 0}, {x, 768}, Rgb(174, 134, 90), 1);
  static const char* const kNames[3] = {"SCREWS M4", "FRAGILE", "SPARE PARTS"};
  for (int k = 0; k < 3; ++k) {
    const cv::Point o(512 * (k % 2), 384 * (k / 2));
    Fill(atlas, {o.x, o.y + 160, 512, 50}, Rgb(206, 176, 124));  // tape
    const cv::Rect label(o.x + 60, o.y + 70, 300, 200);
    DropShadow(atlas, label, 4, 0.3);
    Fill(atlas, label, Rgb(246, 246, 240));
    DrawFrame(atlas, label, Rgb(60, 60, 60), 2);
    Text(atlas, kNames[k], {label.x + 150, label.y + 40}, 30,
         k == 1 ? Rgb(200, 30, 30) : Rgb(30, 30, 34), 3);
    Lines(atlas, rng, {label.x + 16, label.y + 78, 160, 60}, 8, Rgb(50, 50, 54));
    for (int x = label.x + 190; x < label.x + 285;) {  // bar code
      const int bar = rng.uniform(2, 7);
      Fill(atlas, {x, label.y + 76, bar, 76}, Rgb(20, 20, 20));
      x += bar + rng.uniform(2, 7);
    }
    Text(atlas, "No. " + std::to_string(rng.uniform(1000, 9999)), {label.x + 16, label.y + 176}, 16,
         Rgb(40, 40, 44), 2, true);
    for (int a = 0; a < 2; ++a) {  // this side up
      const cv::Point p(o.x + 410 + 50 * a, o.y + 330);
      cv::arrowedLine(atlas, p, p + cv::Point(0, -80), Rgb(40, 32, 26), 8, cv::LINE_AA, 0, 0.35);
    }
  }
  Fill(atlas, {512, 384 + 170, 512, 46}, Rgb(206, 176, 124));
  Modulate(atlas, Cloud(rng, atlas.size(), {16, 12}), 0.06);
  Grain(atlas, rng, 3.0, 1);
  return atlas;
}

cv::Mat PaintKeyboard(std::uint64_t) {
  cv::Mat image(300, 960, CV_8UC3, Rgb(24, 25, 27));
  static const char* const kRows[5] = {"1234567890-=", "QWERTYUIOP[]", "ASDFGHJKL;'", "ZXCVBNM,./",
                                       " "};
  for (int row = 0; row < 4; ++row) {
    int x = 14 + 20 * row;
    Key(image, {12, 14 + 54 * row, x + 38, 48},
        row == 0   ? "Esc"
        : row == 1 ? "Tab"
        : row == 2 ? "Caps"
                   : "Shift");
    x += 54;
    for (const char* c = kRows[row]; *c != '\0'; ++c, x += 52)
      Key(image, {x, 14 + 54 * row, 48, 48}, std::string(1, *c));
    Key(image, {x, 14 + 54 * row, 738 - x, 48}, row == 0 ? "Back" : row == 2 ? "Enter" : "");
  }
  int x = 12;
  for (const int width : {70, 70, 60, 320, 60, 60, 62}) {
    Key(image, {x, 230, width - 4, 48}, width == 320 ? "" : width == 70 ? "Ctrl" : "Alt");
    x += width + 3;
  }
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i)
      Key(image, {752 + 50 * i, 14 + 54 * j, 46, 48},
          std::string(1, "789/456*123-0.=+"[j * 4 + i]));
  }
  Key(image, {752, 230, 96, 48}, "0");
  Key(image, {852, 230, 96, 48}, "Enter");
  return image;
}

cv::Mat PaintScreen(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "screen");
  cv::Mat image(576, 1024, CV_8UC3, Rgb(26, 44, 70));
  Modulate(image, Cloud(rng, image.size(), {4, 3}), 0.25);
  const cv::Rect editor(40, 40, 540, 480), plot(610, 60, 370, 260), chat(610, 345, 370, 175);
  for (const cv::Rect& window : {editor, plot, chat}) {
    DropShadow(image, window, 10, 0.5);
    Fill(image, window, window == editor ? Rgb(30, 32, 38) : Rgb(238, 240, 242));
    Fill(image, {window.x, window.y, window.width, 24}, Rgb(200, 204, 210));
    for (int k = 0; k < 3; ++k)
      cv::circle(image, {window.x + 14 + 18 * k, window.y + 12}, 6,
                 k == 0   ? Rgb(220, 80, 70)
                 : k == 1 ? Rgb(230, 180, 60)
                          : Rgb(90, 180, 80),
                 cv::FILLED, cv::LINE_AA);
  }
  const cv::Scalar code[4] = {Rgb(220, 220, 224), Rgb(120, 180, 240), Rgb(230, 150, 90),
                              Rgb(130, 200, 120)};
  for (int y = editor.y + 38; y < editor.y + 470; y += 17) {
    const int indent = rng.uniform(0, 4) * 24;
    Lines(image, rng, {editor.x + 12, y, 18, 9}, 9, Rgb(100, 104, 112));
    for (int x = editor.x + 44 + indent; x < editor.x + 110 + rng.uniform(60, 400);) {
      const int word = rng.uniform(16, 70);
      Lines(image, rng, {x, y, word, 9}, 9, code[rng.uniform(0, 4)]);
      x += word + 10;
    }
  }
  for (int k = 0; k < 6; ++k)
    cv::line(image, {plot.x + 30, plot.y + 50 + 36 * k}, {plot.x + 350, plot.y + 50 + 36 * k},
             Rgb(206, 208, 212), 1);
  for (int curve = 0; curve < 2; ++curve) {
    cv::Point last(plot.x + 30, plot.y + 200);
    for (int x = 0; x < 320; x += 4) {
      const cv::Point next(
          plot.x + 30 + x,
          plot.y + 150 -
              static_cast<int>((70 - 30 * curve) * std::sin(x * (0.02 + 0.013 * curve) + curve)) +
              rng.uniform(-3, 4));
      cv::line(image, last, next, curve ? Rgb(40, 100, 190) : Rgb(200, 60, 50), 2, cv::LINE_AA);
      last = next;
    }
  }
  for (int k = 0; k < 4; ++k)
    Lines(image, rng, {chat.x + (k % 2 ? 120 : 16), chat.y + 36 + 34 * k, 220, 22}, 7,
          k % 2 ? Rgb(30, 90, 160) : Rgb(60, 62, 66));
  Fill(image, {0, 548, 1024, 28}, Rgb(18, 20, 26));
  for (int k = 0; k < 8; ++k) Fill(image, {12 + 34 * k, 552, 20, 20}, code[k % 4]);
  return image;
}

cv::Mat PaintPapers(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "papers");
  cv::Mat atlas(1152, 832, CV_8UC3);
  for (int k = 0; k < 4; ++k)
    Letter(rng, {416, 576}, k).copyTo(atlas(cv::Rect(416 * (k % 2), 576 * (k / 2), 416, 576)));
  return atlas;
}

cv::Mat PaintCuttingMat(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "mat");
  cv::Mat image(440, 640, CV_8UC3, Rgb(28, 92, 74));
  const cv::Scalar line = Rgb(190, 206, 150);
  for (int k = 0; k <= 29; ++k)
    cv::line(image, {30 + 20 * k, 30}, {30 + 20 * k, 410}, line, k % 5 ? 1 : 2);
  for (int k = 0; k <= 19; ++k)
    cv::line(image, {30, 30 + 20 * k}, {610, 30 + 20 * k}, line, k % 5 ? 1 : 2);
  for (int k = 0; k < 6; ++k) Text(image, std::to_string(5 * k), {30 + 100 * k, 16}, 11, line);
  cv::line(image, {30, 410}, {410, 30}, line, 1, cv::LINE_AA);
  for (int k = 0; k < 22; ++k) {
    const cv::Point at(rng.uniform(60, 580), rng.uniform(60, 390));
    cv::line(image, at, at + cv::Point(rng.uniform(-90, 91), rng.uniform(-60, 61)), Rgb(18, 62, 50),
             1, cv::LINE_AA);
  }
  Grain(image, rng, 3.0, 1);
  return image;
}

cv::Mat PaintMug(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "mug");
  const cv::Scalar glaze = rng.uniform(0, 2) ? Rgb(222, 214, 196) : Rgb(64, 110, 150);
  cv::Mat image(256, 640, CV_8UC3, glaze);
  const cv::Scalar ink = InkOn(glaze);
  Fill(image, {0, 0, 640, 18}, ink);
  Fill(image, {0, 226, 640, 10}, Rgb(190, 60, 40));
  for (int side = 0; side < 2; ++side) {
    const cv::Point c(160 + 320 * side, 122);
    cv::circle(image, c, 74, ink, 6, cv::LINE_AA);
    Text(image, side ? "TEA" : "LAB 3", c + cv::Point(0, -14), 26, ink, 3);
    Text(image, side ? "always" : "COFFEE", c + cv::Point(0, 28), 16, Rgb(190, 60, 40), 2);
  }
  Grain(image, rng, 2.0, 1);
  return image;
}

cv::Mat PaintMeter(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "meter");
  cv::Mat image(400, 224, CV_8UC3, Rgb(226, 176, 36));
  Fill(image, {16, 14, 192, 372}, Rgb(44, 46, 50));
  Fill(image, {32, 30, 160, 84}, Rgb(176, 190, 168));
  Text(image, "12." + std::to_string(rng.uniform(10, 99)), {112, 72}, 42, Rgb(24, 28, 24), 4);
  cv::circle(image, {112, 226}, 62, Rgb(22, 22, 24), cv::FILLED, cv::LINE_AA);
  cv::line(image, {112, 226}, {140, 180}, Rgb(240, 240, 240), 7, cv::LINE_AA);
  static const char* const kMarks[8] = {"V", "A", "R", "C", "Hz", "mV", "mA", "OFF"};
  for (int k = 0; k < 8; ++k) {
    Text(image, kMarks[k],
         {112 + static_cast<int>(82 * std::cos(k * CV_PI / 4)),
          226 + static_cast<int>(78 * std::sin(k * CV_PI / 4))},
         13, Rgb(240, 240, 236), 1);
  }
  for (int k = 0; k < 3; ++k) {
    cv::circle(image, {52 + 60 * k, 350}, 17, k == 2 ? Rgb(190, 30, 30) : Rgb(12, 12, 12),
               cv::FILLED, cv::LINE_AA);
    cv::circle(image, {52 + 60 * k, 350}, 7, Rgb(120, 120, 120), cv::FILLED, cv::LINE_AA);
  }
  return image;
}

cv::Mat PaintDrawers(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "drawers");
  cv::Mat image(480, 640, CV_8UC3, Rgb(52, 60, 74));
  for (int j = 0; j < 6; ++j) {
    for (int i = 0; i < 5; ++i) {
      const cv::Rect drawer(12 + 125 * i, 10 + 78 * j, 116, 68);
      const cv::Scalar plastic = Shade(rng.uniform(0, 5) ? Rgb(176, 188, 196) : Rgb(200, 130, 60),
                                       rng.uniform(-0.2, 0.15));
      Fill(image, drawer, plastic);
      DrawFrame(image, drawer, Shade(plastic, -0.5), 2);
      for (int k = 0; k < 16; ++k) {  // what shimmers through
        cv::circle(image, {drawer.x + rng.uniform(10, 106), drawer.y + rng.uniform(34, 62)},
                   rng.uniform(2, 5), Shade(plastic, rng.uniform(-0.55, -0.1)), cv::FILLED,
                   cv::LINE_AA);
      }
      Fill(image, {drawer.x + 22, drawer.y + 6, 72, 24}, Rgb(246, 244, 232));
      Text(image,
           std::string(1, static_cast<char>('A' + j)) + std::to_string(i + 1) + " M" +
               std::to_string(rng.uniform(2, 9)),
           {drawer.x + 58, drawer.y + 18}, 12, Rgb(30, 30, 34), 1);
      Fill(image, {drawer.x + 44, drawer.y + 58, 28, 8}, Shade(plastic, -0.35));
    }
  }
  return image;
}

cv::Mat PaintPrinter(std::uint64_t seed) {
  cv::RNG rng = RngFor(seed, "printer");
  cv::Mat image(256, 512, CV_8UC3, Rgb(206, 206, 202));
  Fill(image, {0, 0, 512, 50}, Rgb(64, 66, 70));
  Fill(image, {350, 8, 120, 34}, Rgb(110, 150, 170));
  Text(image, "READY", {410, 25}, 14, Rgb(20, 30, 34), 1);
  Fill(image, {50, 90, 412, 44}, Rgb(36, 36, 38));
  Fill(image, {80, 110, 340, 20}, Rgb(246, 246, 244));
  DrawFrame(image, {20, 160, 472, 80}, Rgb(120, 120, 118), 3);
  Fill(image, {216, 176, 80, 14}, Rgb(120, 120, 118));
  Text(image, "LaserPrint 420", {110, 70}, 15, Rgb(60, 60, 64), 1);
  Grain(image, rng, 2.0, 1);
  return image;
}

}  // namespace saccade
