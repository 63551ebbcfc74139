#include "server/sim/light_bake.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "server/sim/ray_caster.hpp"

namespace saccade {
namespace {

constexpr int kAtlasWidth = 512;
constexpr int kBounceRays = 40;
constexpr float kAmbient = 0.10f;    // light after the second bounce
constexpr float kOffset_m = 0.004f;  // rays start above the surface

/// Shelf packing, tall patches first.
cv::Size LayOut(std::vector<SurfacePatch>& patches) {
  std::vector<SurfacePatch*> order;
  for (SurfacePatch& patch : patches) order.push_back(&patch);
  std::stable_sort(order.begin(), order.end(), [](const SurfacePatch* a, const SurfacePatch* b) {
    return a->light_rows > b->light_rows;
  });
  int x = 0, y = 0, shelf = 0;
  for (SurfacePatch* patch : order) {
    if (x + patch->light_columns > kAtlasWidth) {
      x = 0;
      y += shelf;
      shelf = 0;
    }
    patch->light_x = x;
    patch->light_y = y;
    x += patch->light_columns;
    shelf = std::max(shelf, patch->light_rows);
  }
  return {kAtlasWidth, y + shelf};
}

struct SurfacePoint {
  Eigen::Vector3f position, normal;
};

/// Bilinear in the patch's grid; s, t in 0 .. 1.
SurfacePoint At(const SurfacePatch& patch, float s, float t) {
  const float x = s * static_cast<float>(patch.columns), y = t * static_cast<float>(patch.rows);
  const int i = std::min(static_cast<int>(x), patch.columns - 1);
  const int j = std::min(static_cast<int>(y), patch.rows - 1);
  const float a = x - static_cast<float>(i), b = y - static_cast<float>(j);
  const auto corner = static_cast<std::size_t>(j * (patch.columns + 1) + i);
  const std::size_t below = corner + static_cast<std::size_t>(patch.columns) + 1;
  const auto mix = [&](const std::vector<Eigen::Vector3f>& v) -> Eigen::Vector3f {
    return (1 - b) * ((1 - a) * v[corner] + a * v[corner + 1]) +
           b * ((1 - a) * v[below] + a * v[below + 1]);
  };
  return {mix(patch.positions), mix(patch.normals).normalized()};
}

/// The point at sample (i, j) of `columns` x `rows`, kept off the patch's rim, where it would touch
/// its neighbours.
SurfacePoint SampleAt(const SurfacePatch& patch, int i, int j, int columns, int rows) {
  const auto place = [](int k, int n, int light_n) {
    const float rim = 0.15f / static_cast<float>(light_n);
    return std::clamp(static_cast<float>(k) / static_cast<float>(n - 1), rim, 1 - rim);
  };
  SurfacePoint point =
      At(patch, place(i, columns, patch.light_columns), place(j, rows, patch.light_rows));
  point.position += kOffset_m * point.normal;
  return point;
}

Eigen::Vector3f Direct(const SurfacePoint& at, const std::vector<AreaLight>& lights,
                       const RayCaster& caster) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const AreaLight& light : lights) {
    const float area = 4 * light.half_u.norm() * light.half_v.norm();
    const auto n = static_cast<float>(light.samples);
    for (int k = 0; k < light.samples * light.samples; ++k) {
      const float a = (2 * static_cast<float>(k % light.samples) + 1) / n - 1;
      const float b = (2 * static_cast<float>(k / light.samples) + 1) / n - 1;
      const Eigen::Vector3f to = light.centre + a * light.half_u + b * light.half_v - at.position;
      const float distance = to.norm();
      const Eigen::Vector3f direction = to / distance;
      const float facing = at.normal.dot(direction), away = -light.normal.dot(direction);
      if (facing <= 0 || away <= 0) continue;
      const float weight = facing * away * area /
                           (n * n * std::numbers::pi_v<float> * (distance * distance + 0.02f));
      if (weight * light.rgb.maxCoeff() < 1e-4f) continue;
      if (caster.Blocked(at.position, direction, distance - 0.02f)) continue;
      sum += weight * light.rgb;
    }
  }
  return sum;
}

class Baker {
 public:
  Baker(const std::vector<AreaLight>& lights, RoomScene& scene)
      : lights_(lights), scene_(scene), caster_(scene) {
    const cv::Size size = LayOut(scene.patches);
    direct_ = cv::Mat(size, CV_32FC3, cv::Scalar::all(0));
    total_ = cv::Mat(size, CV_32FC3, cv::Scalar::all(0));
    // Cosine-weighted directions about +z: a golden-angle spiral.
    for (int k = 0; k < kBounceRays; ++k) {
      const float r = std::sqrt((static_cast<float>(k) + 0.5f) / kBounceRays);
      const float angle = 2.39996323f * static_cast<float>(k);
      spiral_.emplace_back(r * std::cos(angle), r * std::sin(angle), std::sqrt(1 - r * r));
    }
  }

  void Run(int threads) {
    ForEachPatch(threads, [this](const SurfacePatch& patch) { BakeDirect(patch); });
    ForEachPatch(threads, [this](const SurfacePatch& patch) { BakeBounce(patch); });
    Finish();
  }

 private:
  template <typename Work>
  void ForEachPatch(int threads, const Work& work) {
    std::vector<std::jthread> pool;
    for (int k = 0; k < threads; ++k) {
      pool.emplace_back([&, k] {
        for (std::size_t p = static_cast<std::size_t>(k); p < scene_.patches.size();
             p += static_cast<std::size_t>(threads)) {
          work(scene_.patches[p]);
        }
      });
    }
  }

