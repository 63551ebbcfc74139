#include "server/eval/markers/square_render.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

namespace saccade {
namespace {

constexpr int kWidth = 480, kHeight = 360;
constexpr int kRays = 4;                  // a side of a pixel
constexpr double kMargin_of_side = 0.25;  // of white paper about the square
constexpr double kInside_px = 6;          // the square keeps from the picture's edge
constexpr double kNoise = 5;
constexpr double kLeastTilt_deg = 5, kMostTilt_deg = 60;
constexpr double kLeastSide_px = 20, kMostSide_px = 200;
const cv::Vec3f kBlack(26, 25, 25), kRed(40, 36, 200);

class Dice {
 public:
  Dice(std::uint64_t seed, int index) : engine_(seed * 1'000'003 + static_cast<unsigned>(index)) {}
  double Between(double low, double high) {
    return low + (high - low) * std::generate_canonical<double, 53>(engine_);
  }
  bool Chance(double share) { return Between(0, 1) < share; }
  double Normal() {
    const double radius = std::sqrt(-2 * std::log(1 - Between(0, 1)));
    return radius * std::cos(Between(0, 2 * std::numbers::pi));
  }
  cv::Vec3f Color(double low, double high) {
    return {static_cast<float>(Between(low, high)), static_cast<float>(Between(low, high)),
            static_cast<float>(Between(low, high))};
  }
  std::uint64_t Seed() { return engine_(); }

 private:
  std::mt19937_64 engine_;
};

cv::Point2f PointIn(Dice& dice) {
  return {static_cast<float>(dice.Between(0, kWidth)),
          static_cast<float>(dice.Between(0, kHeight))};
}

/// A wall with things on it: frames, dark and red ones among them, plates, cables.
cv::Mat Wall(Dice& dice) {
  const cv::Vec3f base = dice.Color(70, 190);
  cv::Mat wall(kHeight, kWidth, CV_32FC3, cv::Scalar(base[0], base[1], base[2]));
  const int things = static_cast<int>(dice.Between(4, 16));
  for (int k = 0; k < things; ++k) {
    cv::Vec3f color = dice.Color(10, 240);
    const double chance = dice.Between(0, 1);
    if (chance < 0.25) color = dice.Color(10, 50);
    if (chance > 0.85) color = {30, 30, static_cast<float>(dice.Between(120, 230))};
    const cv::Scalar ink(color[0], color[1], color[2]);
    const cv::Size2f size(static_cast<float>(dice.Between(8, 120)),
                          static_cast<float>(dice.Between(8, 120)));
    const cv::RotatedRect place(PointIn(dice), size, static_cast<float>(dice.Between(0, 180)));
    if (dice.Chance(0.3)) {
      cv::ellipse(wall, place, ink, cv::FILLED, cv::LINE_AA);
    } else if (dice.Chance(0.2)) {
      cv::line(wall, place.center, PointIn(dice), ink, static_cast<int>(dice.Between(1, 6)),
               cv::LINE_AA);
    } else {
      std::array<cv::Point2f, 4> corners;
      place.points(corners.data());
      const std::vector<cv::Point> whole(corners.begin(), corners.end());
      cv::fillConvexPoly(wall, whole, ink, cv::LINE_AA);
    }
  }
  return wall;
}

Eigen::Vector3d InMarker(const Eigen::Vector2d& unit) {
  return {kRenderSide_m * (unit.x() - 0.5), kRenderSide_m * (unit.y() - 0.5), 0};
}

/// Where the square is; again, until it is wholly in the picture.
void PlaceSquare(Dice& dice, const MarkerPattern& pattern, SquareRender& render) {
  while (true) {
    render.side_px = render.kind == RenderKind::kAtOneMetre
                         ? kRenderFocal_px * kRenderSide_m
                         : dice.Between(kLeastSide_px, kMostSide_px);
    const double distance_m = kRenderFocal_px * kRenderSide_m / render.side_px;
    const Eigen::Vector3d ray = RenderCamera()
                                    .Unproject({dice.Between(0.15 * kWidth, 0.85 * kWidth),
                                                dice.Between(0.15 * kHeight, 0.85 * kHeight)})
                                    ->normalized();
    render.tilt_rad = dice.Between(kLeastTilt_deg, kMostTilt_deg) * std::numbers::pi / 180;
    const double way = dice.Between(0, 2 * std::numbers::pi);
    const double turn = dice.Between(0, 2 * std::numbers::pi);
    const Eigen::Quaterniond facing =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), ray);
    render.camera_from_marker.rotation =
        facing *
        Eigen::AngleAxisd(render.tilt_rad, Eigen::Vector3d(std::cos(way), std::sin(way), 0)) *
        Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ());
    render.camera_from_marker.translation = distance_m * ray;
    bool inside = true;
    for (int k = 0; k < 4 && inside; ++k) {
      const auto pixel =
          RenderCamera().Project(render.camera_from_marker * InMarker(pattern.corners[k]));
      inside = pixel && RenderCamera().InImage(*pixel, kInside_px);
      if (inside) render.corners[k] = *pixel;
    }
    if (inside) return;
  }
}

