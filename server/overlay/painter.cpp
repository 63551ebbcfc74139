#include "server/overlay/painter.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr int kShift = 4;  // OpenCV takes coordinates in sixteenths of a pixel
constexpr double kDashPx = 5.0;
const cv::Scalar kHalo{24, 22, 20};
const cv::Scalar kBoxFill{18, 17, 16};
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;

cv::Point Fixed(const Eigen::Vector2d& pixel) {
  return {static_cast<int>(std::lround(pixel.x() * (1 << kShift))),
          static_cast<int>(std::lround(pixel.y() * (1 << kShift)))};
}

/// OpenCV's built-in letters are ASCII: others become one question mark each.
std::string Ascii(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte < 0x7f) {
      out += c;
    } else if (byte >= 0xc0) {
      out += '?';
    }
  }
  return out;
}

/// Cuts a polyline into dashes of equal length.
std::vector<Polyline2> Dashes(const Polyline2& line, double dash_px) {
  std::vector<Polyline2> dashes;
  Polyline2 current = {line.front()};
  double left = dash_px;
  bool on = true;
  for (std::size_t i = 1; i < line.size(); ++i) {
    Eigen::Vector2d from = line[i - 1];
    double length = (line[i] - from).norm();
    while (length > left) {
      from += left / length * (line[i] - from);
      length -= left;
      current.push_back(from);
      if (on) dashes.push_back(current);
      current = {from};
      on = !on;
      left = dash_px;
    }
    current.push_back(line[i]);
    left -= length;
  }
  if (on && current.size() > 1) dashes.push_back(current);
  return dashes;
}

}  // namespace

Painter::Painter(cv::Mat& picture)
    : picture_(picture), scale_(std::max(0.5, picture.cols / 640.0)) {}

void Painter::Polyline(const Polyline2& line, const cv::Scalar& color, double width_px) {
  std::vector<cv::Point> points;
  points.reserve(line.size());
  for (const Eigen::Vector2d& pixel : line) {
    const cv::Point point = Fixed(pixel);
    if (points.empty() || points.back() != point) points.push_back(point);
  }
  if (points.size() < 2) return;
  const int width = std::max(1, static_cast<int>(std::lround(width_px * scale_)));
  cv::polylines(picture_, points, false, color, width, cv::LINE_AA, kShift);
}

void Painter::HaloUnder(const std::vector<Polyline2>& lines, double width_px) {
  for (const Polyline2& line : lines) Polyline(line, kHalo, width_px);
}

void Painter::Lines(const std::vector<Polyline2>& lines, const cv::Scalar& color, double width_px,
                    bool dashed) {
  for (const Polyline2& line : lines) {
    if (!dashed) {
      Polyline(line, color, width_px);
      continue;
    }
    for (const Polyline2& dash : Dashes(line, kDashPx * scale_)) Polyline(dash, color, width_px);
  }
}

void Painter::Feature(const Eigen::Vector2d& at, FeatureState state, bool fixated) {
  const double r = (fixated ? 5.0 : 3.5) * scale_;
  const cv::Point centre = Fixed(at);
  const int radius = static_cast<int>(std::lround(r * (1 << kShift)));
  const auto ring = [&](const cv::Scalar& color, double width) {
    cv::circle(picture_, centre, radius, color,
               std::max(1, static_cast<int>(std::lround(width * scale_))), cv::LINE_AA, kShift);
  };
  const cv::Scalar color = fixated                            ? kFixatedColor
                           : state == FeatureState::kMeasured ? kMeasuredColor
                           : state == FeatureState::kFailed   ? kFailedColor
                                                              : kNotAttemptedColor;
  if (state == FeatureState::kFailed) {
    const std::vector<Polyline2> cross = {
        {at + Eigen::Vector2d(-r, -r), at + Eigen::Vector2d(r, r)},
        {at + Eigen::Vector2d(r, -r), at + Eigen::Vector2d(-r, r)}};
    HaloUnder(cross, 4);
    Lines(cross, color, 2, false);
  } else {
    ring(kHalo, state == FeatureState::kMeasured ? 3 : 4);
    if (state == FeatureState::kMeasured) {
      cv::circle(picture_, centre, radius, color, cv::FILLED, cv::LINE_AA, kShift);
    } else {
      ring(color, 2);
    }
  }
}

