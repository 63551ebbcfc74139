#include "server/markers/square_region.hpp"

#include <algorithm>
#include <climits>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr int kLeastArea_px = 64;
constexpr double kMostOfPicture = 0.7;
// One cell of sixteen squares is always red, five can be; blur and shadow take some.
constexpr int kLeastRegionRedness = 22;
constexpr double kLeastRed = 0.015, kMostRed = 0.6;
constexpr double kLeastFill = 0.7;
constexpr int kSameThreshold = 6;
constexpr double kSimplify = 0.015, kLeastSimplify_px = 0.9, kMostSimplify_px = 3;
constexpr std::size_t kMostSides = 10;
constexpr double kLeastSide_px = 6;
constexpr double kInnerPixels_px = 0.5;  // from a pixel's centre to its outside

using Point = Eigen::Vector2d;

std::optional<Point> Crossing(const Point& a, const Point& b, const Point& c, const Point& d) {
  const Point first = b - a, second = d - c;
  const double sine = first.x() * second.y() - first.y() * second.x();
  if (std::abs(sine) < 0.05 * first.norm() * second.norm()) return std::nullopt;
  const Point between = c - a;
  return Point(a + first * (between.x() * second.y() - between.y() * second.x()) / sine);
}

double Cross(const Point& o, const Point& a, const Point& b) {
  return (a - o).x() * (b - o).y() - (a - o).y() * (b - o).x();
}

/// Area of a quadrilateral that is convex and clockwise as seen, else nothing.
std::optional<double> ConvexArea(const std::array<Point, 4>& q) {
  for (int k = 0; k < 4; ++k) {
    if (Cross(q[k], q[(k + 1) % 4], q[(k + 2) % 4]) <= 0) return std::nullopt;
  }
  return 0.5 * (Cross(q[0], q[1], q[2]) + Cross(q[0], q[2], q[3]));
}

std::vector<Point> SimplifiedHull(const std::vector<cv::Point>& points) {
  std::vector<cv::Point> hull, simple;
  cv::convexHull(points, hull);
  const double perimeter = cv::arcLength(hull, true);
  cv::approxPolyDP(hull, simple,
                   std::clamp(kSimplify * perimeter, kLeastSimplify_px, kMostSimplify_px), true);
  std::vector<Point> corners;
  for (const cv::Point& p : simple) corners.emplace_back(p.x, p.y);
  double twice = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Point &a = corners[k], &b = corners[(k + 1) % corners.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  if (twice < 0) std::reverse(corners.begin(), corners.end());
  return corners;
}

/// Each side moved out by this.
std::array<Point, 4> Widened(const std::array<Point, 4>& q, double by) {
  std::array<Point, 4> moved_from, moved_to, wide = q;
  for (int k = 0; k < 4; ++k) {
    const Point along = (q[(k + 1) % 4] - q[k]).normalized();
    const Point outward(along.y(), -along.x());
    moved_from[k] = q[k] + by * outward;
    moved_to[k] = q[(k + 1) % 4] + by * outward;
  }
  for (int k = 0; k < 4; ++k) {
    const int before = (k + 3) % 4;
    if (const auto corner =
            Crossing(moved_from[before], moved_to[before], moved_from[k], moved_to[k])) {
      wide[k] = *corner;
    }
  }
  return wide;
}

}  // namespace

