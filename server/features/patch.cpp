#include "server/features/patch.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

constexpr int kMinMargin = 8;     // of picture around a new template [px]
constexpr int kCoarseSize = 9;    // [px of the half-resolution picture]
constexpr double kOverrun = 1.0;  // samples this far outside `valid` repeat its edge [px]
constexpr double kReach = 9.0;    // half side of the grid that the warp is interpolated on [px]

/// Pixel of the current view (offset from the centre) to pixel of the template, as a biquadratic
/// through a 3 x 3 grid of exactly mapped rays.
class WarpMap {
 public:
  /// at[3 * row + column] in template pixels.
  explicit WarpMap(const std::array<Eigen::Vector2d, 9>& at) {
    for (int row = 0; row < 3; ++row) {
      const Eigen::Vector2d& a = at[3 * row];
      const Eigen::Vector2d& b = at[3 * row + 1];
      const Eigen::Vector2d& c = at[3 * row + 2];
      constant_.col(row) = b;
      linear_.col(row) = 0.5 * (c - a) / kReach;
      square_.col(row) = (0.5 * (a + c) - b) / (kReach * kReach);
    }
  }
  Eigen::Vector2d operator()(double x, double y) const {
    const double v = y / kReach;
    const Eigen::Vector3d weight(0.5 * v * (v - 1.0), 1.0 - v * v, 0.5 * v * (v + 1.0));
    return constant_ * weight + x * (linear_ * weight + x * (square_ * weight));
  }
  /// d(template pixel) / d(current pixel) at the centre.
  Eigen::Matrix2d Jacobian() const {
    Eigen::Matrix2d j;
    j.col(0) = linear_.col(1);
    j.col(1) = 0.5 * (constant_.col(2) - constant_.col(0)) / kReach;
    return j;
  }
  /// The row at height y as polynomials in x: at = a + x * (b + x * c).
  void Row(double y, Eigen::Vector2f& a, Eigen::Vector2f& b, Eigen::Vector2f& c) const {
    const double v = y / kReach;
    const Eigen::Vector3d weight(0.5 * v * (v - 1.0), 1.0 - v * v, 0.5 * v * (v + 1.0));
    a = (constant_ * weight).cast<float>();
    b = (linear_ * weight).cast<float>();
    c = (square_ * weight).cast<float>();
  }

 private:
  Eigen::Matrix<double, 2, 3> constant_, linear_, square_;  // a column for each row of the grid
};

/// Reads the template between its pixels; outside `valid` the edge repeats.
class Sampler {
 public:
  explicit Sampler(const PatchTemplate& patch)
      : pixels_(patch.pixels.data()),
        left_(static_cast<float>(patch.valid.x)),
        top_(static_cast<float>(patch.valid.y)),
        right_(static_cast<float>(patch.valid.x + patch.valid.width - 1)),
        bottom_(static_cast<float>(patch.valid.y + patch.valid.height - 1)) {}

  bool Holds(const Eigen::Vector2d& at) const {
    return at.x() >= left_ - kOverrun && at.x() <= right_ + kOverrun && at.y() >= top_ - kOverrun &&
           at.y() <= bottom_ + kOverrun;
  }
  float operator()(float x, float y) const {
    x = std::min(std::max(x, left_), right_ - 1e-3F);
    y = std::min(std::max(y, top_), bottom_ - 1e-3F);
    const int ix = static_cast<int>(x);
    const int iy = static_cast<int>(y);
    const float fx = x - static_cast<float>(ix);
    const float fy = y - static_cast<float>(iy);
    const std::uint8_t* p = pixels_ + iy * PatchTemplate::kSize + ix;
    const float upper = static_cast<float>(p[0]) + fx * static_cast<float>(p[1] - p[0]);
    const float lower =
        static_cast<float>(p[PatchTemplate::kSize]) +
        fx * static_cast<float>(p[PatchTemplate::kSize + 1] - p[PatchTemplate::kSize]);
    return upper + fy * (lower - upper);
  }

