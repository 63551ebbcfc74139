#include "server/markers/corner_look.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/markers/marker_detector.hpp"
#include "server/markers/marker_pattern.hpp"

namespace saccade {
namespace {

using Eigen::Vector2d;

constexpr int kAlong = 6;             // samples along a side, inside and outside
constexpr double kReachOfSide = 0.4;  // how far along it they go
constexpr double kOutside = 0.6;      // of the border's width: markers have a margin of one cell
constexpr double kLeastStep = 14.0;   // grey levels from the border to the paper
constexpr double kLeastShare = 0.75;  // of the samples on their side of the middle
constexpr double kLeastAway_px = 1.0;

double LevelAt(const cv::Mat& grey, const Vector2d& at) {
  const double x = std::clamp(at.x(), 0.0, grey.cols - 1.001);
  const double y = std::clamp(at.y(), 0.0, grey.rows - 1.001);
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const double a = x - column, b = y - row;
  const auto* top = grey.ptr<std::uint8_t>(row) + column;
  const auto* below = grey.ptr<std::uint8_t>(row + 1) + column;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * below[0] + a * below[1]);
}

double Median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Of one side that leaves the corner.
struct Side {
  std::vector<double> dark, bright;
};

Side Profile(const cv::Mat& grey, const Vector2d& corner, const Vector2d& along,
             const Vector2d& inwards, double border_share) {
  // `along` and `inwards` are the square's own sides: of its length, and as slanted as it is seen.
  const double inside = std::max(0.5 * border_share, kLeastAway_px / inwards.norm());
  const double outside = std::max(kOutside * border_share, kLeastAway_px / inwards.norm());
  Side side;
  for (int k = 0; k < kAlong; ++k) {
    const double share = inside + (kReachOfSide - inside) * k / (kAlong - 1.0);
    side.dark.push_back(LevelAt(grey, corner + share * along + inside * inwards));
    side.bright.push_back(LevelAt(grey, corner + share * along - outside * inwards));
  }
  return side;
}

bool IsEdge(const Side& side, double& dark, double& bright) {
  dark = Median(side.dark);
  bright = Median(side.bright);
  if (bright - dark < kLeastStep) return false;
  const double middle = 0.5 * (dark + bright);
  const auto below = std::count_if(side.dark.begin(), side.dark.end(),
                                   [&](double level) { return level < middle; });
  const auto above = std::count_if(side.bright.begin(), side.bright.end(),
                                   [&](double level) { return level > middle; });
  return static_cast<double>(std::min(below, above)) >= kLeastShare * kAlong;
}

}  // namespace

double BorderShare(absl::string_view family) {
  const auto pattern = PatternOf(std::string(family), 0);
  return pattern.ok() ? 1.0 / pattern->cells : 0.125;
}

CornerLook LookAtCorners(const cv::Mat& grey, const SquareGuess& guess, const SquareSearch& search,
                         double border_share) {
  CornerLook look;
  if (grey.type() != CV_8UC1 || grey.cols < 4 || grey.rows < 4) return look;
  Vector2d shift = Vector2d::Zero();
  for (int c = 0; c < 4; ++c) {
    if (search.corners[c]) shift += search.corners[c]->pixel - guess.corners[c];
  }
  if (search.found() > 0) shift /= search.found();
  std::array<Vector2d, 4> corners;
  for (int c = 0; c < 4; ++c) {
    corners[c] = search.corners[c] ? search.corners[c]->pixel : guess.corners[c] + shift;
    if (!corners[c].allFinite()) return look;
  }
  int seen = 0;
  for (int c = 0; c < 4; ++c) {
    const Vector2d next = corners[(c + 1) % 4] - corners[c];
    const Vector2d before = corners[(c + 3) % 4] - corners[c];
    double dark_a = 0, bright_a = 0, dark_b = 0, bright_b = 0;
    const bool edges =
        IsEdge(Profile(grey, corners[c], next, before, border_share), dark_a, bright_a) &&
        IsEdge(Profile(grey, corners[c], before, next, border_share), dark_b, bright_b);
    // Both sides are of one border on one paper.
    look.seen[c] = edges && std::max(dark_a, dark_b) < std::min(bright_a, bright_b);
    if (!look.seen[c]) continue;
    look.paper += 0.5 * (bright_a + bright_b);
    ++seen;
  }
  if (seen > 0) look.paper /= seen;
  return look;
}

}  // namespace saccade
