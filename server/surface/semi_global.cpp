#include "server/surface/semi_global.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

constexpr std::uint16_t kPathWall = 20'000;  // beyond the first and the last plane

/// Costs of the paths that come from one direction, for two rows of pixels.
class Paths {
 public:
  Paths(int width, int planes)
      : planes_(planes), stride_(planes + 2), rows_{Row(width), Row(width)} {}

  void NextRow() { std::swap(rows_[0], rows_[1]); }
  std::uint16_t* Now(int x) { return &rows_[0].costs[static_cast<std::size_t>(x) * stride_ + 1]; }
  std::uint16_t* Before(int x, int rows) {
    return &rows_[rows].costs[static_cast<std::size_t>(x) * stride_ + 1];
  }
  std::uint16_t& Least(int x, int rows) { return rows_[rows].least[x]; }

  void Begin(int x, const std::uint8_t* costs, std::uint16_t* sums) {
    std::uint16_t* now = Now(x);
    std::uint16_t least = kPathWall;
    for (int k = 0; k < planes_; ++k) {
      now[k] = costs[k];
      sums[k] = static_cast<std::uint16_t>(sums[k] + now[k]);
      least = std::min(least, now[k]);
    }
    Least(x, 0) = least;
  }

  void Go(int x, int from_x, int rows, int small_step, int large_step, const std::uint8_t* costs,
          std::uint16_t* sums) {
    const std::uint16_t* before = Before(from_x, rows);
    const std::uint16_t floor = Least(from_x, rows);
    const auto jump = static_cast<std::uint16_t>(floor + large_step);
    const auto step = static_cast<std::uint16_t>(small_step);
    std::uint16_t* now = Now(x);
    std::uint16_t least = kPathWall;
    for (int k = 0; k < planes_; ++k) {
      const auto down = static_cast<std::uint16_t>(before[k - 1] + step);
      const auto up = static_cast<std::uint16_t>(before[k + 1] + step);
      const std::uint16_t best = std::min(std::min(before[k], jump), std::min(down, up));
      const auto cost = static_cast<std::uint16_t>(costs[k] + best - floor);
      now[k] = cost;
      sums[k] = static_cast<std::uint16_t>(sums[k] + cost);
      least = std::min(least, cost);
    }
    Least(x, 0) = least;
  }

 private:
  struct RowOf {
    std::vector<std::uint16_t> costs, least;
  };
  RowOf Row(int width) const {
    return {std::vector<std::uint16_t>(static_cast<std::size_t>(width) * stride_, kPathWall),
            std::vector<std::uint16_t>(width)};
  }
  int planes_, stride_;
  RowOf rows_[2];
};

}  // namespace

std::vector<std::uint16_t> SumSemiGlobally(const CostVolume& volume, const cv::Mat& grey,
                                           const SmoothnessOptions& options) {
  std::vector<std::uint16_t> sums(volume.costs.size(), 0);
  const int width = volume.width, height = volume.height, planes = volume.planes.count;
  struct Direction {
    int dx, dy;  // where the path comes from, in the order of the pass
  };
  constexpr Direction kDirections[] = {{-1, 0}, {-1, -1}, {0, -1}, {1, -1}};
  for (const int sign : {1, -1}) {
    for (const Direction& direction : kDirections) {
      Paths paths(width, planes);
      const int dx = sign * direction.dx, dy = sign * direction.dy;
      for (int i = 0; i < height; ++i) {
        const int y = sign > 0 ? i : height - 1 - i;
        paths.NextRow();
        for (int j = 0; j < width; ++j) {
          const int x = sign > 0 ? j : width - 1 - j;
          const std::uint8_t* costs = volume.At(x, y);
          std::uint16_t* sum = sums.data() + (costs - volume.costs.data());
          const int from_x = x + dx, from_y = y + dy;
          if (from_x < 0 || from_x >= width || from_y < 0 || from_y >= height) {
            paths.Begin(x, costs, sum);
            continue;
          }
          const float edge = std::abs(grey.at<float>(y, x) - grey.at<float>(from_y, from_x));
          const int large = std::max(options.least_large_step,
                                     static_cast<int>(static_cast<float>(options.large_step) /
                                                      (1.0f + edge / options.edge)));
          paths.Go(x, from_x, direction.dy == 0 ? 0 : 1, options.small_step, large, costs, sum);
        }
      }
    }
  }
  return sums;
}

}  // namespace saccade
