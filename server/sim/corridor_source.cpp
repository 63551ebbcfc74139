#include "server/sim/corridor_source.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr double kPi = std::numbers::pi;
// Room: x right, y down from the eyes' height, z ahead at the start; the block stands at 0.
constexpr double kHalfPath = 2.8, kBend = 1.2;  // of the way in the middle; radius of its corners
constexpr double kOuter = 3.7, kInner = 1.9, kFloorY = 1.4, kCeilingY = -1.2;
constexpr double kTexel = 0.006;      // [m]
constexpr double kStartAlong = 1.9;   // on the first side, from its beginning
constexpr double kLookAhead_m = 0.8;  // a turn begins before its bend, and ends after it
constexpr double kRest_s = 1.2, kStart_s = 1.5;
constexpr double kSquare = 0.12;     // of the board [m]
constexpr double kAside_rad = 0.22;  // the gaze, to the outer wall
const Eigen::Vector3d kBoardOrigin(-kHalfPath - 0.48, -0.35, kOuter);

double Straight() { return 2.0 * (kHalfPath - kBend); }
double Bend() { return 0.5 * kPi * kBend; }

struct Place {
  double x = 0.0, z = 0.0, heading = 0.0;  // 0: along +z; grows clockwise, seen from above
};

/// Of the way round, from the beginning of the first side (left one, walked towards +z).
Place PlaceAt(double along) {
  const double side_length = Straight() + Bend();
  const int side = static_cast<int>(std::floor(along / side_length));
  const double rest = along - side * side_length;
  Place place{-kHalfPath, -(kHalfPath - kBend) + rest, 0.0};
  if (rest > Straight()) {
    const double turned = (rest - Straight()) / kBend;
    place = {-kHalfPath + kBend * (1.0 - std::cos(turned)),
             kHalfPath - kBend + kBend * std::sin(turned), turned};
  }
  for (int k = 0; k < (side % 4 + 4) % 4; ++k) place = {place.z, -place.x, place.heading};
  place.heading += 0.5 * kPi * side;
  return place;
}

cv::Mat Grain(std::mt19937_64& random, int width, int height, int size) {
  cv::Mat coarse(std::max(2, height / size), std::max(2, width / size), CV_32F);
  std::normal_distribution<float> normal;
  for (int y = 0; y < coarse.rows; ++y) {
    for (int x = 0; x < coarse.cols; ++x) coarse.at<float>(y, x) = normal(random);
  }
  cv::Mat fine;
  cv::resize(coarse, fine, {width, height}, 0, 0, cv::INTER_CUBIC);
  return fine;
}

}  // namespace

double CorridorSource::Round_m() { return 4.0 * (Straight() + Bend()); }

CorridorSource::CorridorSource(const CorridorOptions& options) : options_(options) {
  CameraIntrinsics lens;
  lens.width = options.width;
  lens.height = options.height;
  lens.fx = lens.fy = 0.72 * options.width;
  lens.cx = 0.5 * (options.width - 1);
  lens.cy = 0.5 * (options.height - 1);
  info_.uri = "corridor";
  info_.camera = std::make_shared<const CameraModel>(lens);
  info_.target = ChessboardTarget{9, 6, kSquare, std::nullopt};
  const double standing_s = options.stand_s > 0.0 ? kStart_s + options.stand_s : 0.0;
  info_.frame_count = static_cast<std::uint64_t>((WalkEnd_s() + standing_s) * lens.fps);
  Paint();
}

