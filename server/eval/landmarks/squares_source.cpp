#include "server/eval/landmarks/squares_source.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "server/markers/tag_family.hpp"

namespace saccade {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr double kLength = 6.4, kFrontZ = 2.4, kBackZ = -2.4, kTop = -1.2, kFloorY = 1.4;
constexpr double kTexel = 0.002;  // [m]: cells of the squares are whole numbers of them
constexpr double kSide_m = 0.16, kSmallSide_m = 0.096;
constexpr double kDark = 28, kPaper = 226, kHand = 96;
constexpr double kLens_px = 0.7;
constexpr double kCoverShare = 0.8;  // of a side beyond the middle: all of it, and its margin
const char* const kFamily = "apriltag36h11";

cv::Mat Grain(std::mt19937_64& random, const cv::Size& size, int grain) {
  cv::Mat coarse(std::max(2, size.height / grain), std::max(2, size.width / grain), CV_32F);
  std::normal_distribution<float> normal;
  for (float& value : cv::Mat_<float>(coarse)) value = normal(random);
  cv::Mat fine;
  cv::resize(coarse, fine, size, 0, 0, cv::INTER_CUBIC);
  return fine;
}

/// A wall with some things on it: plaster, and a rectangle here and there.
cv::Mat PaintWall(std::mt19937_64& random, const cv::Size& size, double things_a_m2) {
  cv::Mat look(size, CV_32F, cv::Scalar(150));
  look += 8.0 * Grain(random, size, 96) + 5.0 * Grain(random, size, 20);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double area_m2 = size.area() * kTexel * kTexel;
  for (int k = 0; k < static_cast<int>(things_a_m2 * area_m2); ++k) {
    const cv::Point2f middle(static_cast<float>(unit(random) * size.width),
                             static_cast<float>(unit(random) * size.height));
    const cv::Size2f extent(static_cast<float>(15 + 90 * unit(random)),
                            static_cast<float>(15 + 90 * unit(random)));
    std::array<cv::Point2f, 4> corners;
    cv::RotatedRect(middle, extent, static_cast<float>(180 * unit(random))).points(corners.data());
    std::array<cv::Point, 4> polygon;
    for (int i = 0; i < 4; ++i) polygon[i] = corners[i];
    cv::fillConvexPoly(look, polygon.data(), 4, cv::Scalar(40 + 180 * unit(random)), cv::LINE_AA);
  }
  return look;
}

int Texels(double metres) { return static_cast<int>(std::lround(metres / kTexel)); }

}  // namespace

SquaresSource::SquaresSource(const HallOptions& options) : options_(options) {
  CameraIntrinsics lens;
  lens.width = options.width;
  lens.height = options.height;
  lens.fx = lens.fy = 0.72 * options.width;  // 70 degrees
  lens.cx = 0.5 * (options.width - 1);
  lens.cy = 0.5 * (options.height - 1);
  lens.fps = options.fps;
  info_.uri = "hall of squares";
  info_.camera = std::make_shared<const CameraModel>(lens);
  info_.frame_count = static_cast<std::uint64_t>(options.duration_s * options.fps);
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> unit(0.0, 2.0 * kPi);
  for (double& phase : phases_) phase = unit(random);
}

absl::StatusOr<std::unique_ptr<SquaresSource>> SquaresSource::Create(const HallOptions& options) {
  auto made = std::unique_ptr<SquaresSource>(new SquaresSource(options));
  if (const absl::Status hung = made->HangSquares(); !hung.ok()) return hung;
  made->Paint();
  return made;
}

