#include "server/overlay/text_painter.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr std::size_t kMaxSprites = 256;
constexpr std::size_t kMaxBytes = std::size_t{64} << 20;
constexpr double kLineHeight = 1.28;  // of the size: marks above capitals have room
constexpr double kAscent = 1.0;       // of the size, from the top of a line to its baseline
const cv::Scalar kTextHalo{24, 22, 20};
const cv::Scalar kBoxFill{18, 17, 16};

/// The letters' coverage and the emoji, to be coloured later.
struct Ink {
  cv::Mat coverage;  // CV_8UC1
  cv::Mat pictures;  // CV_8UC4, premultiplied
  bool has_pictures = false;
};

/// The part of `what`, laid at `corner`, that is inside `whole`.
bool Clip(const cv::Mat& what, const cv::Point& corner, const cv::Mat& whole, cv::Rect& source,
          cv::Rect& target) {
  target = cv::Rect(corner, what.size()) & cv::Rect(0, 0, whole.cols, whole.rows);
  source = cv::Rect(target.tl() - corner, target.size());
  return target.area() > 0;
}

void AddGlyph(FontStore& fonts, const PlacedGlyph& glyph, const cv::Point2d& origin, int size_px,
              Ink& ink) {
  const double x = origin.x + glyph.x_px;
  const int baseline = cvRound(origin.y + glyph.y_px);
  if (glyph.font == kNoFont) {
    const cv::Rect box(cvRound(x + 0.06 * size_px), baseline - cvRound(0.72 * size_px),
                       cvRound(0.5 * size_px), cvRound(0.72 * size_px));
    cv::rectangle(ink.coverage, box, cv::Scalar(255), std::max(1, size_px / 14));
    return;
  }
  // Quarters of a pixel: letters keep their distances.
  const double left = std::floor(4.0 * x) / 4.0;
  const double whole = std::floor(left);
  const GlyphPicture picture = fonts.Draw(glyph.font, glyph.glyph, size_px, left - whole);
  if (picture.pixels.empty()) return;
  const cv::Point corner(static_cast<int>(whole) + picture.left, baseline - picture.top);
  cv::Rect source, target;
  if (!Clip(picture.pixels, corner, ink.coverage, source, target)) return;
  if (picture.pixels.channels() == 1) {
    cv::Mat under = ink.coverage(target);
    cv::max(under, picture.pixels(source), under);
  } else {
    ink.has_pictures = true;
    picture.pixels(source).copyTo(ink.pictures(target));
  }
}

Ink DrawLines(FontStore& fonts, const std::vector<TextLine>& lines, const cv::Size& size,
              const TextStyle& style) {
  Ink ink{cv::Mat::zeros(size, CV_8UC1), cv::Mat::zeros(size, CV_8UC4)};
  const int size_px = style.layout.size_px;
  double top = style.margin_px;
  for (const TextLine& line : lines) {
    const double left =
        line.right_to_left ? size.width - style.margin_px - line.width_px : style.margin_px;
    const cv::Point2d origin(left, std::round(top + kAscent * size_px));
    for (const PlacedGlyph& glyph : line.glyphs) AddGlyph(fonts, glyph, origin, size_px, ink);
    top += kLineHeight * size_px;
  }
  return ink;
}

using Premultiplied = cv::Vec4b;

/// `over` onto `under`, both premultiplied.
Premultiplied Over(const Premultiplied& over, const Premultiplied& under) {
  Premultiplied out;
  const int rest = 255 - over[3];
  for (int c = 0; c < 4; ++c) {
    out[c] = cv::saturate_cast<uchar>(over[c] + (under[c] * rest + 127) / 255);
  }
  return out;
}

Premultiplied Tint(const cv::Scalar& color, int alpha) {
  Premultiplied out;
  for (int c = 0; c < 3; ++c) out[c] = cv::saturate_cast<uchar>(color[c] * alpha / 255.0);
  out[3] = static_cast<uchar>(alpha);
  return out;
}

