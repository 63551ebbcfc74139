#include "server/eval/points_world.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace saccade {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Draws, in an order that does not depend on the standard library: normal_distribution may.
class PointsWalk::Draw {
 public:
  explicit Draw(std::uint64_t seed) : rng_(seed) {}
  double Uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(rng_() >> 11) * 0x1.0p-53);
  }
  double Normal() {  // Box and Muller
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform(0.0, 1.0)));
    return radius * std::cos(2.0 * std::numbers::pi * Uniform(0.0, 1.0));
  }
  Vector3d Normal3(double sigma) {
    const double x = Normal(), y = Normal(), z = Normal();
    return sigma * Vector3d(x, y, z);
  }

 private:
  std::mt19937_64 rng_;
};

namespace {

const Vector3d kHalfRoom_m(2.0, 1.25, 2.0);
constexpr double kMinDepth_m = 0.3;

CameraModel RoomCamera(double fps) {
  CameraIntrinsics camera;
  camera.model = LensModel::kBrownConrady;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 457.0;  // 70 degrees wide
  camera.cx = 319.5;
  camera.cy = 239.5;
  camera.distortion = {-0.12, 0.03, 0, 0, 0};
  camera.fps = fps;
  return CameraModel(camera);
}

/// Four in five points lie on walls, floor and ceiling, the rest on things in the room.
template <typename Draw>
Vector3d RandomPoint(Draw& draw) {
  const Vector3d unit(draw.Uniform(-1, 1), draw.Uniform(-1, 1), draw.Uniform(-1, 1));
  Vector3d point = unit.cwiseProduct(kHalfRoom_m);
  const double where = draw.Uniform(0, 5);
  if (where < 4) {
    const int axis = where < 1.6 ? 0 : where < 3.2 ? 2 : 1;  // by area: walls before floor
    point[axis] = std::copysign(kHalfRoom_m[axis], unit[axis]);
  } else if (Vector2d(point.x(), point.z()).norm() < 1.0) {
    point.z() = 1.3;  // not where the wearer stands
  }
  return point;
}

/// The start-up target: a ring half a metre wide, 1.2 m before the wearer.
Vector3d TargetPoint(int i, int count) {
  const double angle = 2.0 * std::numbers::pi * i / std::max(count, 1);
  return {0.25 * std::cos(angle), 0.2 * std::sin(angle), 1.2 + 0.05 * (i % 2)};
}

/// One step of the agile model M1 (slam-spec section 3), drawn back to the middle of the room and
/// to where the wearer means to look: weakly beside the model's noise.
template <typename Draw>
void Move(Draw& draw, const PointsOptions& options, double time_s, double dt, PointsFrame& state) {
  constexpr double kSpring = 0.6, kDamping = 1.2;          // of position [1/s^2, 1/s]
  constexpr double kTurnSpring = 6.0, kTurnDamping = 5.0;  // of direction
  const double yaw = 0.6 * std::sin(2.0 * std::numbers::pi * time_s / 20.0);
  const Vector3d aim =
      LogQuaternion(state.world_from_camera.rotation.conjugate() * ExpQuaternion({0, yaw, 0}));
  const Vector3d pull =
      -kSpring * state.world_from_camera.translation - kDamping * state.velocity_in_world;
  const Vector3d turn = kTurnSpring * aim - kTurnDamping * state.angular_velocity_in_camera;
  state.velocity_in_world += dt * (pull + draw.Normal3(options.linear_sigma));
  state.angular_velocity_in_camera += dt * (turn + draw.Normal3(options.angular_sigma));
  state.world_from_camera.translation += dt * state.velocity_in_world;
  state.world_from_camera.rotation =
      (state.world_from_camera.rotation * ExpQuaternion(dt * state.angular_velocity_in_camera))
          .normalized();
}

template <typename Draw>
void Observe(Draw& draw, const PointsOptions& options, const PointsWorld& world, double time_s,
             PointsFrame& frame) {
  const Rigid3 camera_from_world = frame.world_from_camera.Inverse();
  for (int i = 0; i < static_cast<int>(world.points.size()); ++i) {
    const Vector3d point = camera_from_world * PointAt(world, options, i, time_s);
    if (point.z() < kMinDepth_m) continue;
    const auto exact = world.camera.Project(point);
    if (!exact || !world.camera.InImage(*exact)) continue;
    const double u = draw.Normal(), v = draw.Normal();
    frame.observations.push_back({i, *exact + options.noise_px * Vector2d(u, v)});
  }
}

/// Somebody about half a metre wide who stands before the wearer.
template <typename Draw>
Vector3d PersonPoint(Draw& draw) {
  return {draw.Uniform(-0.25, 0.25), draw.Uniform(-0.3, 0.4), draw.Uniform(1.3, 1.4)};
}

}  // namespace

Vector3d PointAt(const PointsWorld& world, const PointsOptions& options, int i, double time_s) {
  constexpr double kSpan_m = 0.8, kPeriod_s = 6.0;  // to and fro at up to 0.84 m/s
  Vector3d point = world.points[static_cast<std::size_t>(i)];
  const double since = time_s - options.moving_from_s;
  if (i >= options.points - options.moving_points && since > 0.0) {
    point.x() += kSpan_m * std::sin(2.0 * std::numbers::pi * since / kPeriod_s);
  }
  return point;
}

PointsWalk::PointsWalk(const PointsOptions& options)
    : options_(options), draw_(std::make_unique<Draw>(options.seed)) {
  world_.camera = RoomCamera(options.fps);
  world_.dt_s = 1.0 / options.fps;
  for (int i = 0; i < options.points; ++i) {
    const bool moves = i >= options.points - options.moving_points;
    world_.points.push_back(i < options.target_points ? TargetPoint(i, options.target_points)
                            : moves                   ? PersonPoint(*draw_)
                                                      : RandomPoint(*draw_));
  }
}

PointsWalk::~PointsWalk() = default;

const PointsFrame& PointsWalk::Next() {
  const double time_s = next_ * world_.dt_s;
  if (next_ > 0) Move(*draw_, options_, time_s, world_.dt_s, state_);
  state_.observations.clear();
  Observe(*draw_, options_, world_, time_s, state_);
  ++next_;
  return state_;
}

PointsWorld MakePointsWorld(const PointsOptions& options) {
  PointsWalk walk(options);
  PointsWorld world = walk.world();
  const int count = static_cast<int>(std::lround(options.duration_s * options.fps));
  for (int k = 0; k < count; ++k) world.frames.push_back(walk.Next());
  return world;
}

}  // namespace saccade
