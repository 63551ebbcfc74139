#include "server/markers/square_search.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace saccade {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kFewestSamples = 5, kMostSamples = 10;
constexpr double kSampleEvery_px = 5.0;
constexpr double kCornerShare = 0.14;   // of a side, at its ends, where two edges blur into one
constexpr double kGate = 3.0;           // sigmas
constexpr double kLeastRange_px = 2.5;  // lens and print are never exact
constexpr double kMostRange_px = 20.0;
constexpr double kBorderShare = 0.28;      // of a side: further in, the code has edges of its own
constexpr double kLeastSquareStep = 6.0;   // grey levels a pixel, at the edge
constexpr double kLeastSquareShare = 0.6;  // of a line's samples, that must agree
constexpr double kSigma_px = 0.05;         // of one sample: what paper, lens and JPEG leave
constexpr double kOutlier_px = 0.6;
constexpr double kShortest_px = 12.0;  // of a side
constexpr int kCells = 7;              // a side, at which a square's inside is looked at
constexpr double kLeastCode = 18.0;    // grey levels from its darkest to its brightest

/// Derivative of a Gaussian of sigma 1, half of it; odd.
constexpr std::array<double, 4> kDerivative = {0.0, 0.2420, 0.1080, 0.0133};

/// x and y of an edge in the plane z = 1 of the camera times its focal lengths: lines are straight.
struct Plane {
  const CameraModel& camera;

  std::optional<Vector2d> From(const Vector2d& pixel) const {
    const auto ray = camera.Unproject(pixel);
    if (!ray || ray->z() < 1e-3) return std::nullopt;
    const auto& lens = camera.intrinsics();
    return Vector2d(lens.fx * ray->x() / ray->z(), lens.fy * ray->y() / ray->z());
  }
  std::optional<Vector2d> ToPixel(const Vector2d& point) const {
    const auto& lens = camera.intrinsics();
    return camera.Project(Vector3d(point.x() / lens.fx, point.y() / lens.fy, 1.0));
  }
};

/// Strongest step from bright to dark, walking by (dx, dy) from `from` - range .. + range steps;
/// to a fraction of a step.
std::optional<double> FindStep(const cv::Mat& grey, int x, int y, int dx, int dy, int range,
                               double& strength) {
  constexpr int kReach = static_cast<int>(kDerivative.size()) - 1;
  const int outer = range + kReach + 1;
  const int x0 = x - outer * dx, x1 = x + outer * dx, y0 = y - outer * dy, y1 = y + outer * dy;
  if (std::min(x0, x1) < 0 || std::min(y0, y1) < 0 || std::max(x0, x1) >= grey.cols ||
      std::max(y0, y1) >= grey.rows) {
    return std::nullopt;
  }
  const auto at = [&](int k) {
    return static_cast<double>(grey.at<std::uint8_t>(y + k * dy, x + k * dx));
  };
  std::array<double, 2 * static_cast<int>(kMostRange_px) + 8> slope{};
  const auto slope_at = [&](int k) {
    double sum = 0.0;
    for (int i = 1; i <= kReach; ++i) sum += kDerivative[i] * (at(k - i) - at(k + i));
    return sum;
  };
  for (int k = -range - 1; k <= range + 1; ++k) slope[k + range + 1] = slope_at(k);
  int best = 0;
  for (int k = 1; k <= 2 * range + 1; ++k) {
    const bool peak = slope[k] >= slope[k - 1] && slope[k] > slope[k + 1];
    if (peak && (best == 0 || slope[k] > slope[best])) best = k;
  }
  if (best == 0 || slope[best] < kLeastSquareStep) return std::nullopt;
  const double left = slope[best - 1], middle = slope[best], right = slope[best + 1];
  const double bend = left - 2.0 * middle + right;
  strength = middle;
  return best - range - 1 + (bend < 0.0 ? 0.5 * (left - right) / bend : 0.0);
}

/// n(al) . p = d, with the covariance of (al, d); p counted from `origin`.
struct Line {
  double angle = 0.0;
  double distance = 0.0;
  Matrix2d covariance = Matrix2d::Zero();

