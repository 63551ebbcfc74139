#include "server/markers/marker_sheet.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>
#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "server/markers/marker_pattern.hpp"

namespace saccade {
namespace {

constexpr double kPoint_mm = 25.4 / 72;
constexpr double kPngDots_per_mm = 300 / 25.4;
// White about a marker, which the detectors need.
constexpr double kLeastWhite_mm = 8, kWhiteOfSide = 0.12;
constexpr double kCaption_mm = 4, kCaptionBelow_mm = 1.5;
constexpr double kEdge_mm = 8;  // which printers leave white
constexpr double kRulerStrip_mm = 24, kRuler_mm = 100, kTick_mm = 10;
constexpr double kLine_mm = 0.3;
constexpr double kLeastSide_m = 0.005;
constexpr int kMostIds = 1000;

struct Paper {
  const char* name;
  double width_mm, height_mm;
};
constexpr std::array kPapers = {Paper{"a4", 210, 297}, Paper{"letter", 215.9, 279.4}};

struct Destroy {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Surface = std::unique_ptr<cairo_surface_t, Destroy>;
using Context = std::unique_ptr<cairo_t, Destroy>;

void Say(cairo_t* page, double left_mm, double base_mm, double size_mm, const std::string& words) {
  cairo_set_source_rgb(page, 0, 0, 0);
  cairo_select_font_face(page, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(page, size_mm);
  cairo_move_to(page, left_mm, base_mm);
  cairo_show_text(page, words.c_str());
}

/// All cells of one shade in one path: cells that touch show no seam.
void FillShade(cairo_t* page, const MarkerPattern& pattern, CellShade shade, double left_mm,
               double top_mm, double cell_mm) {
  for (int row = 0; row < pattern.cells; ++row) {
    for (int column = 0; column < pattern.cells; ++column) {
      if (pattern.At(row, column) != shade) continue;
      cairo_rectangle(page, left_mm + column * cell_mm, top_mm + row * cell_mm, cell_mm, cell_mm);
    }
  }
  cairo_fill(page);
}

void DrawMarker(cairo_t* page, const MarkerPattern& pattern, const SheetLayout::Place& place,
                const SheetOptions& options) {
  const double side_mm = 1e3 * options.side_m;
  cairo_set_source_rgb(page, 0, 0, 0);
  cairo_rectangle(page, place.left_mm, place.top_mm, side_mm, side_mm);
  cairo_fill(page);
  const double cell_mm = side_mm / pattern.cells;
  cairo_set_source_rgb(page, 1, 1, 1);
  FillShade(page, pattern, CellShade::kWhite, place.left_mm, place.top_mm, cell_mm);
  cairo_set_source_rgb(page, 0.86, 0.04, 0.04);
  FillShade(page, pattern, CellShade::kRed, place.left_mm, place.top_mm, cell_mm);
  const double white_mm = std::max(kLeastWhite_mm, kWhiteOfSide * side_mm);
  Say(page, place.left_mm, place.top_mm + side_mm + white_mm + kCaptionBelow_mm,
      std::min(kCaption_mm, 0.1 * side_mm + 1.2),
      absl::StrFormat("%s, id %d, side %.4g mm", options.family, place.id, side_mm));
}

void DrawRuler(cairo_t* page, const SheetLayout& layout) {
  const double left = 0.5 * (layout.page_width_mm - kRuler_mm);
  const double base = layout.page_height_mm - kEdge_mm - 6;
  cairo_set_source_rgb(page, 0, 0, 0);
  cairo_set_line_width(page, kLine_mm);
  cairo_move_to(page, left, base);
  cairo_line_to(page, left + kRuler_mm, base);
  for (double at = 0; at <= kRuler_mm + 0.5; at += kTick_mm) {
    const bool end = at < 0.5 || at > kRuler_mm - 0.5;
    cairo_move_to(page, left + at, base);
    cairo_line_to(page, left + at, base - (end ? 5 : 3));
  }
  cairo_stroke(page);
  Say(page, left, base + 5, 3.2,
      "100 mm from end to end. If it is not, print again at 100 %, not fitted to the page.");
}

const Paper* PaperOf(const std::string& name) {
  for (const Paper& paper : kPapers) {
    if (name == paper.name) return &paper;
  }
  return nullptr;
}

absl::Status Draw(const SheetOptions& options, const SheetLayout& layout, cairo_t* page) {
  for (int number = 0; number < layout.pages; ++number) {
    cairo_set_source_rgb(page, 1, 1, 1);
    cairo_paint(page);
    for (const SheetLayout::Place& place : layout.places) {
      if (place.page != number) continue;
      const absl::StatusOr<MarkerPattern> pattern = PatternOf(options.family, place.id);
      if (!pattern.ok()) return pattern.status();
      DrawMarker(page, *pattern, place, options);
    }
    DrawRuler(page, layout);
    cairo_show_page(page);
  }
  return absl::OkStatus();
}

absl::Status Finish(cairo_surface_t* surface, cairo_t* page, const std::string& file) {
  cairo_surface_finish(surface);
  const cairo_status_t drawn = cairo_status(page), written = cairo_surface_status(surface);
  const cairo_status_t problem = written != CAIRO_STATUS_SUCCESS ? written : drawn;
  if (problem == CAIRO_STATUS_SUCCESS) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("--out: cannot write ", file, ": ",
                                             cairo_status_to_string(problem),
                                             "; name another file or free some space"));
}

/// A PNG's dots are square and whole: drawn at 300 dpi.
absl::Status DrawPng(const SheetOptions& options, const SheetLayout& layout,
                     const std::string& file) {
  const Surface surface(cairo_image_surface_create(
      CAIRO_FORMAT_RGB24, static_cast<int>(std::lround(layout.page_width_mm * kPngDots_per_mm)),
      static_cast<int>(std::lround(layout.page_height_mm * kPngDots_per_mm))));
  const Context page(cairo_create(surface.get()));
  cairo_scale(page.get(), kPngDots_per_mm, kPngDots_per_mm);
  if (absl::Status drawn = Draw(options, layout, page.get()); !drawn.ok()) return drawn;
  const cairo_status_t written = cairo_surface_write_to_png(surface.get(), file.c_str());
  if (written == CAIRO_STATUS_SUCCESS) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("--out: cannot write ", file, ": ",
                                             cairo_status_to_string(written),
                                             "; name another file or free some space"));
}

absl::Status DrawVectors(const SheetOptions& options, const SheetLayout& layout,
                         const std::string& file, bool svg) {
  const double width = layout.page_width_mm / kPoint_mm, height = layout.page_height_mm / kPoint_mm;
  const Surface surface(svg ? cairo_svg_surface_create(file.c_str(), width, height)
                            : cairo_pdf_surface_create(file.c_str(), width, height));
  const Context page(cairo_create(surface.get()));
  cairo_scale(page.get(), 1 / kPoint_mm, 1 / kPoint_mm);
  if (absl::Status drawn = Draw(options, layout, page.get()); !drawn.ok()) return drawn;
  return Finish(surface.get(), page.get(), file);
}

}  // namespace

absl::StatusOr<std::vector<int>> ParseMarkerIds(absl::string_view text) {
  const auto refused = [&] {
    return absl::InvalidArgumentError(
        absl::StrCat("ids: '", text, "' is not such as 0:8 (0 to 7), 3 or 1,4,9, each once"));
  };
  const std::vector<absl::string_view> ends = absl::StrSplit(text, ':');
  std::vector<int> ids;
  if (ends.size() == 2) {
    int first = 0, beyond = 0;
    if (!absl::SimpleAtoi(ends[0], &first) || !absl::SimpleAtoi(ends[1], &beyond) || first < 0 ||
        beyond <= first || beyond - first > kMostIds) {
      return refused();
    }
    for (int id = first; id < beyond; ++id) ids.push_back(id);
    return ids;
  }
  for (const absl::string_view part : absl::StrSplit(text, ',')) {
    int id = 0;
    if (!absl::SimpleAtoi(part, &id) || id < 0 || ids.size() >= kMostIds) return refused();
    ids.push_back(id);
  }
  if (std::set<int>(ids.begin(), ids.end()).size() != ids.size()) return refused();
  return ids;
}

absl::StatusOr<SheetLayout> LayOutSheet(const SheetOptions& options) {
  const Paper* paper = PaperOf(options.paper);
  if (paper == nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat("paper: there is no '", options.paper, "'; there are a4, letter"));
  }
  // Wide: white, side, white; high: white, side, white with the words in it, ruler below.
  const double most_m =
      1e-3 * std::floor(std::min(
                 paper->width_mm / (1 + 2 * kWhiteOfSide),
                 (paper->height_mm - kRulerStrip_mm - kCaption_mm) / (1 + 2 * kWhiteOfSide)));
  if (!(options.side_m >= kLeastSide_m) || options.side_m > most_m) {
    return absl::InvalidArgumentError(
        absl::StrFormat("size-m: %g is not between %g and %g, the largest that fits on %s with "
                        "white about it",
                        options.side_m, kLeastSide_m, most_m, options.paper));
  }
  if (options.ids.empty()) return absl::InvalidArgumentError("ids: none; give such as 0:8");
  const double side = 1e3 * options.side_m;
  const double white = std::max(kLeastWhite_mm, kWhiteOfSide * side);
  const double across = side + 2 * white, down = across + kCaption_mm;
  const int columns = std::max(1, static_cast<int>(paper->width_mm / across));
  const int rows = std::max(1, static_cast<int>((paper->height_mm - kRulerStrip_mm) / down));
  SheetLayout layout;
  layout.page_width_mm = paper->width_mm;
  layout.page_height_mm = paper->height_mm;
  const double left = 0.5 * (paper->width_mm - columns * across) + white;
  for (std::size_t k = 0; k < options.ids.size(); ++k) {
    const int at = static_cast<int>(k) % (columns * rows);
    SheetLayout::Place place;
    place.page = static_cast<int>(k) / (columns * rows);
    place.id = options.ids[k];
    place.left_mm = left + at % columns * across;
    place.top_mm = white + at / columns * down;
    layout.places.push_back(place);
    layout.pages = place.page + 1;
  }
  return layout;
}