/// Something that comes in over one side of the square, in its own plane, as far as `deep`.
struct Cover {
  bool there = false;
  int side = 0;
  double from = 0, to = 0, deep = 0;  // along the side, and into the square
  cv::Vec3f color;

  bool Over(double u, double v) const {
    if (!there) return false;
    const double along = side % 2 == 0 ? u : v;
    const double depth = side == 0 ? v : side == 1 ? 1 - u : side == 2 ? 1 - v : u;
    return along >= from && along <= to && depth <= deep;
  }
};

Cover MakeCover(Dice& dice, const MarkerPattern& pattern, RenderKind kind) {
  Cover cover;
  cover.there = !WhollyVisible(kind);
  if (!cover.there) return cover;
  cover.side = static_cast<int>(dice.Between(0, 3.999));
  const bool border = kind == RenderKind::kBorderCovered;
  const double width = border ? dice.Between(0.08, 0.25) : dice.Between(0.2, 0.7);
  cover.from = dice.Between(0.1, 0.9 - width);
  cover.to = cover.from + width;
  cover.deep = border ? dice.Between(0.3, 0.8) / pattern.cells : dice.Between(0.25, 0.8);
  cover.color = dice.Color(10, 250);
  if (dice.Chance(0.3)) cover.color = dice.Color(15, 45);
  if (dice.Chance(0.15)) cover.color = {35, 40, static_cast<float>(dice.Between(120, 220))};
  return cover;
}

/// The part of the picture that the paper can be in: all of it, if a corner is behind the camera.
cv::Rect PaperIn(const Rigid3& camera_from_marker) {
  const cv::Rect whole(0, 0, kWidth, kHeight);
  std::vector<cv::Point2f> corners;
  for (const double u : {-kMargin_of_side, 1 + kMargin_of_side}) {
    for (const double v : {-kMargin_of_side, 1 + kMargin_of_side}) {
      const auto pixel = RenderCamera().Project(camera_from_marker * InMarker({u, v}));
      if (!pixel) return whole;
      corners.emplace_back(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()));
    }
  }
  const cv::Rect tight = cv::boundingRect(corners);
  return cv::Rect(tight.x - 1, tight.y - 1, tight.width + 2, tight.height + 2) & whole;
}

/// Draws paper, square and cover over `picture`, each pixel the mean of sixteen rays.
void DrawPaper(const MarkerPattern& pattern, const Rigid3& camera_from_marker,
               const cv::Vec3f& paper, const Cover& cover, cv::Mat& picture) {
  const Rigid3 marker_from_camera = camera_from_marker.Inverse();
  const Eigen::Matrix3d turn = marker_from_camera.RotationMatrix();
  const Eigen::Vector3d eye = marker_from_camera.translation;
  const auto shade = [&](double column, double row, const cv::Vec3f& behind) -> cv::Vec3f {
    const Eigen::Vector3d ray =
        turn * Eigen::Vector3d((column - 0.5 * (kWidth - 1)) / kRenderFocal_px,
                               (row - 0.5 * (kHeight - 1)) / kRenderFocal_px, 1);
    const double along = -eye.z() / ray.z();
    if (!(along > 0)) return behind;
    const double u = (eye.x() + along * ray.x()) / kRenderSide_m + 0.5;
    const double v = (eye.y() + along * ray.y()) / kRenderSide_m + 0.5;
    if (std::min(u, v) < -kMargin_of_side || std::max(u, v) > 1 + kMargin_of_side) return behind;
    if (cover.Over(u, v)) return cover.color;
    if (u < 0 || v < 0 || u >= 1 || v >= 1) return paper;
    switch (pattern.At(static_cast<int>(v * pattern.cells), static_cast<int>(u * pattern.cells))) {
      case CellShade::kBlack:
        return kBlack;
      case CellShade::kRed:
        return kRed;
      case CellShade::kWhite:
        break;
    }
    return paper;
  };
  const cv::Rect paper_px = PaperIn(camera_from_marker);
  for (int row = paper_px.y; row < paper_px.y + paper_px.height; ++row) {
    for (int column = paper_px.x; column < paper_px.x + paper_px.width; ++column) {
      cv::Vec3f& pixel = picture.at<cv::Vec3f>(row, column);
      const cv::Vec3f behind = pixel;
      cv::Vec3f sum(0, 0, 0);
      for (int k = 0; k < kRays * kRays; ++k) {
        sum += shade(column + (k % kRays + 0.5) / kRays - 0.5,
                     row + (k / kRays + 0.5) / kRays - 0.5, behind);
      }
      pixel = sum / (kRays * kRays);
    }
  }
}