  Vector2d normal() const { return {std::cos(angle), std::sin(angle)}; }
  Vector2d turned() const { return {-std::sin(angle), std::cos(angle)}; }
};

std::optional<Line> FitLine(std::vector<Vector2d> points, int wanted) {
  const auto fewest = static_cast<std::size_t>(
      std::max(3.0, std::ceil(kLeastSquareShare * static_cast<double>(wanted))));
  Line line;
  while (points.size() >= fewest) {
    Vector2d mean = Vector2d::Zero();
    for (const Vector2d& point : points) mean += point;
    mean /= static_cast<double>(points.size());
    Matrix2d scatter = Matrix2d::Zero();
    for (const Vector2d& point : points) scatter += (point - mean) * (point - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Matrix2d> solver(scatter);
    const Vector2d normal = solver.eigenvectors().col(0);
    line.angle = std::atan2(normal.y(), normal.x());
    line.distance = line.normal().dot(mean);
    double squares = 0.0, worst = 0.0;
    std::size_t at = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double off = std::abs(line.normal().dot(points[k]) - line.distance);
      squares += off * off;
      if (off > worst) {
        worst = off;
        at = k;
      }
    }
    const double rms = std::sqrt(squares / static_cast<double>(points.size()));
    if (worst > std::max(kOutlier_px, 2.5 * rms) || rms > kOutlier_px) {
      points.erase(points.begin() + static_cast<std::ptrdiff_t>(at));
      continue;
    }
    const double variance =
        std::max(kSigma_px * kSigma_px, squares / std::max(1.0, points.size() - 2.0));
    Matrix2d information = Matrix2d::Zero();
    for (const Vector2d& point : points) {
      const Vector2d row(line.turned().dot(point), -1.0);
      information += row * row.transpose() / variance;
    }
    line.covariance = information.inverse();
    if (!line.covariance.allFinite()) return std::nullopt;
    return line;
  }
  return std::nullopt;
}

std::optional<SearchedCorner> Meet(const Line& a, const Line& b, const Vector2d& origin,
                                   const Plane& plane) {
  Matrix2d normals;
  normals << a.normal().transpose(), b.normal().transpose();
  if (std::abs(normals.determinant()) < 0.1) return std::nullopt;  // 6 deg
  const Matrix2d inverse = normals.inverse();
  const Vector2d point = inverse * Vector2d(a.distance, b.distance);
  Matrix2d covariance = Matrix2d::Zero();
  const std::array<const Line*, 2> lines = {&a, &b};
  for (int k = 0; k < 2; ++k) {
    Matrix2d by;  // (angle, distance)
    by.col(0) = -inverse.col(k) * lines[k]->turned().dot(point);
    by.col(1) = inverse.col(k);
    covariance += by * lines[k]->covariance * by.transpose();
  }
  const auto pixel = plane.ToPixel(origin + point);
  if (!pixel) return std::nullopt;
  return SearchedCorner{*pixel, covariance};
}

