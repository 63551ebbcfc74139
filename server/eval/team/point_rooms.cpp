#include "server/eval/team/point_rooms.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace saccade {
namespace {

constexpr double kSide_m = 4.0, kHeight_m = 2.5;
constexpr double kNearest_m = 0.3;
constexpr std::size_t kMostPoints = 400;

double Uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

Eigen::Vector3d Normal3(std::mt19937_64& random, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  const double x = normal(random), y = normal(random), z = normal(random);
  return {x, y, z};
}

RoomPoint MakePoint(std::mt19937_64& random, const Eigen::Vector3d& at) {
  RoomPoint point;
  point.at = at;
  for (auto& scale : point.look) {
    for (std::uint64_t& word : scale) word = random();
  }
  return point;
}

/// Frame of a wall, 0 to 3: x along it, y down, z into the room; origin on the floor line, middle.
Rigid3 RoomFromWall(int wall) {
  const double turn = wall * std::numbers::pi / 2;
  const Eigen::Quaterniond rotation = ExpQuaternion({0, turn, 0});
  return {rotation, rotation * Eigen::Vector3d(0, 0, -kSide_m / 2)};
}

void Put(const RoomThing& thing, const Rigid3& room_from_thing, PointRoom& room) {
  for (RoomPoint point : thing) {
    point.at = room_from_thing * point.at;
    room.points.push_back(point);
  }
}

void PutOnWall(const RoomThing& thing, int wall, double along, double up, PointRoom& room) {
  Put(thing,
      RoomFromWall(wall) * Rigid3{Eigen::Quaterniond::Identity(), Eigen::Vector3d(along, -up, 0)},
      room);
}

/// What hangs and stands about in any room: texture of the walls, small things before them.
PointRoom Bare(std::mt19937_64& random) {
  PointRoom room;
  for (int wall = 0; wall < 4; ++wall) {
    for (int k = 0; k < 110; ++k) {
      const double along = Uniform(random, -kSide_m / 2, kSide_m / 2);
      const double up = Uniform(random, 0.0, kHeight_m);
      const double off = k % 3 == 0 ? Uniform(random, 0.0, 0.5) : 0.0;
      room.points.push_back(
          MakePoint(random, RoomFromWall(wall) * Eigen::Vector3d(along, -up, off)));
    }
  }
  return room;
}

void Furnish(std::mt19937_64& random, PointRoom& room) {
  for (int wall = 0; wall < 4; ++wall) {
    PutOnWall(MakePoster(random), wall, Uniform(random, -1.5, 1.5), Uniform(random, 1.3, 1.8),
              room);
    PutOnWall(MakeFurniture(random), wall, Uniform(random, -1.4, 1.4), 0.4, room);
  }
}

TeamPoint Seen(const RoomPoint& point, const PointWalkOptions& options, std::mt19937_64& random) {
  TeamPoint seen;
  std::bernoulli_distribution flips(options.flipped);
  for (int scale = 0; scale < TeamPoint::kScales; ++scale) {
    seen.present[scale] = true;
    for (int word = 0; word < 4; ++word) {
      std::uint64_t mask = 0;
      for (int bit = 0; bit < 64; ++bit) mask |= std::uint64_t{flips(random)} << bit;
      seen.descriptors[scale][word] = point.look[scale][word] ^ mask;
    }
  }
  return seen;
}

TeamKeyframe Look(const PointRoom& room, const Rigid3& room_from_camera, const CameraModel& camera,
                  const PointWalkOptions& options, std::mt19937_64& random) {
  TeamKeyframe keyframe;
  keyframe.camera = camera.intrinsics();
  keyframe.metric = options.metric;
  Rigid3 estimated = options.map_from_room.Move(room_from_camera);
  estimated.translation += Normal3(random, options.position_sigma * options.map_from_room.scale);
  estimated.rotation =
      (estimated.rotation * ExpQuaternion(Normal3(random, options.angle_sigma))).normalized();
  keyframe.world_from_camera = estimated;
  std::bernoulli_distribution again(options.seen_again), known(options.range_known);
  for (const RoomPoint& point : room.points) {
    const Eigen::Vector3d there = room_from_camera.Inverse() * point.at;
    const auto pixel = camera.Project(there);
    if (!pixel || there.norm() < kNearest_m || !camera.InImage(*pixel, 12.0) || !again(random)) {
      continue;
    }
    if (keyframe.points.size() == kMostPoints) break;
    TeamPoint seen = Seen(point, options, random);
    const Eigen::Vector3d noise = Normal3(random, 1.0);
    seen.pixel = *pixel + options.pixel_sigma * noise.head<2>();
    const double range =
        there.norm() * options.map_from_room.scale * (1.0 + options.range_sigma * noise.z());
    seen.range = known(random) ? range : 0.0;
    keyframe.points.push_back(seen);
  }
  return keyframe;
}

}  // namespace

