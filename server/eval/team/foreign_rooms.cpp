#include "server/eval/team/foreign_rooms.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/eval/statistics.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kCommon_m = 0.5, kCommon_rad = 0.5236;
constexpr double kRoomDegrees = 180.0 / std::numbers::pi;

Similarity3 AnyMap(std::mt19937_64& random, bool metric) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Similarity3 map;
  const double x = unit(random), y = unit(random), z = unit(random);
  map.rotation = ExpQuaternion({0.3 * x, 3.0 * y, 0.3 * z});
  map.translation = {2 * y, z, 2 * x};
  map.scale = metric ? 1.0 : std::exp(0.7 * unit(random));
  return map;
}

void Compare(const MapJoin& join, const Similarity3& truth, WalkersResult& result) {
  const Similarity3& found = join.fit.own_from_other;
  const Similarity3 off = found * truth.Inverse();
  result.off_deg = LogQuaternion(off.rotation).norm() * kRoomDegrees;
  Eigen::Matrix<double, 7, 1> error;
  error << off.translation, LogQuaternion(off.rotation), std::log(off.scale);
  const int n = join.metric ? 6 : 7;
  const Eigen::MatrixXd covariance = join.fit.covariance.topLeftCorner(n, n);
  result.nees = error.head(n).dot(covariance.ldlt().solve(error.head(n)));
  for (const double x : {-2.0, 2.0}) {
    for (const double z : {-2.0, 2.0}) {
      const Eigen::Vector3d point(x, -1.2, z);  // of the room, about
      result.off_m = std::max(result.off_m, (found * point - truth * point).norm() / truth.scale);
    }
  }
}

/// When both had first told of about the same view [s]; the end of time if they never did.
double CommonView(const std::vector<TeamKeyframe>& own, const std::vector<TeamKeyframe>& other,
                  const Similarity3& truth) {
  double first = 1e9;
  for (const TeamKeyframe& a : own) {
    for (const TeamKeyframe& b : other) {
      const Rigid3 there = truth.Move(b.world_from_camera);
      const double apart_m =
          (there.translation - a.world_from_camera.translation).norm() / truth.scale;
      if (apart_m > kCommon_m || RotationAngle(there, a.world_from_camera) > kCommon_rad) continue;
      first = std::min(first, Seconds(std::max(a.told_time_ns, b.told_time_ns)));
    }
  }
  return first;
}

}  // namespace

WalkersResult LetMeet(const std::vector<TeamKeyframe>& own, const std::vector<TeamKeyframe>& other,
                      const std::optional<Similarity3>& truth, const MapJoinerOptions& options) {
  MapJoiner joiner(options);
  WalkersResult result;
  std::size_t a = 0, b = 0;
  while (a < own.size() || b < other.size()) {
    const bool first =
        b == other.size() || (a < own.size() && own[a].told_time_ns <= other[b].told_time_ns);
    joiner.Take(first ? MapSide::kOwn : MapSide::kOther, first ? own[a++] : other[b++]);
    joiner.Work();
    result.merged |= joiner.join().has_value();
  }
  joiner.Work(/*all=*/true);
  result.merged |= joiner.join().has_value();
  result.places = joiner.places_found();
  if (!joiner.join()) return result;
  result.after_s = Seconds(joiner.join()->since_ns);
  if (!truth) return result;
  Compare(*joiner.join(), *truth, result);
  result.common_s = CommonView(own, other, *truth);
  return result;
}

Json RunForeignRooms(int pairs, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Json report = {{"kind", "foreign"}, {"pairs", pairs}, {"seed", seed}};
  const int kinds = static_cast<int>(RoomsShare::kCount);
  std::vector<std::array<int, 3>> counts(static_cast<std::size_t>(kinds));  // pairs, merged, seen
  int merged = 0, same = 0, same_merged = 0;
  Sample off_m, off_deg, after_s, nees;
  for (int k = 0; k < pairs; ++k) {
    const auto share = static_cast<RoomsShare>(k % kinds);
    const auto rooms = MakeRooms(share, random);
    std::array<PointWalkOptions, 2> walks;
    for (PointWalkOptions& walk : walks) {
      walk.metric = (k / 10 + k) % 2 == 0;
      walk.map_from_room = AnyMap(random, walk.metric);
      walk.yaw_from = static_cast<double>(random() % 628) / 100.0;
    }
    const auto own = WalkThrough(rooms[0], walks[0], random);
    const auto other = WalkThrough(rooms[1], walks[1], random);
    const WalkersResult result = LetMeet(own, other, std::nullopt);
    auto& count = counts[static_cast<std::size_t>(share)];
    ++count[0];
    count[1] += result.merged ? 1 : 0;
    count[2] += result.places > 0 ? 1 : 0;
    merged += result.merged ? 1 : 0;
    if (k % 10 != 0) continue;
    walks[1].metric = walks[0].metric;
    const auto guest = WalkThrough(rooms[0], walks[1], random);
    const WalkersResult met =
        LetMeet(own, guest, walks[0].map_from_room * walks[1].map_from_room.Inverse());
    ++same;
    if (!met.merged) continue;
    ++same_merged;
    off_m.Add(met.off_m);
    off_deg.Add(met.off_deg);
    after_s.Add(met.after_s - met.common_s);
    nees.Add(met.nees);
  }
  report["merged"] = merged;
  for (int k = 0; k < kinds; ++k) {
    const auto& count = counts[static_cast<std::size_t>(k)];
    report["sharing"][ToString(static_cast<RoomsShare>(k))] = {
        {"pairs", count[0]}, {"merged", count[1]}, {"something_recognised", count[2]}};
  }
  report["same_room"] = {{"pairs", same}, {"merged", same_merged}};
  if (same_merged > 0) {
    report["same_room"].update(Json{{"off_m_median", off_m.Percentile(50)},
                                    {"off_m_max", off_m.Max()},
                                    {"off_deg_max", off_deg.Max()},
                                    {"after_common_view_s_median", after_s.Percentile(50)},
                                    {"after_common_view_s_max", after_s.Max()},
                                    {"nees_median", nees.Percentile(50)}});
  }
  return report;
}

}  // namespace saccade