absl::Status SquaresSource::HangSquares() {
  const absl::StatusOr<TagFamily> family = TagFamily::Make(kFamily, 1);
  if (!family.ok()) return family.status();
  // x right, y up, z out of the wall.
  Eigen::Matrix3d front, left;
  front << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  left << 0, 0, 1, 0, -1, 0, 1, 0, 0;
  const auto hang = [&](double x, double y, double z, bool on_left, double side) {
    const Eigen::Quaterniond turn(on_left ? left : front);
    map_.squares.push_back(
        {kFamily, static_cast<int>(map_.squares.size()), side, {turn, Vector3d(x, y, z)}});
  };
  if (options_.motion == HallMotion::kFlip) {
    hang(1.2, 0.0, kFrontZ, false, kSmallSide_m);
  } else {
    for (const auto& [x, y] :
         {std::pair{0.50, -0.30}, {0.94, 0.34}, {1.36, -0.34}, {1.80, 0.26}, {1.12, -0.02}}) {
      hang(x, y, kFrontZ, false, kSide_m);
    }
    for (const auto& [z, y] : {std::pair{2.00, 0.32}, {1.62, -0.26}, {1.30, 0.20}}) {
      hang(0.0, y, z, true, kSide_m);
    }
  }
  for (const KnownSquare& square : map_.squares) {
    cv::Mat cells = cv::Mat::zeros(family->cells(), family->cells(), CV_8UC1);
    for (const TagFamily::Bit& bit : family->Bits(square.id)) {
      cells.at<std::uint8_t>(bit.row, bit.column) = bit.bright ? 1 : 0;
    }
    codes_.push_back(cells);
  }
  return map_.Validate();
}

void SquaresSource::Paint() {
  std::mt19937_64 random(options_.seed + 77);
  const int tall = Texels(kFloorY - kTop), wide = Texels(kLength), deep = Texels(kFrontZ - kBackZ);
  const bool bare = options_.motion != HallMotion::kFlip && options_.motion != HallMotion::kAway;
  const double things = bare ? 3.0 : 22.0;
  const std::array<cv::Size, kWalls> sizes = {cv::Size(wide, tall), cv::Size(deep, tall),
                                              cv::Size(wide, tall), cv::Size(deep, tall),
                                              cv::Size(wide, deep), cv::Size(wide, deep)};
  for (int wall = 0; wall < kWalls; ++wall) {
    cv::Mat look = PaintWall(random, sizes[wall], things);
    for (std::size_t k = 0; k < map_.squares.size(); ++k) {
      const KnownSquare& square = map_.squares[k];
      const Vector3d& middle = square.world_from_square.translation;
      const bool on_left = middle.x() < 1e-6;
      if (wall != (on_left ? kLeft : kFront)) continue;
      const int cell = Texels(square.side_m / codes_[k].cols);
      const int left = Texels((on_left ? middle.z() - kBackZ : middle.x()) - 0.5 * square.side_m);
      const int top = Texels(middle.y() - kTop - 0.5 * square.side_m);
      const int side = cell * codes_[k].cols;
      cv::rectangle(look, {left - 2 * cell, top - 2 * cell, side + 4 * cell, side + 4 * cell},
                    cv::Scalar(kPaper), cv::FILLED);
      for (int row = 0; row < codes_[k].rows; ++row) {
        for (int column = 0; column < codes_[k].cols; ++column) {
          const bool bright = codes_[k].at<std::uint8_t>(row, column) != 0;
          cv::rectangle(look, {left + column * cell, top + row * cell, cell, cell},
                        cv::Scalar(bright ? kPaper : kDark), cv::FILLED);
        }
      }
    }
    looks_[wall].push_back(look);
    while (std::min(looks_[wall].back().cols, looks_[wall].back().rows) > 16) {
      // Whole pairs of texels, so that places stay what they are.
      const cv::Mat& last = looks_[wall].back();
      const cv::Mat even = last(cv::Rect(0, 0, last.cols / 2 * 2, last.rows / 2 * 2));
      cv::Mat half;
      cv::resize(even, half, {}, 0.5, 0.5, cv::INTER_AREA);
      looks_[wall].push_back(half);
    }
  }
}

Eigen::AlignedBox3d SquaresSource::ThingAt(FrameId frame) const {
  return ThingInHall(options_.motion, TimeOf(frame));
}

bool SquaresSource::Hidden(FrameId frame, std::size_t k, int c) const {
  const Vector3d eye = WorldFromCamera(frame).translation;
  const Vector3d way = map_.squares[k].CornersInWorld()[c] - eye;
  const auto at = EntersBox(ThingAt(frame), eye, way);
  return at && *at < 1.0;
}