const char* ToString(RoomsShare share) {
  switch (share) {
    case RoomsShare::kNothing:
      return "nothing";
    case RoomsShare::kPosters:
      return "posters";
    case RoomsShare::kFurniture:
      return "furniture";
    case RoomsShare::kCorner:
      return "desk_and_poster";
    case RoomsShare::kThings:
      return "three_things_moved";
    case RoomsShare::kCount:
      break;
  }
  return "";
}

RoomThing MakePoster(std::mt19937_64& random) {
  RoomThing poster;
  for (int k = 0; k < 60; ++k) {
    const double x = Uniform(random, -0.35, 0.35), y = Uniform(random, -0.3, 0.3);
    poster.push_back(MakePoint(random, {x, y, 0.01}));
  }
  return poster;
}

RoomThing MakeFurniture(std::mt19937_64& random) {
  RoomThing furniture;
  for (int k = 0; k < 80; ++k) {
    const double x = Uniform(random, -0.5, 0.5), y = Uniform(random, -0.4, 0.4);
    furniture.push_back(MakePoint(random, {x, y, Uniform(random, 0.0, 0.6)}));
  }
  return furniture;
}

std::array<PointRoom, 2> MakeRooms(RoomsShare share, std::mt19937_64& random) {
  std::array<PointRoom, 2> rooms{Bare(random), Bare(random)};
  const RoomThing poster = MakePoster(random), other = MakePoster(random),
                  third = MakePoster(random);
  const RoomThing desk = MakeFurniture(random), shelf = MakeFurniture(random),
                  chair = MakeFurniture(random);
  const double along = Uniform(random, -0.8, 0.8);
  for (PointRoom& room : rooms) {
    const auto where = [&] { return Uniform(random, -1.4, 1.4); };
    const auto wall = [&] { return static_cast<int>(random() % 4); };
    if (share == RoomsShare::kPosters) {
      for (const RoomThing* each : {&poster, &other, &third}) {
        PutOnWall(*each, wall(), where(), Uniform(random, 1.3, 1.8), room);
      }
    }
    if (share == RoomsShare::kFurniture) PutOnWall(desk, wall(), where(), 0.4, room);
    if (share == RoomsShare::kCorner) {
      const int here = wall();
      PutOnWall(desk, here, along, 0.6, room);
      PutOnWall(poster, here, along + 0.2, 1.5, room);
    }
    if (share == RoomsShare::kThings) {
      for (const RoomThing* each : {&desk, &shelf, &chair}) {
        PutOnWall(*each, wall(), where(), 0.4, room);
      }
    }
    Furnish(random, room);
    // Where the picture holds more than a keyframe tells, no thing comes first.
    std::shuffle(room.points.begin(), room.points.end(), random);
  }
  return rooms;
}

std::vector<TeamKeyframe> WalkThrough(const PointRoom& room, const PointWalkOptions& options,
                                      std::mt19937_64& random) {
  CameraIntrinsics intrinsics;
  intrinsics.width = 640;
  intrinsics.height = 480;
  intrinsics.fx = intrinsics.fy = 457.0;
  intrinsics.cx = 319.5;
  intrinsics.cy = 239.5;
  const CameraModel camera(intrinsics);
  std::vector<TeamKeyframe> told;
  const double phase = Uniform(random, 0.0, 6.28);
  for (int k = 0; k < options.keyframes; ++k) {
    const double share = static_cast<double>(k) / options.keyframes;
    const double yaw = options.yaw_from + options.yaw_turn * share;
    Rigid3 room_from_camera;
    room_from_camera.rotation =
        ExpQuaternion({0, yaw, 0}) *
        ExpQuaternion({0.15 * std::sin(5 * share + phase), 0, 0.05 * std::sin(9 * share)});
    room_from_camera.translation = {0.7 * std::sin(4 * share + phase),
                                    -1.3 + 0.2 * std::sin(7 * share),
                                    0.7 * std::cos(3 * share + phase)};
    TeamKeyframe keyframe = Look(room, room_from_camera, camera, options, random);
    keyframe.frame = static_cast<FrameId>(k);
    keyframe.edition = 1;
    keyframe.capture_time_ns = static_cast<Timestamp>(k * options.every_s * 1e9);
    keyframe.told_time_ns = keyframe.capture_time_ns;
    told.push_back(std::move(keyframe));
  }
  return told;
}

}  // namespace saccade
