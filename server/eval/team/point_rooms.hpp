#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "shared/geometry/similarity3.hpp"
#include "shared/scene/team_keyframe.hpp"

namespace saccade {

/// A point of a room, and what it looks like at the middle scale and its neighbours.
struct RoomPoint {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  // [m]
  std::array<std::array<std::uint64_t, 4>, TeamPoint::kScales> look{};
};

/// A poster (all points in one plane) or a piece of furniture, in its own frame.
using RoomThing = std::vector<RoomPoint>;
RoomThing MakePoster(std::mt19937_64& random);
RoomThing MakeFurniture(std::mt19937_64& random);

/// Four walls of 4 m, 2.5 m high, posters and furniture along them, small things all over. No
/// pictures: what a keyframe would say of them.
struct PointRoom {
  std::vector<RoomPoint> points;
};

/// What two rooms have in common.
enum class RoomsShare { kNothing, kPosters, kFurniture, kCorner, kThings, kCount };
const char* ToString(RoomsShare share);

/// Two rooms that differ but for what `share` says: three posters; one piece of furniture; a desk
/// with a poster above it, arranged the same; three pieces of furniture, arranged otherwise.
std::array<PointRoom, 2> MakeRooms(RoomsShare share, std::mt19937_64& random);

struct PointWalkOptions {
  int keyframes = 24;
  double pixel_sigma = 0.6, range_sigma = 0.02;        // [px], share
  double seen_again = 0.65;                            // of the points in view
  double range_known = 0.55;                           // of those seen
  double flipped = 0.09;                               // share of bits from look to look
  Similarity3 map_from_room;                           // where the walker's map began, and its unit
  double yaw_from = 0.0, yaw_turn = 6.0;               // [rad], over the walk
  double position_sigma = 0.004, angle_sigma = 0.002;  // of the keyframes' poses [m, rad]
  double every_s = 0.4;
  bool metric = true;
};

/// Keyframes that somebody would tell who walks about in the middle of the room and looks round.
std::vector<TeamKeyframe> WalkThrough(const PointRoom& room, const PointWalkOptions& options,
                                      std::mt19937_64& random);

}  // namespace saccade