cv::Mat Compose(const Ink& ink, const TextStyle& style) {
  cv::Mat rim;
  if (style.ground == TextGround::kHalo) {
    const int r = std::max(1, style.layout.size_px / 8);
    cv::Mat all = ink.coverage.clone(), alpha;
    cv::extractChannel(ink.pictures, alpha, 3);
    cv::max(all, alpha, all);
    cv::dilate(all, rim, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * r + 1, 2 * r + 1}));
  }
  cv::Mat out(ink.coverage.size(), CV_8UC4);
  const Premultiplied ground =
      style.ground == TextGround::kBox ? Tint(kBoxFill, 255) : Premultiplied(0, 0, 0, 0);
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.cols; ++x) {
      Premultiplied pixel = ground;
      if (!rim.empty()) pixel = Tint(kTextHalo, rim.at<uchar>(y, x));
      pixel = Over(Tint(style.color, ink.coverage.at<uchar>(y, x)), pixel);
      if (ink.has_pictures) pixel = Over(ink.pictures.at<Premultiplied>(y, x), pixel);
      out.at<Premultiplied>(y, x) = pixel;
    }
  }
  if (style.ground == TextGround::kBox) cv::cvtColor(out, out, cv::COLOR_BGRA2BGR);
  return out;
}

TextSprite Draw(FontStore& fonts, std::string_view heading, std::string_view utf8,
                const TextStyle& style) {
  TextLayout text = LayOut(fonts, heading, style.layout);
  TextLayout rest = LayOut(fonts, utf8, style.layout);
  text.width_px = std::max(text.width_px, rest.width_px);
  std::move(rest.lines.begin(), rest.lines.end(), std::back_inserter(text.lines));
  const int size_px = style.layout.size_px;
  // One character may be wider than the line.
  const double width_px = std::min(std::ceil(text.width_px), style.layout.max_width_px);
  const cv::Size size(
      std::max(1, static_cast<int>(width_px) + 2 * style.margin_px),
      std::max(1, cvRound(kLineHeight * size_px * static_cast<double>(text.lines.size())) +
                      2 * style.margin_px));
  TextSprite sprite;
  sprite.cut = rest.cut;
  sprite.baseline_px = cvRound(style.margin_px + kAscent * size_px);
  sprite.pixels = Compose(DrawLines(fonts, text.lines, size, style), style);
  return sprite;
}

}  // namespace

TextPainter& TextPainter::OfThisThread() {
  thread_local TextPainter painter(FontCatalogue::System());
  return painter;
}

std::shared_ptr<const TextSprite> TextPainter::Sprite(std::string_view heading,
                                                      std::string_view utf8,
                                                      const TextStyle& style) {
  const LayoutOptions& layout = style.layout;
  const std::string key = absl::StrCat(
      layout.size_px, " ", layout.max_width_px, " ", layout.max_lines, " ", style.color[0], " ",
      style.color[1], " ", style.color[2], " ", static_cast<int>(style.ground), " ",
      style.margin_px, " ", heading.size(), " ", std::string(heading), std::string(utf8));
  if (const auto found = by_key_.find(key); found != by_key_.end()) {
    kept_.splice(kept_.begin(), kept_, found->second);
    return found->second->sprite;
  }
  auto sprite = std::make_shared<const TextSprite>(Draw(fonts_, heading, utf8, style));
  kept_.push_front({key, sprite, sprite->pixels.total() * sprite->pixels.elemSize() + key.size()});
  by_key_[key] = kept_.begin();
  bytes_ += kept_.front().bytes;
  MakeRoom();
  return sprite;
}

void TextPainter::MakeRoom() {
  while (kept_.size() > 1 && (kept_.size() > kMaxSprites || bytes_ > kMaxBytes)) {
    bytes_ -= kept_.back().bytes;
    by_key_.erase(kept_.back().key);
    kept_.pop_back();
  }
}

void TextPainter::Lay(const TextSprite& sprite, const cv::Point& corner, cv::Mat& picture) {
  cv::Rect source, target;
  if (!Clip(sprite.pixels, corner, picture, source, target)) return;
  const cv::Mat from = sprite.pixels(source);
  cv::Mat to = picture(target);
  if (from.channels() == 3) {
    from.copyTo(to);
    return;
  }
  for (int y = 0; y < from.rows; ++y) {
    const Premultiplied* over = from.ptr<Premultiplied>(y);
    cv::Vec3b* under = to.ptr<cv::Vec3b>(y);
    for (int x = 0; x < from.cols; ++x) {
      const int rest = 255 - over[x][3];
      if (rest == 255) continue;
      for (int c = 0; c < 3; ++c) {
        under[x][c] = cv::saturate_cast<uchar>(over[x][c] + (under[x][c] * rest + 127) / 255);
      }
    }
  }
}

}  // namespace saccade