double SquaresSource::Look(const Vector3d& o, const Vector3d& d,
                           const Eigen::AlignedBox3d& thing) const {
  if (const auto at = EntersBox(thing, o, d)) return LookOfThing(o + *at * d);
  double range = 1e9, cosine = 1.0;
  int wall = kFront;
  const auto offer = [&](int which, double direction, double distance) {
    if (!(direction > 1e-9) || distance / direction >= range) return;
    range = distance / direction;
    wall = which;
    cosine = direction;
  };
  offer(kFront, d.z(), kFrontZ - o.z());
  offer(kBack, -d.z(), o.z() - kBackZ);
  offer(kRight, d.x(), kLength - o.x());
  offer(kLeft, -d.x(), o.x());
  offer(kFloor, d.y(), kFloorY - o.y());
  offer(kCeiling, -d.y(), o.y() - kTop);
  const Vector3d at = o + range * d;
  double u = at.x(), v = at.y() - kTop;
  if (wall == kBack) u = kLength - at.x();
  if (wall == kLeft) u = at.z() - kBackZ;
  if (wall == kRight) u = kFrontZ - at.z();
  if (wall == kFloor || wall == kCeiling) v = at.z() - kBackZ;
  const double length = d.norm();
  const double footprint = range * length / info_.camera->intrinsics().fx / kTexel /
                           std::sqrt(std::max(0.05, cosine / length));
  const auto& looks = looks_[wall];
  const int level = std::clamp(static_cast<int>(std::lround(std::log2(std::max(1.0, footprint)))),
                               0, static_cast<int>(looks.size()) - 1);
  const cv::Mat& look = looks[level];
  const double scale = 1.0 / (kTexel * (1 << level));
  const double column = std::clamp(u * scale - 0.5, 0.0, look.cols - 1.001);
  const double row = std::clamp(v * scale - 0.5, 0.0, look.rows - 1.001);
  const int x = static_cast<int>(column), y = static_cast<int>(row);
  const double a = column - x, b = row - y;
  const float *top = look.ptr<float>(y) + x, *below = look.ptr<float>(y + 1) + x;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * below[0] + a * below[1]);
}

Rigid3 SquaresSource::PoseAt(double t) const {
  const auto sway = [&](double hz, int k) { return std::sin(2.0 * kPi * hz * t + phases_[k]); };
  const auto smooth = [](double x) {
    const double c = std::clamp(x, 0.0, 1.0);
    return c * c * c * (10.0 + c * (-15.0 + 6.0 * c));
  };
  Vector3d at(1.05 + 0.25 * sway(0.21, 0) + 0.05 * sway(0.7, 1), 0.10 * sway(0.27, 2),
              0.25 + 0.25 * sway(0.17, 3));
  Vector3d looked(0.80 + 0.20 * sway(0.19, 4), 0.10 * sway(0.31, 5), kFrontZ);
  double roll = 0.05 * sway(0.23, 6);
  if (options_.motion == HallMotion::kFlip) {
    // 5 to 20 degrees from the square's normal, round it, at 1.2 to 1.5 m.
    const double off = (12.5 + 7.5 * std::sin(2.0 * kPi * 0.13 * t + phases_[0])) * kPi / 180.0;
    const double round = 2.0 * kPi * 0.05 * t + 0.8 * sway(0.08, 1);
    const double far = 1.35 + 0.12 * sway(0.11, 2);
    const Vector3d square(1.2, 0.0, kFrontZ);
    at = square + far * Vector3d(std::sin(off) * std::cos(round), std::sin(off) * std::sin(round),
                                 -std::cos(off));
    looked = square + Vector3d(0.15 * sway(0.12, 4), 0.10 * sway(0.15, 5), 0.0);
    roll = 0.1 * sway(0.1, 6);
  }
  if (options_.motion == HallMotion::kAway) {
    // Away from 4 s on for twenty seconds, and back over the last.
    const double gone = smooth((t - 4.0) / 6.0) - smooth((t - 18.0) / 6.0);
    at.x() += 2.6 * gone;
    at.z() -= 0.4 * gone;
    looked = (1.0 - gone) * looked +
             gone * Vector3d(kLength, 0.15 * sway(0.19, 5), 0.9 + 0.6 * sway(0.17, 4));
  }
  const Vector3d line = looked - at;
  const double yaw = std::atan2(line.x(), line.z());
  const double pitch = std::atan2(-line.y(), std::hypot(line.x(), line.z()));
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw, Vector3d::UnitY()) *
                                Eigen::AngleAxisd(pitch, Vector3d::UnitX()) *
                                Eigen::AngleAxisd(roll, Vector3d::UnitZ()));
  return {turn, at};
}

