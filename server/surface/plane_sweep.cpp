#include "server/surface/plane_sweep.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace saccade {
namespace {

constexpr int kSweepHalf = 2;  // of a window [px]
constexpr float kSweepWindow = (2 * kSweepHalf + 1) * (2 * kSweepHalf + 1);
constexpr float kSweepNoise = 1.0f;   // variance that sensors leave in a small picture [grey^2]
constexpr float kSweepUnseen = 4.0f;  // worse than any cost
constexpr int kSweepMostBest = 6;

/// Sums over windows, row by row.
class WindowSums {
 public:
  WindowSums(int width, int height) : width_(width), height_(height) {
    across_.resize(static_cast<std::size_t>(width) * height);
  }
  /// Row `y` of what is to be summed.
  void SetRow(int y, const float* row) {
    float* out = &across_[static_cast<std::size_t>(y) * width_];
    std::fill(out, out + kSweepHalf, 0.0f);
    std::fill(out + width_ - kSweepHalf, out + width_, 0.0f);
    for (int x = kSweepHalf; x < width_ - kSweepHalf; ++x) {
      out[x] = row[x - 2] + row[x - 1] + row[x] + row[x + 1] + row[x + 2];
    }
  }
  /// Sums around the pixels of row `y`, which is at least kSweepHalf from the edge.
  void Row(int y, float* sums) const {
    const float* a = &across_[static_cast<std::size_t>(y - kSweepHalf) * width_];
    const float *b = a + width_, *c = b + width_, *d = c + width_, *e = d + width_;
    for (int x = 0; x < width_; ++x) sums[x] = a[x] + b[x] + c[x] + d[x] + e[x];
  }

 private:
  int width_, height_;
  std::vector<float> across_;
};

struct Reference {
  explicit Reference(const SurfacePicture& picture)
      : width(picture.camera.width), height(picture.camera.height) {
    const std::size_t size = static_cast<std::size_t>(width) * height;
    mean.resize(size);
    variance.resize(size);
    WindowSums first(width, height), second(width, height);
    std::vector<float> squares(width);
    for (int y = 0; y < height; ++y) {
      const float* row = picture.grey.ptr<float>(y);
      for (int x = 0; x < width; ++x) squares[x] = row[x] * row[x];
      first.SetRow(y, row);
      second.SetRow(y, squares.data());
    }
    for (int y = kSweepHalf; y < height - kSweepHalf; ++y) {
      float* m = &mean[static_cast<std::size_t>(y) * width];
      float* v = &variance[static_cast<std::size_t>(y) * width];
      first.Row(y, m);
      second.Row(y, v);
      for (int x = 0; x < width; ++x) {
        m[x] /= kSweepWindow;
        v[x] = std::max(0.0f, v[x] / kSweepWindow - m[x] * m[x]);
      }
    }
  }
  int width, height;
  std::vector<float> mean, variance;
};

/// One view, warped onto the reference by one plane after the other.
class WarpedView {
 public:
  WarpedView(const SurfacePicture& reference, const SweepView& view)
      : reference_(reference),
        grey_(view.picture->grey),
        width_(reference.camera.width),
        height_(reference.camera.height),
        sums_(width_, height_),
        squares_(width_, height_),
        products_(width_, height_),
        inside_(static_cast<std::size_t>(width_) * height_),
        warped_(width_),
        row_(width_),
        u_(width_),
        v_(width_) {
    const Pinhole &from = reference.camera, &to = view.picture->camera;
    Eigen::Matrix3f unproject, project;
    unproject << 1.0f / from.focal_px, 0, -from.cx / from.focal_px, 0, 1.0f / from.focal_px,
        -from.cy / from.focal_px, 0, 0, 1;
    project << to.focal_px, 0, to.cx, 0, to.focal_px, to.cy, 0, 0, 1;
    turn_ = project * view.view_from_reference.RotationMatrix().cast<float>() * unproject;
    shift_ = project * view.view_from_reference.translation.cast<float>();
  }

  void Warp(float inverse_depth) {
    const Eigen::Vector3f shift = shift_ * inverse_depth;
    for (int y = 0; y < height_; ++y) {
      WarpRow(y, shift);
      const float* own = reference_.grey.ptr<float>(y);
      sums_.SetRow(y, warped_.data());
      for (int x = 0; x < width_; ++x) row_[x] = warped_[x] * warped_[x];
      squares_.SetRow(y, row_.data());
      for (int x = 0; x < width_; ++x) row_[x] = warped_[x] * own[x];
      products_.SetRow(y, row_.data());
    }
  }

  /// 1 - correlation of the windows of row `y`; kSweepUnseen outside the view.
  void Costs(int y, const Reference& reference, float* costs) {
    const float* mean = &reference.mean[static_cast<std::size_t>(y) * width_];
    const float* variance = &reference.variance[static_cast<std::size_t>(y) * width_];
    const float* inside = &inside_[static_cast<std::size_t>(y) * width_];
    sums_.Row(y, u_.data());
    squares_.Row(y, v_.data());
    products_.Row(y, row_.data());
    for (int x = 0; x < width_; ++x) {
      const float m = u_[x] / kSweepWindow;
      const float spread = std::max(0.0f, v_[x] / kSweepWindow - m * m);
      const float together = row_[x] / kSweepWindow - m * mean[x];
      const float correlation =
          together / std::sqrt((spread + kSweepNoise) * (variance[x] + kSweepNoise));
      costs[x] = inside[x] > 0.0f ? 1.0f - correlation : kSweepUnseen;
    }
  }