 private:
  const std::uint8_t* pixels_;
  float left_, top_, right_, bottom_;
};

/// True if a square of `half` pixels around the centre maps into the template.
bool Fits(const WarpMap& map, const Sampler& sampler, double half) {
  for (const double y : {-half, 0.0, half}) {
    for (const double x : {-half, 0.0, half}) {
      if (!sampler.Holds(map(x, y))) return false;
    }
  }
  return true;
}

/// Fills `out` with size x size pixels `spacing` apart, each the mean of a taps x taps grid of
/// samples that spans `spread` pixels.
void Resample(const WarpMap& map, const Sampler& sampler, int size, double spacing, int taps,
              double spread, CorrelationTemplate& out) {
  out.size = size;
  out.pixels.fill(0);
  const int half = size / 2;
  const float scale = 1.0F / static_cast<float>(taps * taps);
  for (int v = 0; v < size; ++v) {
    std::array<float, CorrelationTemplate::kStride> sums{};
    for (int tap = 0; tap < taps; ++tap) {
      const double offset = taps == 1 ? 0.0 : spread * ((tap + 0.5) / taps - 0.5);
      Eigen::Vector2f a, b, c;
      map.Row((v - half) * spacing + offset, a, b, c);
      for (int u = 0; u < size; ++u) {
        for (int side = 0; side < taps; ++side) {
          const double shift = taps == 1 ? 0.0 : spread * ((side + 0.5) / taps - 0.5);
          const float x = static_cast<float>((u - half) * spacing + shift);
          const Eigen::Vector2f at = a + x * (b + x * c);
          sums[u] += sampler(at.x(), at.y());
        }
      }
    }
    for (int u = 0; u < size; ++u) {
      out.pixels[v * CorrelationTemplate::kStride + u] =
          static_cast<std::int16_t>(sums[u] * scale + 0.5F);
    }
  }
  out.Finish();
}

/// The ray geometry of one warp.
struct RayMap {
  const PatchTemplate& patch;
  const CameraModel& camera;
  Eigen::Matrix3d birth_from_current;
  Eigen::Vector3d centre;  // current camera's centre in the birth camera, times inverse depth
  Eigen::Vector3d normal;
  double distance;  // normal . bearing - normal . centre

  /// Pixel of the birth view that shows what `pixel` of the current view shows.
  bool operator()(const Eigen::Vector2d& pixel, Eigen::Vector2d& in_birth,
                  Eigen::Vector3d* ray_in_birth = nullptr) const {
    const std::optional<Eigen::Vector3d> ray = camera.Unproject(pixel);
    if (!ray) return false;
    const Eigen::Vector3d direction = birth_from_current * *ray;
    const double slope = normal.dot(direction);
    if (slope >= -1e-6 || distance >= 0.0) return false;  // behind, or seen from its back
    const std::optional<Eigen::Vector2d> seen =
        patch.camera->Project(centre + direction * (distance / slope));
    if (!seen) return false;
    in_birth = *seen;
    if (ray_in_birth != nullptr) *ray_in_birth = direction;
    return true;
  }
};

WarpStatus Sample(const PatchTemplate& patch, const WarpMap& map, const WarpOptions& options,
                  double stride, WarpedPatch& warped) {
  const Sampler sampler(patch);
  int size = std::min(options.size, CorrelationTemplate::kMaxSize);
  while (size >= 7 && !Fits(map, sampler, size / 2)) size -= 2;
  if (size < 7) return WarpStatus::kOutside;
  // Smaller than at birth: average, or fine texture turns into false coarse texture.
  const int taps = stride > 1.4 ? 2 : 1;
  Resample(map, sampler, size, 1.0, taps, 1.0, warped.fine);
  if (warped.fine.Deviation() < options.min_deviation) return WarpStatus::kLowTexture;
  warped.coarse.size = 0;
  if (options.coarse && Fits(map, sampler, kCoarseSize - 0.5)) {
    Resample(map, sampler, kCoarseSize, 2.0, 2, 2.0, warped.coarse);
  }
  return WarpStatus::kOk;
}

}  // namespace