cv::Mat CorridorSource::PaintWall(std::mt19937_64& random, int width, int height) const {
  cv::Mat look(height, width, CV_32F, cv::Scalar(128));
  look += 14.0 * Grain(random, width, height, 64) + 10.0 * Grain(random, width, height, 12) +
          5.0 * Grain(random, width, height, 4);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const int things = width * height / 6000;  // a rectangle each half foot or so
  for (int k = 0; k < things; ++k) {
    const double x = unit(random) * width, y = unit(random) * height;
    const double w = 6 + 30 * unit(random), h = 6 + 30 * unit(random);
    const double grey = 30 + 190 * unit(random), angle = 180 * unit(random);
    std::array<cv::Point2f, 4> corners;
    cv::RotatedRect({static_cast<float>(x), static_cast<float>(y)},
                    {static_cast<float>(w), static_cast<float>(h)}, static_cast<float>(angle))
        .points(corners.data());
    std::array<cv::Point, 4> polygon;
    for (int i = 0; i < 4; ++i) polygon[i] = corners[i];
    cv::fillConvexPoly(look, polygon.data(), 4, cv::Scalar(grey), cv::LINE_AA);
  }
  cv::Mat grey;
  look.convertTo(grey, CV_8U);
  return grey;
}

void CorridorSource::Paint() {
  std::mt19937_64 random(options_.seed);
  std::uniform_real_distribution<double> unit(0.0, 2.0 * kPi);
  for (double& phase : phases_) phase = unit(random);
  const auto texels = [](double metres) { return static_cast<int>(std::ceil(metres / kTexel)); };
  const int tall = texels(kFloorY - kCeilingY);
  std::mt19937_64 of_posters(options_.seed + 1000);
  const cv::Mat poster = PaintWall(of_posters, texels(1.2), texels(0.9));
  for (int k = 0; k < kSurfaces; ++k) {
    const bool flat = k == kFloor || k == kCeiling;
    const int wide = texels(2.0 * (k >= kInner0 ? kInner : kOuter));
    cv::Mat look = PaintWall(random, wide, flat ? wide : tall);
    if (options_.posters && k >= kOuter0 && k < kInner0) {
      poster.copyTo(
          look(cv::Rect(texels(kOuter) + texels(0.2), tall / 5, poster.cols, poster.rows)));
    }
    if (k == kOuter0) {  // the board, with a white margin
      const auto pixel = [&](double u, double y) {
        return cv::Point(static_cast<int>(std::lround((u + kOuter) / kTexel)),
                         static_cast<int>(std::lround((y - kCeilingY) / kTexel)));
      };
      const auto fill = [&](double i, double j, double columns, double rows, int grey) {
        const double u = kBoardOrigin.x() + kSquare * i, y = kBoardOrigin.y() + kSquare * j;
        cv::rectangle(look, cv::Rect(pixel(u, y), pixel(u + kSquare * columns, y + kSquare * rows)),
                      cv::Scalar(grey), cv::FILLED);
      };
      fill(-1.5, -1.5, 11, 8, 225);
      for (int i = -1; i < 9; ++i) {
        for (int j = -1; j < 6; ++j) fill(i, j, 1, 1, (i + j) % 2 == 0 ? 25 : 225);
      }
    }
    looks_[k].push_back(look);
    while (std::min(looks_[k].back().cols, looks_[k].back().rows) > 8) {
      cv::Mat half;
      cv::pyrDown(looks_[k].back(), half);
      looks_[k].push_back(half);
    }
  }
}