void Painter::Box(const Eigen::Vector2d& at, const std::string& text, const cv::Scalar& color,
                  bool dashed) {
  const std::string words = Ascii(text);
  const double font = 0.45 * scale_;
  int baseline = 0;
  const cv::Size size = cv::getTextSize(words, kFont, font, 1, &baseline);
  const double width = size.width + 12 * scale_;
  const double height = 21 * scale_;
  const Eigen::Vector2d corner = at + Eigen::Vector2d(6 * scale_, -4 * scale_ - height);
  const cv::Rect box(static_cast<int>(corner.x()), static_cast<int>(corner.y()),
                     static_cast<int>(width), static_cast<int>(height));
  const cv::Rect inside = box & cv::Rect(0, 0, picture_.cols, picture_.rows);
  if (inside.area() > 0) picture_(inside).setTo(kBoxFill);
  const Eigen::Vector2d right(width, 0), down(0, height);
  Lines({{corner, corner + right, corner + right + down, corner + down, corner}}, color, 1.5,
        dashed);
  const cv::Point origin(static_cast<int>(corner.x() + 6 * scale_),
                         static_cast<int>(corner.y() + 0.5 * (height + size.height)));
  cv::putText(picture_, words, origin, kFont, font, color,
              std::max(1, static_cast<int>(std::lround(scale_))), cv::LINE_AA);
}

void Painter::Text(const Eigen::Vector2d& at, const std::string& text, const cv::Scalar& color) {
  const cv::Point origin(static_cast<int>(at.x()), static_cast<int>(at.y()));
  const double font = 0.45 * scale_;
  const int width = std::max(1, static_cast<int>(std::lround(scale_)));
  cv::putText(picture_, Ascii(text), origin, kFont, font, kHalo, 3 * width, cv::LINE_AA);
  cv::putText(picture_, Ascii(text), origin, kFont, font, color, width, cv::LINE_AA);
}

void Painter::EdgeArrow(const Eigen::Vector2d& tip, const Eigen::Vector2d& direction,
                        const cv::Scalar& color, bool hollow) {
  const Eigen::Vector2d back = tip - 18 * scale_ * direction;
  const Eigen::Vector2d side = 10 * scale_ * Eigen::Vector2d(-direction.y(), direction.x());
  const Polyline2 outline = {tip, back + side, back - side, tip};
  Polyline(outline, kHalo, 6);
  if (!hollow) {
    const std::vector<cv::Point> triangle = {Fixed(tip), Fixed(back + side), Fixed(back - side)};
    cv::fillConvexPoly(picture_, triangle, color, cv::LINE_AA, kShift);
  }
  Polyline(outline, color, 2);
}

void Painter::Status(const std::string& text, bool warn) {
  const std::string words = Ascii(text);
  const int height = static_cast<int>(28 * scale_);
  const cv::Rect band = cv::Rect(0, picture_.rows - height, picture_.cols, height) &
                        cv::Rect(0, 0, picture_.cols, picture_.rows);
  if (band.area() == 0) return;
  cv::Mat under = picture_(band);
  under.convertTo(under, -1, 0.35);
  double font = 0.55 * scale_;
  int baseline = 0;
  const int thick = std::max(1, static_cast<int>(std::lround(1.5 * scale_)));
  const int wide = cv::getTextSize(words, kFont, font, thick, &baseline).width;
  const double room = picture_.cols - 20 * scale_;
  if (wide > room) font *= room / wide;
  const cv::Point origin(static_cast<int>(10 * scale_),
                         picture_.rows - static_cast<int>(9 * scale_));
  const cv::Scalar color = warn ? cv::Scalar(120, 190, 255) : cv::Scalar(255, 255, 255);
  cv::putText(picture_, words, origin, kFont, font, color, thick, cv::LINE_AA);
}

}  // namespace saccade