absl::StatusOr<SheetLayout> WriteMarkerSheet(const SheetOptions& options,
                                             const std::filesystem::path& file) {
  for (const int id : options.ids) {
    const absl::StatusOr<MarkerPattern> pattern = PatternOf(options.family, id);
    if (!pattern.ok()) return pattern.status();
  }
  absl::StatusOr<SheetLayout> layout = LayOutSheet(options);
  if (!layout.ok()) return layout.status();
  const std::string ending = absl::AsciiStrToLower(file.extension().string());
  if (ending != ".pdf" && ending != ".svg" && ending != ".png") {
    return absl::InvalidArgumentError(
        absl::StrCat("--out: ", file.string(), " does not end in .pdf, .svg or .png"));
  }
  if (ending != ".pdf" && layout->pages > 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("--out: they fill ", layout->pages, " pages, and ", ending,
                     " holds one; name a .pdf, or print fewer or smaller ones"));
  }
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored)) {
    return absl::AlreadyExistsError(
        absl::StrCat("--out: ", file.string(), " exists; name a new file"));
  }
  const absl::Status drawn = ending == ".png"
                                 ? DrawPng(options, *layout, file.string())
                                 : DrawVectors(options, *layout, file.string(), ending == ".svg");
  if (!drawn.ok()) return drawn;
  return layout;
}

}  // namespace saccade
