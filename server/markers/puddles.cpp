#include "server/markers/puddles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace saccade {
namespace {

struct Basin {
  std::int32_t bottom = 0;
  int level = 0;
  double area = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;

  void Take(const Basin& other) {
    area += other.area;
    x += other.x;
    y += other.y;
    xx += other.xx;
    yy += other.yy;
    xy += other.xy;
  }
};

/// Area over what a filled parallelogram with its second moments would have.
double Compactness(const Basin& basin) {
  const double mx = basin.x / basin.area, my = basin.y / basin.area;
  const double unit = 1.0 / 12;  // of a pixel by itself
  const double cxx = basin.xx / basin.area - mx * mx + unit;
  const double cyy = basin.yy / basin.area - my * my + unit;
  const double cxy = basin.xy / basin.area - mx * my;
  const double spread = 12 * std::sqrt(std::max(1e-9, cxx * cyy - cxy * cxy));
  return std::min(1.0, basin.area / spread);
}

class Flood {
 public:
  Flood(const cv::Mat& grey, const PuddleOptions& options)
      : grey_(grey),
        options_(options),
        width_(grey.cols),
        parent_(static_cast<std::size_t>(grey.rows) * grey.cols, -1),
        basin_of_(parent_.size(), -1) {}

  std::vector<Puddle> Run() {
    const std::vector<std::int32_t> order = ByLevel();
    for (const std::int32_t pixel : order) Wet(pixel);
    if (!order.empty()) Note(basins_[basin_of_[Root(order.front())]], LevelOf(order.back()));
    return std::move(puddles_);
  }

 private:
  int LevelOf(std::int32_t pixel) const { return grey_.ptr(pixel / width_)[pixel % width_]; }

  std::vector<std::int32_t> ByLevel() const {
    std::array<std::int32_t, 257> start{};
    for (int y = 0; y < grey_.rows; ++y) {
      const std::uint8_t* row = grey_.ptr(y);
      for (int x = 0; x < width_; ++x) ++start[row[x] + 1];
    }
    std::partial_sum(start.begin(), start.end(), start.begin());
    std::vector<std::int32_t> order(parent_.size());
    for (int y = 0; y < grey_.rows; ++y) {
      const std::uint8_t* row = grey_.ptr(y);
      for (int x = 0; x < width_; ++x) order[start[row[x]]++] = y * width_ + x;
    }
    return order;
  }

  std::int32_t Root(std::int32_t pixel) {
    while (parent_[pixel] != pixel) {
      parent_[pixel] = parent_[parent_[pixel]];
      pixel = parent_[pixel];
    }
    return pixel;
  }

  void Note(const Basin& basin, int level) {
    Puddle puddle;
    puddle.bottom = {basin.bottom % width_, basin.bottom / width_};
    puddle.level = basin.level;
    puddle.depth = level - basin.level;
    puddle.area_px = static_cast<int>(basin.area);
    puddle.compactness = Compactness(basin);
    puddles_.push_back(puddle);
  }

  bool Counts(const Basin& basin, int level) const {
    return level - basin.level >= options_.least_depth && basin.area >= options_.least_area_px;
  }

  /// Two basins meet at `pixel`'s level: the shallower one ends, and is noted if it is one at all.
  std::int32_t Meet(std::int32_t a, std::int32_t b, int level) {
    Basin& first = basins_[basin_of_[a]];
    Basin& second = basins_[basin_of_[b]];
    if (Counts(first, level) && Counts(second, level)) {
      Note(first, level);
      Note(second, level);
    }
    const bool a_is_larger = first.area >= second.area;
    const bool a_is_deeper = first.level <= second.level;
    Basin& kept = a_is_larger ? first : second;
    const Basin& ended = a_is_larger ? second : first;
    const Basin& deeper = a_is_deeper ? first : second;
    const std::int32_t bottom = deeper.bottom;
    const int lowest = deeper.level;
    kept.Take(ended);
    kept.bottom = bottom;
    kept.level = lowest;
    const std::int32_t root = a_is_larger ? a : b;
    parent_[a_is_larger ? b : a] = root;
    return root;
  }

  void Wet(std::int32_t pixel) {
    const int x = pixel % width_, y = pixel / width_, level = LevelOf(pixel);
    std::int32_t root = -1;
    const auto look = [&](std::int32_t other) {
      if (parent_[other] < 0) return;
      const std::int32_t there = Root(other);
      if (root < 0) {
        root = there;
      } else if (there != root) {
        root = Meet(root, there, level);
      }
    };
    if (x > 0) look(pixel - 1);
    if (x + 1 < width_) look(pixel + 1);
    if (y > 0) look(pixel - width_);
    if (y + 1 < grey_.rows) look(pixel + width_);
    if (root < 0) {
      root = pixel;
      basin_of_[pixel] = static_cast<std::int32_t>(basins_.size());
      basins_.push_back({pixel, level});
    }
    parent_[pixel] = root;
    Basin& basin = basins_[basin_of_[root]];
    const double dx = x, dy = y;
    basin.Take({0, 0, 1, dx, dy, dx * dx, dy * dy, dx * dy});
  }

  const cv::Mat& grey_;
  const PuddleOptions& options_;
  int width_;
  std::vector<std::int32_t> parent_, basin_of_;
  std::vector<Basin> basins_;
  std::vector<Puddle> puddles_;
};

}  // namespace

std::vector<Puddle> FindPuddles(const cv::Mat& grey, const PuddleOptions& options) {
  if (grey.empty() || grey.type() != CV_8UC1) return {};
  std::vector<Puddle> puddles = Flood(grey, options).Run();
  const auto rank = [](const Puddle& puddle) { return puddle.depth * puddle.compactness; };
  std::stable_sort(puddles.begin(), puddles.end(),
                   [&](const Puddle& a, const Puddle& b) { return rank(a) > rank(b); });
  if (puddles.size() > static_cast<std::size_t>(options.most)) puddles.resize(options.most);
  return puddles;
}

}  // namespace saccade
