#include "server/overlay/painter.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "server/overlay/text_painter.hpp"

namespace saccade {
namespace {

constexpr int kShift = 4;  // OpenCV takes coordinates in sixteenths of a pixel
constexpr double kDashPx = 5.0;
const cv::Scalar kHalo{24, 22, 20};
constexpr int kSmallestLetters_px = 11;
constexpr int kStatusLines = 2;

cv::Point Fixed(const Eigen::Vector2d& pixel) {
  return {static_cast<int>(std::lround(pixel.x() * (1 << kShift))),
          static_cast<int>(std::lround(pixel.y() * (1 << kShift)))};
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

void Painter::Laser(const Eigen::Vector2d& at, const cv::Scalar& color) {
  const auto disc = [&](double radius_px, const cv::Scalar& filled) {
    cv::circle(picture_, Fixed(at),
               static_cast<int>(std::lround(radius_px * scale_ * (1 << kShift))), filled,
               cv::FILLED, cv::LINE_AA, kShift);
  };
  disc(7.0, kHalo);
  disc(4.0, color);
  disc(1.5, {255, 255, 255});
}

void Painter::Text(const Eigen::Vector2d& at, const std::string& text, const cv::Scalar& color) {
  TextStyle style;
  style.layout = {std::max(kSmallestLetters_px, cvRound(14 * scale_)), 1e9, 1};
  style.color = color;
  style.ground = TextGround::kHalo;
  style.margin_px = cvRound(3 * scale_);
  const auto sprite = TextPainter::OfThisThread().Sprite("", text, style);
  const cv::Point corner(static_cast<int>(at.x()) - style.margin_px,
                         static_cast<int>(at.y()) - sprite->baseline_px);
  TextPainter::Lay(*sprite, corner, picture_);
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
  TextStyle style;
  style.layout = {std::max(kSmallestLetters_px, cvRound(16 * scale_)),
                  std::floor(picture_.cols - 20 * scale_), kStatusLines};
  style.color = warn ? cv::Scalar(120, 190, 255) : cv::Scalar(255, 255, 255);
  const auto sprite = TextPainter::OfThisThread().Sprite("", text, style);
  const int height = sprite->pixels.rows + cvRound(8 * scale_);
  const cv::Rect band = cv::Rect(0, picture_.rows - height, picture_.cols, height) &
                        cv::Rect(0, 0, picture_.cols, picture_.rows);
  if (band.area() == 0) return;
  cv::Mat under = picture_(band);
  under.convertTo(under, -1, 0.35);
  const cv::Point corner(cvRound(10 * scale_),
                         picture_.rows - sprite->pixels.rows - cvRound(5 * scale_));
  TextPainter::Lay(*sprite, corner, picture_);
}

}  // namespace saccade