std::optional<std::array<Point, 4>> FourSidesAbout(const std::vector<cv::Point>& points) {
  if (points.size() < 4) return std::nullopt;
  const std::vector<Point> hull = SimplifiedHull(points);
  const std::size_t n = hull.size();
  if (n < 4 || n > kMostSides) return std::nullopt;
  std::optional<std::array<Point, 4>> best;
  double least = 1e18;
  std::array<std::size_t, 4> side;
  for (side[0] = 0; side[0] < n; ++side[0])
    for (side[1] = side[0] + 1; side[1] < n; ++side[1])
      for (side[2] = side[1] + 1; side[2] < n; ++side[2])
        for (side[3] = side[2] + 1; side[3] < n; ++side[3]) {
          std::array<Point, 4> corners;
          bool meet = true;
          for (int k = 0; k < 4 && meet; ++k) {
            const std::size_t a = side[k], b = side[(k + 1) % 4];
            const auto corner = Crossing(hull[a], hull[(a + 1) % n], hull[b], hull[(b + 1) % n]);
            meet = corner.has_value();
            if (meet) corners[(k + 1) % 4] = *corner;
          }
          const auto area = meet ? ConvexArea(corners) : std::nullopt;
          if (!area || *area >= least) continue;
          least = *area;
          best = corners;
        }
  if (!best) return std::nullopt;
  best = Widened(*best, kInnerPixels_px);
  for (int k = 0; k < 4; ++k) {
    if (((*best)[(k + 1) % 4] - (*best)[k]).norm() < kLeastSide_px) return std::nullopt;
  }
  return best;
}

RegionGrower::RegionGrower(const cv::Mat& green, const cv::Mat& redness)
    : green_(green), redness_(redness), labels_(green.size(), CV_32SC1, cv::Scalar(-1)) {}

bool RegionGrower::SeenBefore(cv::Point seed, int threshold) const {
  const int label = labels_.at<int>(seed);
  if (label < 0) return false;
  const Grown& region = regions_[label];
  return std::abs(region.threshold - threshold) <= kSameThreshold ||
         (region.refused && region.threshold <= threshold);
}

RegionGrower::Grown RegionGrower::Flood(cv::Point seed, int threshold) {
  Grown region;
  region.threshold = threshold;
  const int label = static_cast<int>(regions_.size());
  const int most = static_cast<int>(kMostOfPicture * green_.cols * green_.rows);
  std::vector<std::array<int, 2>> rows(green_.rows, {INT_MAX, INT_MIN});
  std::vector<cv::Point> open = {seed};
  int top = green_.rows, bottom = -1;
  labels_.at<int>(seed) = label;
  while (!open.empty()) {
    const cv::Point p = open.back();
    open.pop_back();
    if (p.x == 0 || p.y == 0 || p.x == green_.cols - 1 || p.y == green_.rows - 1) return region;
    if (++region.area > most) return region;
    region.red += redness_.at<std::uint8_t>(p) >= kLeastRegionRedness;
    top = std::min(top, p.y);
    bottom = std::max(bottom, p.y);
    rows[p.y] = {std::min(rows[p.y][0], p.x), std::max(rows[p.y][1], p.x)};
    for (const cv::Point step :
         {cv::Point(1, 0), cv::Point(-1, 0), cv::Point(0, 1), cv::Point(0, -1)}) {
      const cv::Point next = p + step;
      int& at = labels_.at<int>(next);
      if (at == label || green_.at<std::uint8_t>(next) >= threshold) continue;
      if (at >= 0 && regions_[at].refused && regions_[at].threshold <= threshold) return region;
      at = label;
      open.push_back(next);
    }
  }
  region.refused = false;
  region.top = top;
  region.rows.assign(rows.begin() + top, rows.begin() + bottom + 1);
  return region;
}

std::optional<SquareRegion> RegionGrower::Grow(cv::Point seed, int threshold) {
  if (green_.at<std::uint8_t>(seed) >= threshold || SeenBefore(seed, threshold)) {
    return std::nullopt;
  }
  regions_.push_back(Flood(seed, threshold));
  const Grown& region = regions_.back();
  if (region.refused || region.area < kLeastArea_px) return std::nullopt;
  const double red = static_cast<double>(region.red) / region.area;
  if (red < kLeastRed || red > kMostRed) return std::nullopt;
  std::vector<cv::Point> ends;
  for (std::size_t k = 0; k < region.rows.size(); ++k) {
    const int y = region.top + static_cast<int>(k);
    ends.emplace_back(region.rows[k][0], y);
    ends.emplace_back(region.rows[k][1], y);
  }
  const auto corners = FourSidesAbout(ends);
  if (!corners) return std::nullopt;
  const double fill = region.area / *ConvexArea(*corners);
  if (fill < kLeastFill) return std::nullopt;
  return SquareRegion{*corners, fill};
}

}  // namespace saccade