Rigid3 SquaresSource::WorldFromCamera(FrameId frame) const { return PoseAt(TimeOf(frame)); }

bool SquaresSource::Covered(FrameId frame, std::size_t k) const {
  if (!ThingAt(frame).isEmpty()) {
    int hidden = 0;
    for (int c = 0; c < 4; ++c) hidden += Hidden(frame, k, c) ? 1 : 0;
    return hidden == 4;
  }
  if (options_.motion != HallMotion::kSquares) return false;
  const double t = TimeOf(frame);
  return kAll.Holds(t) || (kHalf.Holds(t) && k % 2 == 0);
}

void SquaresSource::Cover(FrameId frame, cv::Mat& picture) const {
  if (options_.motion != HallMotion::kSquares) return;
  const Rigid3 camera_from_world = WorldFromCamera(frame).Inverse();
  for (std::size_t k = 0; k < map_.squares.size(); ++k) {
    if (!Covered(frame, k)) continue;
    const KnownSquare& square = map_.squares[k];
    std::vector<cv::Point> polygon;
    for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
      const Vector3d corner = kCoverShare * square.side_m * Vector3d(x, y, 0);
      const auto pixel =
          info_.camera->Project(camera_from_world * (square.world_from_square * corner));
      if (pixel && pixel->cwiseAbs().maxCoeff() < 1e4) {
        polygon.emplace_back(static_cast<int>(pixel->x()), static_cast<int>(pixel->y()));
      }
    }
    if (polygon.size() == 4) cv::fillConvexPoly(picture, polygon, cv::Scalar(kHand));
  }
}

cv::Mat SquaresSource::Draw(FrameId frame) const {
  const CameraIntrinsics& lens = info_.camera->intrinsics();
  const Rigid3 pose = WorldFromCamera(frame);
  const Eigen::Matrix3d turn = pose.RotationMatrix();
  const Eigen::AlignedBox3d thing = ThingAt(frame);
  cv::Mat picture(lens.height, lens.width, CV_32F);
  for (int y = 0; y < lens.height; ++y) {
    float* row = picture.ptr<float>(y);
    const Vector3d down = turn.col(1) * ((y - lens.cy) / lens.fy) + turn.col(2);
    for (int x = 0; x < lens.width; ++x) {
      row[x] = static_cast<float>(
          Look(pose.translation, down + turn.col(0) * ((x - lens.cx) / lens.fx), thing));
    }
  }
  Cover(frame, picture);
  cv::GaussianBlur(picture, picture, {}, kLens_px);
  cv::Mat noise(picture.size(), CV_32F);
  cv::RNG(options_.seed * 1000003 + frame).fill(noise, cv::RNG::NORMAL, 0.0, options_.noise);
  cv::Mat grey;
  cv::Mat(picture + noise).convertTo(grey, CV_8U);
  return grey;
}

absl::StatusOr<std::optional<Frame>> SquaresSource::Next() {
  if (next_ >= *info_.frame_count) return std::optional<Frame>();
  Frame frame;
  frame.id = next_++;
  frame.capture_time_ns = static_cast<Timestamp>(std::llround(1e9 * TimeOf(frame.id)));
  frame.received_time_ns = frame.capture_time_ns;
  frame.camera = info_.camera;
  frame.grey = Draw(frame.id);
  return std::optional<Frame>(std::move(frame));
}

}  // namespace saccade
