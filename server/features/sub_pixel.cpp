#include "server/features/sub_pixel.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace saccade {
namespace {

constexpr int kLanes = 16;            // floats in a row of the template's inside, padded
constexpr int kInside = 13;           // largest inside: the template without its border
constexpr int kRegion = kInside + 6;  // picture around the start that a step may need
constexpr int kRegionStride = 40;
constexpr double kMaxShift = 1.5;    // [px]
constexpr double kConverged = 0.02;  // [px]

using Row = Eigen::Map<const Eigen::Array<float, Eigen::Dynamic, 1>>;

/// Gradients x, y, the template itself (less its mean) and a constant, at the inside pixels.
struct Basis {
  int inside = 0;
  double mean = 0.0;
  alignas(32) std::array<std::array<float, kInside * kLanes>, 4> rows{};
  Eigen::Matrix4d inverse;
  bool regular = false;

  explicit Basis(const CorrelationTemplate& templ) : inside(templ.size - 2) {
    constexpr int kStride = CorrelationTemplate::kStride;
    mean = static_cast<double>(templ.sum) / (templ.size * templ.size);
    for (int v = 0; v < inside; ++v) {
      for (int u = 0; u < inside; ++u) {
        const std::int16_t* p = templ.pixels.data() + (v + 1) * kStride + u + 1;
        const int k = v * kLanes + u;
        rows[0][k] = 0.5F * static_cast<float>(p[1] - p[-1]);
        rows[1][k] = 0.5F * static_cast<float>(p[kStride] - p[-kStride]);
        rows[2][k] = static_cast<float>(p[0]) - static_cast<float>(mean);
        rows[3][k] = 1.0F;
      }
    }
    Eigen::Matrix4d normal;
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b <= a; ++b) {
        normal(a, b) = normal(b, a) = Dot(rows[a], rows[b]);
      }
    }
    const Eigen::LDLT<Eigen::Matrix4d> factors(normal);
    // A flat or one-directional template has no position.
    regular = factors.info() == Eigen::Success && factors.vectorD().minCoeff() > 1e-3 * inside;
    if (regular) inverse = factors.solve(Eigen::Matrix4d::Identity());
  }

  double Dot(const std::array<float, kInside * kLanes>& a,
             const std::array<float, kInside * kLanes>& b) const {
    const int count = inside * kLanes;
    return (Row(a.data(), count) * Row(b.data(), count)).sum();
  }
};

/// The picture around the start as floats; beyond the border the edge repeats.
struct Region {
  int left = 0, top = 0, size = 0;
  alignas(32) std::array<float, kRegion * kRegionStride> pixels{};

  Region(const cv::Mat& image, int inside, int centre_x, int centre_y)
      : left(centre_x - inside / 2 - 2), top(centre_y - inside / 2 - 2), size(inside + 5) {
    for (int y = 0; y < size; ++y) {
      const std::uint8_t* row = image.ptr<std::uint8_t>(std::clamp(top + y, 0, image.rows - 1));
      for (int x = 0; x < size; ++x) {
        pixels[y * kRegionStride + x] =
            static_cast<float>(row[std::clamp(left + x, 0, image.cols - 1)]);
      }
    }
  }

  /// Picture around `centre`, between pixels, into the layout of the basis (padding stays 0).
  void Sample(const Eigen::Vector2d& centre, int inside,
              std::array<float, kInside * kLanes>& out) const {
    const double x = centre.x() - inside / 2 - left;
    const double y = centre.y() - inside / 2 - top;
    const int ix = std::clamp(static_cast<int>(std::floor(x)), 0, size - inside - 1);
    const int iy = std::clamp(static_cast<int>(std::floor(y)), 0, size - inside - 1);
    const float fx = static_cast<float>(x - ix);
    const float fy = static_cast<float>(y - iy);
    const float w00 = (1 - fx) * (1 - fy), w10 = fx * (1 - fy), w01 = (1 - fx) * fy, w11 = fx * fy;
    for (int v = 0; v < inside; ++v) {
      const float* __restrict p = pixels.data() + (iy + v) * kRegionStride + ix;
      const float* __restrict q = p + kRegionStride;
      float* __restrict o = out.data() + v * kLanes;
      for (int u = 0; u < kLanes; ++u) {
        o[u] = w00 * p[u] + w10 * p[u + 1] + w01 * q[u] + w11 * q[u + 1];
      }
      std::fill(o + inside, o + kLanes, 0.0F);
    }
  }
};

}  // namespace

Alignment AlignTemplate(const cv::Mat& image, const CorrelationTemplate& templ,
                        const Eigen::Vector2d& start, int max_iterations) {
  Alignment result;
  result.pixel = start;
  result.covariance = Eigen::Matrix2d::Identity() * std::numeric_limits<double>::infinity();
  const Basis basis(templ);
  if (!basis.regular || !start.allFinite()) return result;
  const Region region(image, basis.inside, static_cast<int>(std::lround(start.x())),
                      static_cast<int>(std::lround(start.y())));
  alignas(32) std::array<float, kInside * kLanes> seen;
  const int count = basis.inside * basis.inside;
  Eigen::Vector2d at = start;
  for (int iteration = 0; iteration <= max_iterations; ++iteration) {
    region.Sample(at, basis.inside, seen);
    Eigen::Vector4d projected;
    for (int a = 0; a < 4; ++a) projected[a] = basis.Dot(basis.rows[a], seen);
    const Eigen::Vector4d share = basis.inverse * projected;
    const double gain = share[2];
    if (!(gain > 0.05)) break;
    const double energy = basis.Dot(seen, seen) - share.dot(projected);
    const double variance = std::max(0.0, energy) / (count - 4);
    result.gain = gain;
    result.residual = std::sqrt(variance);
    result.covariance = variance / (gain * gain) * basis.inverse.topLeftCorner<2, 2>();
    const Eigen::Vector2d step = -share.head<2>() / gain;
    if (iteration == max_iterations) break;
    at += step;
    if ((at - start).lpNorm<Eigen::Infinity>() > kMaxShift) break;
    if (step.norm() < kConverged) {
      result.converged = true;
      result.pixel = at;
      break;
    }
  }
  return result;
}

}  // namespace saccade
