#include "server/sim/picture_effects.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace saccade {
namespace {

constexpr double kEvery_s = 6.0, kReach_s = 2.5;  // from one reach to the next; how long it lasts
constexpr double kHaze = 130.0;                   // grey level that haze draws everything to
constexpr int kCloth_px = 256;

std::uint64_t Mix(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// Uniform in 0 .. 1.
double Share(std::uint64_t seed, std::uint64_t index) {
  return static_cast<double>(Mix(Mix(seed * 0x9e3779b97f4a7c15ULL + 17) + index) >> 11) * 0x1.0p-53;
}

/// A checked shirt: the worst an arm can wear, for it is full of corners.
cv::Mat PaintCloth(std::uint64_t seed) {
  cv::Mat cloth(kCloth_px, kCloth_px, CV_8UC3);
  for (int y = 0; y < cloth.rows; ++y) {
    for (int x = 0; x < cloth.cols; ++x) {
      const bool across = y / 9 % 3 == 0, along = x / 9 % 3 == 0;
      const auto grain =
          static_cast<int>(Mix(seed * 65537 + static_cast<std::uint64_t>(y * 256 + x)) % 13);
      const int level = 70 + 40 * (across ? 1 : 0) + 40 * (along ? 1 : 0) + grain;
      cloth.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(level),
                                   static_cast<std::uint8_t>(level * 3 / 4),
                                   static_cast<std::uint8_t>(level / 2)};
    }
  }
  return cloth;
}

}  // namespace

PictureEffects::PictureEffects(const SimOptions& options)
    : options_(options), sleeve_(PaintCloth(options.seed)) {}

std::optional<PictureEffects::Arm> PictureEffects::ArmAt(double time_s) const {
  if (!options_.arm || time_s < 0.0) return std::nullopt;
  const auto reach = static_cast<std::uint64_t>(time_s / kEvery_s);
  const double rest_s = (kEvery_s - kReach_s) * Share(options_.seed, 3 * reach);
  const double in_s = time_s - kEvery_s * static_cast<double>(reach) - rest_s;
  if (in_s <= 0.0 || in_s >= kReach_s) return std::nullopt;
  // Out and back; meanwhile the hand works at what it has reached.
  const double out = std::sin(std::numbers::pi * in_s / kReach_s);
  const double width = options_.width, height = options_.height;
  const double side = Share(options_.seed, 3 * reach + 1) < 0.5 ? -1.0 : 1.0;
  const double far =
      0.45 + 0.25 * Share(options_.seed, 3 * reach + 2);  // of the height, from below
  Arm arm;
  arm.elbow = {width * (0.5 + 0.35 * side), height * 1.25};
  arm.hand = {width * (0.5 + 0.35 * side - 0.22 * side * out) + 0.02 * width * std::sin(9.0 * in_s),
              height * (1.15 - (0.15 + far) * out) + 0.015 * width * std::cos(7.0 * in_s)};
  arm.width_px = 0.12 * width;
  return arm;
}

bool PictureEffects::ArmCovers(double time_s, const cv::Point2d& pixel) const {
  const std::optional<Arm> arm = ArmAt(time_s);
  if (!arm) return false;
  const cv::Point2d along = arm->hand - arm->elbow;
  const double share = std::clamp((pixel - arm->elbow).dot(along) / along.dot(along), 0.0, 1.0);
  return cv::norm(pixel - (arm->elbow + share * along)) < 0.5 * arm->width_px;
}

void PictureEffects::DrawArm(double time_s, cv::Mat& bgr) const {
  const std::optional<Arm> arm = ArmAt(time_s);
  if (!arm) return;
  const cv::Point2d along = arm->hand - arm->elbow;
  const double length = cv::norm(along);
  const cv::Point2d unit = along / length;
  const double radius = 0.5 * arm->width_px;
  for (int v = 0; v < bgr.rows; ++v) {
    auto* row = bgr.ptr<cv::Vec3b>(v);
    for (int u = 0; u < bgr.cols; ++u) {
      const cv::Point2d from = cv::Point2d(u, v) - arm->elbow;
      const double s = std::clamp(from.dot(unit), 0.0, length);
      const double across = unit.x * from.y - unit.y * from.x;
      const double away = cv::norm(from - s * unit);
      if (away >= radius) continue;
      // The cloth goes with the arm; its sides lie in the dark; the hand is bare.
      const double shade = std::sqrt(std::max(0.05, 1.0 - away * away / (radius * radius)));
      const bool hand = length - from.dot(unit) < 1.2 * radius;
      const int x = static_cast<int>(std::lround(across + kCloth_px / 2)) & (kCloth_px - 1);
      const int y = static_cast<int>(std::lround(length - from.dot(unit))) & (kCloth_px - 1);
      const cv::Vec3d paint =
          hand ? cv::Vec3d(120, 150, 200) : cv::Vec3d(sleeve_.at<cv::Vec3b>(y, x));
      const double edge = std::min(1.0, radius - away);
      for (int c = 0; c < 3; ++c) {
        row[u][c] =
            cv::saturate_cast<std::uint8_t>((1.0 - edge) * row[u][c] + edge * shade * paint[c]);
      }
    }
  }
}

void PictureEffects::Soften(cv::Mat& bgr) const {
  if (options_.softness_px > 0.0) {
    cv::GaussianBlur(bgr, bgr, cv::Size(), options_.softness_px, 0, cv::BORDER_REPLICATE);
  }
  if (options_.contrast < 1.0) {
    bgr.convertTo(bgr, -1, options_.contrast, (1.0 - options_.contrast) * kHaze);
  }
}

absl::Status PictureEffects::Compress(cv::Mat& bgr) const {
  if (options_.jpeg <= 0) return absl::OkStatus();
  std::vector<uchar> coded;
  if (!cv::imencode(".jpg", bgr, coded, {cv::IMWRITE_JPEG_QUALITY, options_.jpeg})) {
    return absl::InternalError("source sim: a picture could not be compressed; give jpeg=0");
  }
  bgr = cv::imdecode(coded, cv::IMREAD_COLOR);
  return absl::OkStatus();
}

}  // namespace saccade
