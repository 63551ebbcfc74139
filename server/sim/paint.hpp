#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>

namespace saccade {

/// Colours and brushes of the procedural pictures. All images are CV_8UC3 BGR.
cv::Scalar Rgb(double r, double g, double b);
/// `color` lighter (amount > 0) or darker (< 0) by that fraction.
cv::Scalar Shade(const cv::Scalar& color, double amount);
/// A generator of its own for each thing, so that changing one picture leaves the others alone.
cv::RNG RngFor(std::uint64_t seed, const std::string& thing);

/// Smooth random field in about -1 .. 1 (CV_32FC1) with `cells` features across and down.
cv::Mat Cloud(cv::RNG& rng, const cv::Size& size, const cv::Size& cells);
/// image *= 1 + amount * field.
void Modulate(cv::Mat& image, const cv::Mat& field, double amount);
/// Adds grey noise of `sigma` levels, drawn at `scale` pixels a grain.
void Grain(cv::Mat& image, cv::RNG& rng, double sigma, int scale = 1);

/// Text with its middle (or, with `left`, its left end) at `at`; `height` of capitals in pixels.
void Text(cv::Mat& image, const std::string& text, const cv::Point& at, double height,
          const cv::Scalar& color, int thickness = 1, bool left = false);
/// Lines of imitation text in `area`: words as short strokes of `line` pixels height.
void Lines(cv::Mat& image, cv::RNG& rng, const cv::Rect& area, int line, const cv::Scalar& color);
void Fill(cv::Mat& image, const cv::Rect& area, const cv::Scalar& color);
void DrawFrame(cv::Mat& image, const cv::Rect& area, const cv::Scalar& color, int thickness = 1);
/// A soft dark rim just outside `area`, as a raised thing throws.
void DropShadow(cv::Mat& image, const cv::Rect& area, int reach, double strength);

/// Planed wood, grain along x, `base` its colour.
cv::Mat Wood(cv::RNG& rng, const cv::Size& size, const cv::Scalar& base);

// Surfaces (paint_surfaces.cpp).
cv::Mat PaintPlaster(std::uint64_t seed, const cv::Scalar& base);
cv::Mat PaintFloor(std::uint64_t seed);
cv::Mat PaintCeiling(std::uint64_t seed);
cv::Mat PaintRug(std::uint64_t seed);
cv::Mat PaintDeskTop(std::uint64_t seed);
cv::Mat PaintFurnitureWood(std::uint64_t seed, const cv::Scalar& base);
/// 8 x 8 cells of plain materials; kPalette... name some of them.
cv::Mat PaintPalette(std::uint64_t seed);
cv::Mat PaintDoor(std::uint64_t seed);
cv::Mat PaintOutside(std::uint64_t seed);
cv::Mat PaintCurtain(std::uint64_t seed);
cv::Mat PaintLeaf(std::uint64_t seed);
cv::Mat PaintRadiator(std::uint64_t seed);

// Prints on walls (paint_prints.cpp).
cv::Mat PaintChessboard();
cv::Mat PaintLandscape(std::uint64_t seed);
cv::Mat PaintSafety(std::uint64_t seed);
cv::Mat PaintElements(std::uint64_t seed);
cv::Mat PaintCityMap(std::uint64_t seed);
cv::Mat PaintShapes(std::uint64_t seed);
cv::Mat PaintBlueprint(std::uint64_t seed);
cv::Mat PaintCalendar(std::uint64_t seed);
cv::Mat PaintSlogan(std::uint64_t seed);

// Boards and things (paint_boards.cpp, paint_things.cpp).
cv::Mat PaintWhiteboard(std::uint64_t seed);
cv::Mat PaintCork(std::uint64_t seed);
cv::Mat PaintPegboard(std::uint64_t seed);
cv::Mat PaintClock(std::uint64_t seed);
/// kSpineColumns x kSpineRows spines of books side by side.
inline constexpr int kSpineColumns = 32, kSpineRows = 2;
cv::Mat PaintSpines(std::uint64_t seed);
/// 2 x 2 labelled faces of cardboard boxes; the bottom right one is plain.
cv::Mat PaintCartons(std::uint64_t seed);
cv::Mat PaintKeyboard(std::uint64_t seed);
cv::Mat PaintScreen(std::uint64_t seed);
/// 2 x 2 sheets of paper: two letters, a notebook, a drawing.
cv::Mat PaintPapers(std::uint64_t seed);
cv::Mat PaintCuttingMat(std::uint64_t seed);
cv::Mat PaintMug(std::uint64_t seed);
cv::Mat PaintMeter(std::uint64_t seed);
cv::Mat PaintDrawers(std::uint64_t seed);
cv::Mat PaintPrinter(std::uint64_t seed);

/// Cells of PaintPalette, row by row.
enum PaletteCell {
  kBlack,
  kCharcoal,
  kGrey,
  kLightGrey,
  kWhite,
  kCream,
  kSteel,
  kBrass,
  kRed,
  kDarkRed,
  kOrange,
  kYellow,
  kGreen,
  kDarkGreen,
  kTeal,
  kBlue,
  kNavy,
  kPurple,
  kBrown,
  kTerracotta,
  kSoil,
  kPaper,
  kPink,
  kSky,
  kPaletteCells
};

}  // namespace saccade