double CorrelationTemplate::Deviation() const {
  const double count = size * size;
  if (size == 0) return 0.0;
  const double mean = sum / count;
  return std::sqrt(std::max(0.0, static_cast<double>(sum_squared) / count - mean * mean));
}

void CorrelationTemplate::Finish() {
  sum = 0;
  sum_squared = 0;
  for (int v = 0; v < size; ++v) {
    for (int u = 0; u < size; ++u) {
      const int value = pixels[v * kStride + u];
      sum += value;
      sum_squared += value * value;
    }
  }
}

const char* ToString(WarpStatus status) {
  switch (status) {
    case WarpStatus::kOk:
      return "ok";
    case WarpStatus::kNotInView:
      return "not in view";
    case WarpStatus::kTooOblique:
      return "too oblique";
    case WarpStatus::kScale:
      return "scale";
    case WarpStatus::kOutside:
      return "outside the template";
    case WarpStatus::kLowTexture:
      return "low texture";
    case WarpStatus::kBadInput:
      return "bad input";
  }
  return "unknown";
}

absl::StatusOr<PatchTemplate> CutPatch(const cv::Mat& grey, const Eigen::Vector2d& pixel,
                                       const std::shared_ptr<const CameraModel>& camera) {
  if (grey.type() != CV_8UC1 || grey.empty() || camera == nullptr) {
    return absl::InvalidArgumentError("patch: needs an 8-bit grey picture and its camera");
  }
  if (!pixel.allFinite()) return absl::InvalidArgumentError("patch: pixel is not finite");
  if (pixel.x() < kMinMargin || pixel.y() < kMinMargin || pixel.x() > grey.cols - 1 - kMinMargin ||
      pixel.y() > grey.rows - 1 - kMinMargin) {
    return absl::OutOfRangeError(absl::StrCat("patch: pixel (", pixel.x(), ", ", pixel.y(),
                                              ") is less than ", kMinMargin,
                                              " px from the picture's border"));
  }
  const std::optional<Eigen::Vector3d> bearing = camera->Unproject(pixel);
  if (!bearing) return absl::InvalidArgumentError("patch: the lens has no ray for this pixel");
  PatchTemplate patch;
  patch.birth_pixel = pixel;
  patch.birth_bearing = *bearing;
  patch.camera = camera;
  const cv::Point corner(static_cast<int>(std::lround(pixel.x())) - PatchTemplate::kHalf,
                         static_cast<int>(std::lround(pixel.y())) - PatchTemplate::kHalf);
  patch.centre_in_template = pixel - Eigen::Vector2d(corner.x, corner.y);
  patch.valid = cv::Rect(-corner.x, -corner.y, grey.cols, grey.rows) &
                cv::Rect(0, 0, PatchTemplate::kSize, PatchTemplate::kSize);
  for (int y = patch.valid.y; y < patch.valid.y + patch.valid.height; ++y) {
    const std::uint8_t* row = grey.ptr<std::uint8_t>(y + corner.y) + corner.x + patch.valid.x;
    std::copy_n(row, patch.valid.width,
                patch.pixels.begin() + y * PatchTemplate::kSize + patch.valid.x);
  }
  return patch;
}

absl::StatusOr<PatchTemplate> PatchFromImage(const cv::Mat& templ, const Eigen::Vector2d& pixel,
                                             const std::shared_ptr<const CameraModel>& camera) {
  if (templ.type() != CV_8UC1 || templ.cols != templ.rows || templ.cols % 2 == 0 ||
      templ.cols < 7 || templ.cols > PatchTemplate::kSize || camera == nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat("template: ", templ.cols, " x ", templ.rows,
                     "; give an 8-bit grey square of odd side from 7 to ", PatchTemplate::kSize));
  }
  if (!pixel.allFinite()) return absl::InvalidArgumentError("template: pixel is not finite");
  const std::optional<Eigen::Vector3d> bearing = camera->Unproject(pixel);
  if (!bearing) return absl::InvalidArgumentError("template: the lens has no ray for this pixel");
  PatchTemplate patch;
  patch.birth_pixel = pixel;
  patch.birth_bearing = *bearing;
  patch.camera = camera;
  const int first = PatchTemplate::kHalf - templ.cols / 2;
  patch.valid = cv::Rect(first, first, templ.cols, templ.rows);
  for (int y = 0; y < templ.rows; ++y) {
    std::copy_n(templ.ptr<std::uint8_t>(y), templ.cols,
                patch.pixels.begin() + (first + y) * PatchTemplate::kSize + first);
  }
  return patch;
}