 private:
  void WarpRow(int y, const Eigen::Vector3f& shift) {
    const float fy = static_cast<float>(y);
    const float a = turn_(0, 1) * fy + turn_(0, 2) + shift.x();
    const float b = turn_(1, 1) * fy + turn_(1, 2) + shift.y();
    const float c = turn_(2, 1) * fy + turn_(2, 2) + shift.z();
    float* inside = &inside_[static_cast<std::size_t>(y) * width_];
    const float most_u = static_cast<float>(grey_.cols - 1 - kSweepHalf);
    const float most_v = static_cast<float>(grey_.rows - 1 - kSweepHalf);
    for (int x = 0; x < width_; ++x) {
      const float fx = static_cast<float>(x);
      const float z = turn_(2, 0) * fx + c;
      const float u = (turn_(0, 0) * fx + a) / z, v = (turn_(1, 0) * fx + b) / z;
      const bool in =
          (z > 0.05f) & (u >= kSweepHalf) & (v >= kSweepHalf) & (u < most_u) & (v < most_v);
      inside[x] = in ? 1.0f : 0.0f;
      u_[x] = in ? u : static_cast<float>(kSweepHalf);
      v_[x] = in ? v : static_cast<float>(kSweepHalf);
    }
    const std::size_t stride = grey_.step1();
    const float* pixels = grey_.ptr<float>();
    for (int x = 0; x < width_; ++x) {
      const int iu = static_cast<int>(u_[x]), iv = static_cast<int>(v_[x]);
      const float du = u_[x] - static_cast<float>(iu), dv = v_[x] - static_cast<float>(iv);
      const float* p = pixels + static_cast<std::size_t>(iv) * stride + iu;
      const float top = p[0] + du * (p[1] - p[0]);
      const float bottom = p[stride] + du * (p[stride + 1] - p[stride]);
      warped_[x] = top + dv * (bottom - top);
    }
    for (int x = 0; x < width_; ++x) inside[x] = warped_[x] >= 0.0f ? inside[x] : 0.0f;
  }

  const SurfacePicture& reference_;
  const cv::Mat& grey_;
  int width_, height_;
  Eigen::Matrix3f turn_;
  Eigen::Vector3f shift_;
  WindowSums sums_, squares_, products_;
  std::vector<float> inside_, warped_, row_, u_, v_;
};

/// The lowest costs of a row of pixels, over the views.
class BestHalf {
 public:
  BestHalf(int width, std::size_t views)
      : width_(width),
        count_(std::min<int>(kSweepMostBest, static_cast<int>(views + 1) / 2)),
        best_(static_cast<std::size_t>(width) * count_),
        seen_(width) {}
  void Clear() {
    std::fill(best_.begin(), best_.end(), kSweepUnseen);
    std::fill(seen_.begin(), seen_.end(), 0.0f);
  }
  void Add(std::vector<float>& costs) {  // which are spoilt
    for (int x = 0; x < width_; ++x) seen_[x] += costs[x] < kSweepUnseen ? 1.0f : 0.0f;
    for (int k = 0; k < count_; ++k) {
      float* best = &best_[static_cast<std::size_t>(k) * width_];
      for (int x = 0; x < width_; ++x) {
        const float low = std::min(best[x], costs[x]);
        costs[x] = std::max(best[x], costs[x]);
        best[x] = low;
      }
    }
  }
  /// Scaled; kUnrelated where fewer than two views see it.
  std::uint8_t Cost(int x) const {
    if (seen_[x] < 2.0f) return CostVolume::kUnrelated;
    float sum = 0.0f, count = 0.0f;
    for (int k = 0; k < count_; ++k) {
      const float cost = best_[static_cast<std::size_t>(k) * width_ + x];
      if (cost >= kSweepUnseen) break;
      sum += cost;
      count += 1.0f;
    }
    return static_cast<std::uint8_t>(
        std::clamp(CostVolume::kUnrelated * sum / count + 0.5f, 0.0f, 254.0f));
  }

 private:
  int width_, count_;
  std::vector<float> best_, seen_;
};

}  // namespace

CostVolume SweepViews(const SurfacePicture& picture, std::span<const SweepView> views,
                      const SweepPlanes& planes) {
  const Reference reference(picture);
  CostVolume volume;
  volume.width = reference.width;
  volume.height = reference.height;
  volume.planes = planes;
  volume.costs.assign(static_cast<std::size_t>(volume.width) * volume.height * planes.count,
                      CostVolume::kUnrelated);
  volume.deviation.create(volume.height, volume.width, CV_32F);
  for (int y = 0; y < volume.height; ++y) {
    for (int x = 0; x < volume.width; ++x) {
      volume.deviation.at<float>(y, x) =
          std::sqrt(reference.variance[static_cast<std::size_t>(y) * volume.width + x]);
    }
  }
  std::vector<WarpedView> warped;
  warped.reserve(views.size());
  for (const SweepView& view : views) warped.emplace_back(picture, view);
  BestHalf best(volume.width, views.size());
  std::vector<float> costs(volume.width);
  for (int k = 0; k < planes.count; ++k) {
    const float inverse_depth = planes.first + static_cast<float>(k) * planes.step;
    for (WarpedView& view : warped) view.Warp(inverse_depth);
    for (int y = kSweepHalf; y < volume.height - kSweepHalf; ++y) {
      best.Clear();
      for (WarpedView& view : warped) {
        view.Costs(y, reference, costs.data());
        best.Add(costs);
      }
      std::uint8_t* out =
          volume.costs.data() + static_cast<std::size_t>(y) * volume.width * planes.count + k;
      for (int x = kSweepHalf; x < volume.width - kSweepHalf; ++x) {
        out[static_cast<std::size_t>(x) * planes.count] = best.Cost(x);
      }
    }
  }
  return volume;
}

}  // namespace saccade