CorridorSource::Hit CorridorSource::Cast(const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
  Hit hit;
  hit.surface = d.y() > 0 ? kFloor : kCeiling;
  hit.range = ((d.y() > 0 ? kFloorY : kCeilingY) - o.y()) / d.y();
  if (!(std::abs(d.y()) > 1e-9)) hit.range = 1e9;
  hit.cosine = std::abs(d.y());
  const auto offer = [&](int surface, double range, double cosine) {
    if (range >= hit.range) return;
    hit.surface = surface;
    hit.range = range;
    hit.cosine = cosine;
  };
  // Walls, in the order in which they are walked past: +z, +x, -z, -x.
  const double x = std::abs(d.x()) > 1e-9 ? ((d.x() > 0 ? kOuter : -kOuter) - o.x()) / d.x() : 1e9;
  const double z = std::abs(d.z()) > 1e-9 ? ((d.z() > 0 ? kOuter : -kOuter) - o.z()) / d.z() : 1e9;
  offer(kOuter0 + (d.z() > 0 ? 0 : 2), z, std::abs(d.z()));
  offer(kOuter0 + (d.x() > 0 ? 1 : 3), x, std::abs(d.x()));
  const double x_near = std::abs(d.x()) > 1e-9 ? ((d.x() > 0 ? -kInner : kInner) - o.x()) / d.x()
                                               : (std::abs(o.x()) < kInner ? -1e9 : 1e9);
  const double z_near = std::abs(d.z()) > 1e-9 ? ((d.z() > 0 ? -kInner : kInner) - o.z()) / d.z()
                                               : (std::abs(o.z()) < kInner ? -1e9 : 1e9);
  const double near = std::max(x_near, z_near);
  const Eigen::Vector3d p = o + near * d;
  if (near > 0 && std::abs(p.x()) < kInner + 1e-6 && std::abs(p.z()) < kInner + 1e-6) {
    if (x_near > z_near) {
      offer(kInner0 + (d.x() > 0 ? 3 : 1), near, std::abs(d.x()));
    } else {
      offer(kInner0 + (d.z() > 0 ? 2 : 0), near, std::abs(d.z()));
    }
  }
  const Eigen::Vector3d at = o + hit.range * d;
  if (hit.surface == kFloor || hit.surface == kCeiling) {
    hit.u = at.x() + kOuter;
    hit.v = at.z() + kOuter;
    return hit;
  }
  const bool inner = hit.surface >= kInner0;
  const int side = hit.surface - (inner ? kInner0 : kOuter0);
  // To the right, for who walks towards the wall from inside the square.
  const std::array<double, 4> right = {at.x(), -at.z(), -at.x(), at.z()};
  hit.u = right[side] + (inner ? kInner : kOuter);
  hit.v = at.y() - kCeilingY;
  return hit;
}

/// Grey level; `length` of the direction that was cast (1 on the optic axis).
double CorridorSource::Look(const Hit& hit, double length) const {
  const auto& looks = looks_[hit.surface];
  const double footprint = hit.range * length / info_.camera->intrinsics().fx / kTexel /
                           std::sqrt(std::max(0.05, hit.cosine / length));
  const int level = std::clamp(static_cast<int>(std::lround(std::log2(std::max(1.0, footprint)))),
                               0, static_cast<int>(looks.size()) - 1);
  const cv::Mat& look = looks[level];
  const double scale = 1.0 / (kTexel * (1 << level));
  const double u = std::clamp(hit.u * scale - 0.5, 0.0, look.cols - 1.001);
  const double v = std::clamp(hit.v * scale - 0.5, 0.0, look.rows - 1.001);
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const double a = u - x, b = v - y;
  const auto* top = look.ptr<std::uint8_t>(y) + x;
  const auto* below = look.ptr<std::uint8_t>(y + 1) + x;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * below[0] + a * below[1]);
}

double CorridorSource::WalkEnd_s() const {
  return kRest_s + 0.5 * kStart_s + options_.way_m / options_.speed_m_s;
}

FrameId CorridorSource::StopFrame() const {
  return static_cast<FrameId>(WalkEnd_s() * info_.camera->intrinsics().fps);
}

double CorridorSource::Way_m(FrameId frame) const {
  const double t = static_cast<double>(frame) / info_.camera->intrinsics().fps - kRest_s;
  if (t <= 0) return 0.0;
  if (t < kStart_s) return 0.5 * options_.speed_m_s * t * t / kStart_s;
  const double past_end = std::clamp(t + kRest_s - WalkEnd_s(), 0.0, kStart_s);
  if (options_.stand_s <= 0.0 || past_end == 0.0) return options_.speed_m_s * (t - 0.5 * kStart_s);
  return options_.way_m + options_.speed_m_s * past_end * (1.0 - 0.5 * past_end / kStart_s);
}

