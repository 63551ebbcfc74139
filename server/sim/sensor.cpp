#include "server/sim/sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace saccade {
namespace {

constexpr std::size_t kNormals = std::size_t{1} << 20;

std::uint64_t Hash(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

}  // namespace

Sensor::Sensor(const SimOptions& options) : options_(options) {
  const double cx = 0.5 * (options.width - 1), cy = 0.5 * (options.height - 1);
  vignette_.reserve(static_cast<std::size_t>(options.width) *
                    static_cast<std::size_t>(options.height));
  for (int v = 0; v < options.height; ++v) {
    for (int u = 0; u < options.width; ++u) {
      const double r2 = ((u - cx) * (u - cx) + (v - cy) * (v - cy)) / (cx * cx + cy * cy);
      vignette_.push_back(
          static_cast<std::uint16_t>(std::lround(1024.0 * (1 - options.vignetting * r2 * r2))));
    }
  }
  // Box-Muller on our own bits: the standard library's distributions differ between makers.
  normal_.resize(kNormals);
  for (std::size_t i = 0; i < kNormals; i += 2) {
    const std::uint64_t bits = Hash(options.seed * 0x9e3779b97f4a7c15ULL + i + 1);
    const double a = (static_cast<double>(bits >> 40) + 0.5) * 0x1.0p-24;
    const double b = static_cast<double>(bits & 0xffffff) * 0x1.0p-24;
    const double radius = 32.0 * std::sqrt(-2.0 * std::log(a));
    const double angle = 2.0 * std::numbers::pi * b;
    const auto clip = [](double x) {
      return static_cast<std::int8_t>(std::lround(std::clamp(x, -125.0, 125.0)));
    };
    normal_[i] = clip(radius * std::cos(angle));
    normal_[i + 1] = clip(radius * std::sin(angle));
  }
}

double Sensor::Gain(std::uint64_t frame) const {
  if (options_.auto_exposure != SimExposure::kDrift) return 1.0;
  const double t = static_cast<double>(frame) / options_.fps;
  const auto phase = static_cast<double>(Hash(options_.seed + 77) % 628) * 0.01;
  return 1.0 + 0.06 * std::sin(0.35 * t + phase) + 0.025 * std::sin(1.9 * t + 2 * phase) -
         0.06 * std::sin(phase) - 0.025 * std::sin(2 * phase);
}

void Sensor::Apply(std::uint64_t frame, const cv::Vec3d& gain, bool with_noise,
                   cv::Mat& bgr) const {
  std::array<std::uint32_t, 3> gains{};
  for (int c = 0; c < 3; ++c) gains[c] = static_cast<std::uint32_t>(std::lround(1024.0 * gain[c]));
  // Variance: a third of it is read noise, the rest grows with the light (shot noise).
  std::array<std::int32_t, 256> sigma{};  // * 256
  for (std::size_t i = 0; i < sigma.size(); ++i) {
    const double variance = 1.0 / 3.0 + 2.0 / 3.0 * static_cast<double>(i) / 128.0;
    sigma[i] =
        with_noise
            ? static_cast<std::int32_t>(std::lround(256.0 * options_.noise * std::sqrt(variance)))
            : 0;
  }
  const auto width = static_cast<std::size_t>(bgr.cols);
  for (int v = 0; v < bgr.rows; ++v) {
    auto* pixel = bgr.ptr<std::uint8_t>(v);
    const std::uint16_t* vignette = &vignette_[static_cast<std::size_t>(v) * width];
    const std::uint64_t row =
        (options_.seed << 40) ^ (frame * 4096 + static_cast<std::uint64_t>(v));
    const std::int8_t* noise = &normal_[Hash(row + 1) % (kNormals - 3 * width)];
    for (std::size_t u = 0; u < width; ++u) {
      for (int c = 0; c < 3; ++c, ++pixel, ++noise) {
        const std::uint32_t factor = (gains[c] * vignette[u]) >> 10;
        const std::uint32_t light = std::min<std::uint32_t>((*pixel * factor + 512) >> 10, 255);
        const std::int32_t value =
            static_cast<std::int32_t>(light) + ((sigma[light] * *noise + 4096) >> 13);
        *pixel = static_cast<std::uint8_t>(std::clamp(value, 0, 255));
      }
    }
  }
}

}  // namespace saccade