/// A gentle gradient, and by kind an edge of shadow or a reflection.
void Light(Dice& dice, const SquareRender& render, cv::Mat& picture) {
  const double slope_x = dice.Between(-0.15, 0.15) / kWidth;
  const double slope_y = dice.Between(-0.15, 0.15) / kHeight;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& corner : render.corners) at += corner / 4;
  at += 0.3 * render.side_px * Eigen::Vector2d(dice.Between(-1, 1), dice.Between(-1, 1));
  const double angle = dice.Between(0, 2 * std::numbers::pi);
  const Eigen::Vector2d across(std::cos(angle), std::sin(angle));
  const double dimmed = dice.Between(0.35, 0.7), soft_px = dice.Between(0.3, 6);
  const double bright = dice.Between(40, 120), spread = dice.Between(0.25, 0.8) * render.side_px;
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      cv::Vec3f& pixel = picture.at<cv::Vec3f>(row, column);
      const Eigen::Vector2d off = Eigen::Vector2d(column, row) - at;
      double gain = 1 + slope_x * (column - 0.5 * kWidth) + slope_y * (row - 0.5 * kHeight);
      if (render.kind == RenderKind::kShadow) {
        const double share = std::clamp(0.5 + across.dot(off) / soft_px, 0.0, 1.0);
        gain *= 1 - (1 - dimmed) * share;
      }
      double glare = 0;
      if (render.kind == RenderKind::kGlare) {
        glare = bright * std::exp(-0.5 * off.squaredNorm() / (spread * spread));
      }
      for (int k = 0; k < 3; ++k) pixel[k] = static_cast<float>(gain * pixel[k] + glare);
    }
  }
}

/// A lens's blur, or of one that is out of focus or moves.
void Blur(Dice& dice, const SquareRender& render, cv::Mat& picture) {
  const double lens_px = dice.Between(0.45, 0.85);
  cv::GaussianBlur(picture, picture, {}, lens_px);
  if (render.kind != RenderKind::kBlurred) return;
  const double most_px = std::clamp(render.side_px / 25, 0.8, 3.0);
  if (dice.Chance(0.5)) {
    cv::GaussianBlur(picture, picture, {}, dice.Between(0.6, most_px));
    return;
  }
  const double length = 2.5 * dice.Between(0.6, most_px), angle = dice.Between(0, std::numbers::pi);
  cv::Mat kernel = cv::Mat::zeros(15, 15, CV_32FC1);
  const Eigen::Vector2d way(std::cos(angle), std::sin(angle));
  constexpr int kSteps = 200;
  for (int k = 0; k < kSteps; ++k) {  // symmetric, so that nothing is shifted
    const Eigen::Vector2d p = Eigen::Vector2d(7, 7) + length * ((k + 0.5) / kSteps - 0.5) * way;
    const int x = static_cast<int>(p.x()), y = static_cast<int>(p.y());
    const double a = p.x() - x, b = p.y() - y;
    kernel.at<float>(y, x) += static_cast<float>((1 - a) * (1 - b) / kSteps);
    kernel.at<float>(y, x + 1) += static_cast<float>(a * (1 - b) / kSteps);
    kernel.at<float>(y + 1, x) += static_cast<float>((1 - a) * b / kSteps);
    kernel.at<float>(y + 1, x + 1) += static_cast<float>(a * b / kSteps);
  }
  cv::filter2D(picture, picture, -1, kernel);
}

RenderKind KindOf(Dice& dice) {
  constexpr std::array<double, kRenderKinds> kShares = {0.30, 0.12, 0.12, 0.12, 0.14, 0.10, 0.10};
  double at = dice.Between(0, 1);
  for (int k = 0; k < kRenderKinds; ++k) {
    if (at < kShares[k]) return static_cast<RenderKind>(k);
    at -= kShares[k];
  }
  return RenderKind::kPlain;
}

}  // namespace

const char* Word(RenderKind kind) {
  constexpr std::array kWords = {"plain",          "blurred",      "shadow", "glare",
                                 "border_covered", "code_covered", "at_1_m"};
  return kWords[static_cast<std::size_t>(kind)];
}

const CameraModel& RenderCamera() {
  static const CameraModel camera = [] {
    CameraIntrinsics intrinsics;
    intrinsics.width = kWidth;
    intrinsics.height = kHeight;
    intrinsics.fx = intrinsics.fy = kRenderFocal_px;
    intrinsics.cx = 0.5 * (kWidth - 1);
    intrinsics.cy = 0.5 * (kHeight - 1);
    return CameraModel(intrinsics);
  }();
  return camera;
}

SquareRender RenderSquare(const MarkerPattern& pattern, std::uint64_t seed, int index) {
  Dice dice(seed, index);
  SquareRender render;
  render.kind = KindOf(dice);
  PlaceSquare(dice, pattern, render);
  cv::Mat picture = Wall(dice);
  const double white = dice.Between(190, 235);
  const cv::Vec3f paper(static_cast<float>(white * dice.Between(0.92, 1)),
                        static_cast<float>(white * dice.Between(0.95, 1)),
                        static_cast<float>(white));
  const Cover cover = MakeCover(dice, pattern, render.kind);
  DrawPaper(pattern, render.camera_from_marker, paper, cover, picture);
  Light(dice, render, picture);
  Blur(dice, render, picture);
  cv::Mat grains(picture.size(), CV_32FC3);
  cv::RNG random(dice.Seed());
  random.fill(grains, cv::RNG::NORMAL, 0, kNoise);
  picture += grains;
  picture.convertTo(render.color, CV_8UC3);
  return render;
}

}  // namespace saccade