double CorridorSource::GazePitch(double way) const {
  if (!options_.look_round) return 0.0;
  constexpr std::array<double, 3> kPitch_rad = {0.0, 0.45, -0.45};
  const auto round = static_cast<std::size_t>(way / Round_m());
  const double since =
      std::min(1.0, way - static_cast<double>(round) * Round_m());  // a metre's way
  const double now = kPitch_rad[round % kPitch_rad.size()];
  const double before = round == 0 ? 0.0 : kPitch_rad[(round - 1) % kPitch_rad.size()];
  return before + (now - before) * since * since * (3.0 - 2.0 * since);
}

Rigid3 CorridorSource::RoomFromCamera(FrameId frame) const {
  const double t = static_cast<double>(frame) / info_.camera->intrinsics().fps;
  const double way = Way_m(frame);
  const Place place = PlaceAt(kStartAlong + way);
  double heading = 0.0;
  constexpr int kSamples = 16;
  for (int k = 0; k < kSamples; ++k) {
    const double ahead = kLookAhead_m * ((k + 0.5) / (0.5 * kSamples) - 1.0);
    heading += PlaceAt(kStartAlong + way + ahead).heading / kSamples;
  }
  const double moving = std::clamp((t - kRest_s) / kStart_s, 0.0, 1.0);
  const auto sway = [&](double hz, int k) {
    return moving * std::sin(2.0 * kPi * hz * t + phases_[k]);
  };
  const double yaw =
      place.heading - moving * kAside_rad + 0.06 * sway(0.31, 0) + 0.02 * sway(0.9, 1);
  const double pitch = GazePitch(way) + 0.04 * sway(0.23, 2), roll = 0.02 * sway(0.45, 3);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()));
  return {turn, {place.x + 0.04 * sway(0.9, 4), 0.02 * sway(1.8, 5), place.z}};
}

Rigid3 CorridorSource::WorldFromCamera(FrameId frame) const {
  Rigid3 pose = RoomFromCamera(frame);
  pose.translation -= kBoardOrigin;
  return pose;
}

Eigen::Vector3d CorridorSource::PointAt(FrameId frame, const Eigen::Vector2d& pixel) const {
  const Rigid3 room = RoomFromCamera(frame);
  const Eigen::Vector3d direction = room.rotation * *info_.camera->Unproject(pixel);
  return room.translation + Cast(room.translation, direction).range * direction - kBoardOrigin;
}

cv::Mat CorridorSource::Draw(const Rigid3& room) const {
  const CameraIntrinsics& lens = info_.camera->intrinsics();
  cv::Mat grey(lens.height, lens.width, CV_8U);
  const Eigen::Matrix3d turn = room.RotationMatrix();
  for (int y = 0; y < lens.height; ++y) {
    auto* row = grey.ptr<std::uint8_t>(y);
    for (int x = 0; x < lens.width; ++x) {
      Eigen::Vector3d ray((x - lens.cx) / lens.fx, (y - lens.cy) / lens.fy, 1.0);
      ray.head<2>() *= 1.0 - options_.lens_error;
      const Hit hit = Cast(room.translation, turn * ray);
      row[x] = static_cast<std::uint8_t>(Look(hit, ray.norm()) + 0.5);
    }
  }
  return grey;
}

absl::StatusOr<std::optional<Frame>> CorridorSource::Next() {
  if (next_ >= *info_.frame_count) return std::optional<Frame>();
  Frame frame;
  frame.id = next_++;
  frame.capture_time_ns =
      static_cast<Timestamp>(1e9 * static_cast<double>(frame.id) / info_.camera->intrinsics().fps);
  frame.received_time_ns = frame.capture_time_ns;
  frame.camera = info_.camera;
  frame.grey = Draw(RoomFromCamera(frame.id));
  cv::Mat noise(frame.grey.size(), CV_16S);
  cv::RNG(options_.seed * 1000003 + frame.id).fill(noise, cv::RNG::NORMAL, 0.0, options_.noise);
  cv::add(frame.grey, noise, frame.grey, cv::noArray(), CV_8U);
  return std::optional<Frame>(std::move(frame));
}

}  // namespace saccade