  void BakeDirect(const SurfacePatch& patch) {
    for (int j = 0; j < patch.light_rows; ++j) {
      for (int i = 0; i < patch.light_columns; ++i) {
        const Eigen::Vector3f light =
            Direct(SampleAt(patch, i, j, patch.light_columns, patch.light_rows), lights_, caster_);
        direct_.at<cv::Vec3f>(patch.light_y + j, patch.light_x + i) = {light.x(), light.y(),
                                                                       light.z()};
      }
    }
  }

  /// Bounced light is smooth: it is gathered at every second sample of a large patch.
  void BakeBounce(const SurfacePatch& patch) {
    if (patch.glow > 0) {
      const cv::Rect area(patch.light_x, patch.light_y, patch.light_columns, patch.light_rows);
      total_(area) = cv::Scalar::all(patch.glow);
      return;
    }
    const auto coarse = [](int n) { return n < 5 ? n : n / 2 + 1; };
    const int columns = coarse(patch.light_columns), rows = coarse(patch.light_rows);
    cv::Mat gathered(rows, columns, CV_32FC3);
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        gathered.at<cv::Vec3f>(j, i) = GatherAll(SampleAt(patch, i, j, columns, rows));
      }
    }
    for (int j = 0; j < patch.light_rows; ++j) {
      for (int i = 0; i < patch.light_columns; ++i) {
        const cv::Point at(patch.light_x + i, patch.light_y + j);
        const float x =
            static_cast<float>(i * (columns - 1)) / static_cast<float>(patch.light_columns - 1);
        const float y =
            static_cast<float>(j * (rows - 1)) / static_cast<float>(patch.light_rows - 1);
        const int x0 = std::min(static_cast<int>(x), columns - 2);
        const int y0 = std::min(static_cast<int>(y), rows - 2);
        const float a = x - static_cast<float>(x0), b = y - static_cast<float>(y0);
        const auto texel = [&](int dx, int dy) { return gathered.at<cv::Vec3f>(y0 + dy, x0 + dx); };
        total_.at<cv::Vec3f>(at) = direct_.at<cv::Vec3f>(at) +
                                   (1 - b) * ((1 - a) * texel(0, 0) + a * texel(1, 0)) +
                                   b * ((1 - a) * texel(0, 1) + a * texel(1, 1));
      }
    }
  }

  cv::Vec3f GatherAll(const SurfacePoint& at) const {
    const Eigen::Vector3f side =
        at.normal
            .cross(std::abs(at.normal.x()) < 0.7f ? Eigen::Vector3f::UnitX()
                                                  : Eigen::Vector3f::UnitY())
            .normalized();
    Eigen::Matrix3f basis;
    basis << side, at.normal.cross(side), at.normal;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const Eigen::Vector3f& d : spiral_) sum += Gather(at.position, basis * d);
    sum /= kBounceRays;
    return {sum.x(), sum.y(), sum.z()};
  }

  /// Light that comes from `direction`: reflected there, plus what must have bounced before.
  Eigen::Vector3f Gather(const Eigen::Vector3f& from, const Eigen::Vector3f& direction) const {
    const std::optional<RayHit> hit = caster_.Closest(from, direction);
    if (!hit || !hit->front) return Eigen::Vector3f::Zero();
    const SurfacePatch& patch = scene_.patches[static_cast<std::size_t>(hit->patch)];
    if (patch.glow > 0) return Eigen::Vector3f::Zero();  // lights are sampled directly
    const int x =
        patch.light_x +
        static_cast<int>(std::lround(hit->s * static_cast<float>(patch.light_columns - 1)));
    const int y = patch.light_y +
                  static_cast<int>(std::lround(hit->t * static_cast<float>(patch.light_rows - 1)));
    const cv::Vec3f& direct = direct_.at<cv::Vec3f>(y, x);
    const Eigen::Vector3f& reflectance =
        scene_.textures[static_cast<std::size_t>(patch.texture)].mean_rgb_linear;
    // Close surfaces are dark themselves: the deeper the corner, the less comes after all bounces.
    const float open = hit->distance / (hit->distance + 0.25f);
    return reflectance.cwiseProduct(Eigen::Vector3f(direct[0], direct[1], direct[2])) +
           Eigen::Vector3f::Constant(kAmbient * open);
  }

  /// Smooths within each patch, and encodes.
  void Finish() {
    scene_.light = cv::Mat(total_.size(), CV_8UC3, cv::Scalar::all(0));
    for (const SurfacePatch& patch : scene_.patches) {
      const cv::Rect area(patch.light_x, patch.light_y, patch.light_columns, patch.light_rows);
      cv::Mat smooth;
      cv::GaussianBlur(total_(area).clone(), smooth, {3, 3}, 0.6, 0.6, cv::BORDER_REPLICATE);
      for (int y = 0; y < area.height; ++y) {
        for (int x = 0; x < area.width; ++x) {
          const cv::Vec3f& rgb = smooth.at<cv::Vec3f>(y, x);
          cv::Vec3b& out = scene_.light.at<cv::Vec3b>(area.y + y, area.x + x);
          for (int c = 0; c < 3; ++c) {
            const float coded = std::pow(std::max(rgb[2 - c], 0.0f), 1 / 2.2f) / kLightScale;
            out[c] = static_cast<std::uint8_t>(std::lround(255 * std::min(coded, 1.0f)));
          }
        }
      }
    }
  }

  const std::vector<AreaLight>& lights_;
  RoomScene& scene_;
  RayCaster caster_;
  cv::Mat direct_, total_;  // RGB, linear
  std::vector<Eigen::Vector3f> spiral_;
};

}  // namespace

void BakeLight(const std::vector<AreaLight>& lights, int threads, RoomScene& scene) {
  Baker(lights, scene).Run(std::max(threads, 1));
}

}  // namespace saccade