WarpStatus WarpPatch(const PatchTemplate& patch, const Rigid3& current_from_birth,
                     const Eigen::Vector3d& bearing_in_birth, double inverse_depth,
                     const Eigen::Vector3d& normal_in_birth, const CameraModel& camera,
                     const Eigen::Vector2d& predicted_pixel, const WarpOptions& options,
                     WarpedPatch& warped) {
  if (patch.camera == nullptr || !(inverse_depth >= 0.0) || !std::isfinite(inverse_depth) ||
      !bearing_in_birth.allFinite() || !normal_in_birth.allFinite() ||
      !predicted_pixel.allFinite() || !current_from_birth.translation.allFinite() ||
      !current_from_birth.rotation.coeffs().allFinite()) {
    return WarpStatus::kBadInput;
  }
  const Rigid3 birth_from_current = current_from_birth.Inverse();
  const Eigen::Vector3d normal =
      normal_in_birth.isZero() ? Eigen::Vector3d(-bearing_in_birth) : normal_in_birth;
  RayMap rays{patch,
              camera,
              birth_from_current.RotationMatrix(),
              inverse_depth * birth_from_current.translation,
              normal,
              0.0};
  rays.distance = normal.dot(bearing_in_birth) - normal.dot(rays.centre);

  Eigen::Vector2d middle;
  Eigen::Vector3d ray;
  if (!rays(predicted_pixel, middle, &ray)) return WarpStatus::kNotInView;
  warped.view_angle_rad = std::acos(std::clamp(ray.dot(bearing_in_birth), -1.0, 1.0));
  if (warped.view_angle_rad > options.max_view_angle_rad ||
      -ray.dot(normal) < std::cos(options.max_grazing_rad)) {
    return WarpStatus::kTooOblique;
  }
  // The feature itself stays in the middle, whatever the filter has done to its bearing since.
  const Eigen::Vector2d to_template = patch.centre_in_template - middle;
  std::array<Eigen::Vector2d, 9> grid;
  for (int k = 0; k < 9; ++k) {
    const Eigen::Vector2d offset((k % 3 - 1) * kReach, (k / 3 - 1) * kReach);
    if (k == 4) {
      grid[k] = patch.centre_in_template;
      continue;
    }
    if (!rays(predicted_pixel + offset, grid[k])) return WarpStatus::kNotInView;
    grid[k] += to_template;
  }
  const WarpMap map(grid);
  const double area = map.Jacobian().determinant();
  if (!(area > 0.0)) return WarpStatus::kTooOblique;
  const double stride = std::sqrt(area);
  warped.scale = 1.0 / stride;
  if (warped.scale > options.max_scale || stride > options.max_scale) return WarpStatus::kScale;
  return Sample(patch, map, options, stride, warped);
}

WarpStatus CopyPatch(const PatchTemplate& patch, const WarpOptions& options, WarpedPatch& warped) {
  std::array<Eigen::Vector2d, 9> grid;
  for (int k = 0; k < 9; ++k) {
    grid[k] =
        patch.centre_in_template + Eigen::Vector2d((k % 3 - 1) * kReach, (k / 3 - 1) * kReach);
  }
  warped.scale = 1.0;
  warped.view_angle_rad = 0.0;
  return Sample(patch, WarpMap(grid), options, 1.0, warped);
}

}  // namespace saccade