/// The line through side `k`, searched outwards in.
std::optional<Line> SearchSide(const cv::Mat& grey, const Plane& plane, const SquareGuess& guess,
                               const std::array<Vector2d, 4>& straight, const Vector2d& origin,
                               int k) {
  const int next = (k + 1) % 4;
  const Vector2d from = straight[k] - origin, to = straight[next] - origin;
  const double length = (to - from).norm();
  if (length < kShortest_px) return std::nullopt;
  Vector2d inwards(-(to - from).y(), (to - from).x());
  inwards /= length;
  if (inwards.dot(0.5 * (from + to)) > 0.0) inwards = -inwards;  // the origin is inside
  const int samples =
      std::clamp(static_cast<int>(length / kSampleEvery_px), kFewestSamples, kMostSamples);
  // The nearest of 8 directions.
  const double angle = std::atan2(inwards.y(), inwards.x());
  const double nearest = std::round(angle / (0.25 * M_PI)) * 0.25 * M_PI;
  const int dx = static_cast<int>(std::round(std::cos(nearest) * 1.2));
  const int dy = static_cast<int>(std::round(std::sin(nearest) * 1.2));
  const Vector2d step(dx, dy);
  const double across = std::abs(inwards.dot(step));  // of a step, to the line
  std::vector<Vector2d> points;
  for (int i = 0; i < samples; ++i) {
    const double share =
        kCornerShare + (1.0 - 2.0 * kCornerShare) * (i + 0.5) / static_cast<double>(samples);
    const auto pixel = plane.ToPixel(origin + (1.0 - share) * from + share * to);
    if (!pixel || !pixel->allFinite()) continue;
    const double variance = (1.0 - share) * inwards.dot(guess.covariances[k] * inwards) +
                            share * inwards.dot(guess.covariances[next] * inwards);
    const double range_px =
        std::min({kLeastRange_px + kGate * std::sqrt(std::max(0.0, variance)), kMostRange_px,
                  std::max(kLeastRange_px, kBorderShare * length)});
    const int x = static_cast<int>(std::lround(pixel->x()));
    const int y = static_cast<int>(std::lround(pixel->y()));
    const int range = std::max(2, static_cast<int>(std::ceil(range_px / across)));
    if (range > static_cast<int>(kMostRange_px)) continue;
    double strength = 0.0;
    const auto at = FindStep(grey, x, y, dx, dy, range, strength);
    if (!at) continue;
    const auto point = plane.From(Vector2d(x, y) + *at * step);
    if (point) points.push_back(*point - origin);
  }
  return FitLine(std::move(points), samples);
}

/// Whether there is a code where the square should be: what covers it is even.
bool ShowsCode(const cv::Mat& grey, const SquareGuess& guess) {
  int darkest = 255, brightest = 0;
  for (int i = 1; i <= kCells; ++i) {
    for (int j = 1; j <= kCells; ++j) {
      const double u = i / (kCells + 1.0), v = j / (kCells + 1.0);
      const Vector2d at = (1 - v) * ((1 - u) * guess.corners[0] + u * guess.corners[1]) +
                          v * ((1 - u) * guess.corners[3] + u * guess.corners[2]);
      const int x = static_cast<int>(std::lround(at.x())),
                y = static_cast<int>(std::lround(at.y()));
      if (x < 0 || y < 0 || x >= grey.cols || y >= grey.rows) continue;
      const int level = grey.at<std::uint8_t>(y, x);
      darkest = std::min(darkest, level);
      brightest = std::max(brightest, level);
    }
  }
  return brightest - darkest > kLeastCode;
}

}  // namespace

int SquareSearch::found() const {
  return static_cast<int>(std::count_if(corners.begin(), corners.end(),
                                        [](const auto& corner) { return corner.has_value(); }));
}

SquareSearch SearchSquare(const cv::Mat& grey, const CameraModel& camera,
                          const SquareGuess& guess) {
  SquareSearch result;
  if (!ShowsCode(grey, guess)) return result;
  const Plane plane{camera};
  std::array<Vector2d, 4> straight;
  Vector2d origin = Vector2d::Zero();
  for (int k = 0; k < 4; ++k) {
    const auto point = plane.From(guess.corners[k]);
    if (!point) return result;
    straight[k] = *point;
    origin += 0.25 * *point;
  }
  std::array<std::optional<Line>, 4> lines;
  for (int k = 0; k < 4; ++k) {
    lines[k] = SearchSide(grey, plane, guess, straight, origin, k);
    result.lines += lines[k] ? 1 : 0;
  }
  for (int k = 0; k < 4; ++k) {
    const auto &before = lines[(k + 3) % 4], &after = lines[k];
    if (before && after) result.corners[k] = Meet(*before, *after, origin, plane);
  }
  return result;
}

SquareSearch SearchSquareTwice(const cv::Mat& grey, const CameraModel& camera,
                               const SquareGuess& guess) {
  SquareSearch first = SearchSquare(grey, camera, guess);
  if (first.found() < 4) return first;
  SquareGuess better;
  for (int k = 0; k < 4; ++k) {
    better.corners[k] = first.corners[k]->pixel;
    better.covariances[k] = Matrix2d::Zero();
  }
  return SearchSquare(grey, camera, better);
}

}  // namespace saccade
