#include "server/eval/team/mrclam_run.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>

#include "server/team/reorder_buffer.hpp"

namespace saccade {
namespace {

struct Event {
  Timestamp time_ns = 0, arrival_ns = 0;
  int robot = 0;
  std::size_t sequence = 0;
  bool is_sight = false;
  std::size_t index = 0;  // in the robot's own list
};

enum class Change { kPlace, kJoin, kLeave };
struct Membership {
  Timestamp time_ns = 0;
  int robot = 0;
  Change change = Change::kPlace;
};

/// From 0, below 1; the same everywhere.
double Uniform(std::mt19937_64& engine) { return static_cast<double>(engine() >> 11) * 0x1p-53; }

/// All events in the order in which they arrive.
std::vector<Event> Arrivals(const MrclamData& data, const TeamSettings& settings,
                            std::size_t& lost) {
  std::mt19937_64 engine(static_cast<std::uint64_t>(settings.seed));
  std::vector<Event> events;
  for (std::size_t r = 0; r < data.robots.size(); ++r) {
    const MrclamRobot& robot = data.robots[r];
    std::size_t sequence = 0;
    const auto add = [&](Timestamp time_ns, bool is_sight, std::size_t index) {
      const double delay_ns = settings.delay_ms * 1e6 * Uniform(engine);
      const bool gone = Uniform(engine) < settings.loss;
      if (is_sight && gone) {
        ++lost;
        return;
      }
      events.push_back({time_ns, time_ns + std::llround(delay_ns), static_cast<int>(r) + 1,
                        sequence++, is_sight, index});
    };
    for (std::size_t k = 0; k < robot.odometry.size(); ++k)
      add(robot.odometry[k].time_ns, false, k);
    for (std::size_t k = 0; k < robot.sights.size(); ++k) add(robot.sights[k].time_ns, true, k);
  }
  std::sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
    return std::tie(a.arrival_ns, a.time_ns, a.robot, a.sequence) <
           std::tie(b.arrival_ns, b.time_ns, b.robot, b.sequence);
  });
  return events;
}

Timestamp BeginOf(const MrclamData& data) {
  Timestamp begin_ns = data.robots.front().odometry.front().time_ns;
  for (const MrclamRobot& robot : data.robots) {
    begin_ns = std::min(begin_ns, robot.odometry.front().time_ns);
  }
  return begin_ns;
}

absl::StatusOr<std::vector<Membership>> Memberships(const MrclamData& data,
                                                    const TeamSettings& settings,
                                                    Timestamp begin_ns) {
  std::vector<Membership> all;
  for (std::size_t r = 0; r < data.robots.size(); ++r) {
    const Timestamp time_ns = data.robots[r].odometry.front().time_ns;
    // Where there is no truth to start from, by what it sees.
    const bool place = settings.start_by_truth && TruthAt(data.robots[r].truth, time_ns);
    all.push_back({time_ns, static_cast<int>(r) + 1, place ? Change::kPlace : Change::kJoin});
  }
  for (const TeamAway& away : settings.away) {
    if (away.robot > static_cast<int>(data.robots.size())) {
      return absl::InvalidArgumentError(absl::StrCat("team.away: there is no robot ", away.robot,
                                                     "; there are ", data.robots.size()));
    }
    all.push_back({begin_ns + std::llround(away.from_s * 1e9), away.robot, Change::kLeave});
    all.push_back({begin_ns + std::llround(away.until_s * 1e9), away.robot, Change::kJoin});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Membership& a, const Membership& b) { return a.time_ns < b.time_ns; });
  return all;
}

class Replay {
 public:
  Replay(const MrclamData& data, const TeamSettings& settings, Timestamp begin_ns,
         std::vector<Membership> memberships)
      : data_(data),
        settings_(settings),
        team_(settings.planar),
        begin_ns_(begin_ns),
        memberships_(std::move(memberships)) {
    result_.robots.resize(data.robots.size());
  }

  void Handle(const Event& event) {
    Until(event.time_ns);
    const MrclamRobot& robot = data_.robots[static_cast<std::size_t>(event.robot - 1)];
    if (!event.is_sight) {
      team_.Odometry(event.robot, event.time_ns, robot.odometry[event.index].command);
      return;
    }
    const MrclamSight& seen = robot.sights[event.index];
    const auto landmark = data_.landmarks.find(seen.subject);
    if (landmark != data_.landmarks.end()) {
      if (settings_.landmarks > 0 && event.robot > settings_.landmarks) return;
      team_.SeeLandmark(event.robot, event.time_ns, seen.subject, landmark->second, seen.sight);
    } else if (settings_.joint) {
      team_.SeeRobot(event.robot, event.time_ns, seen.subject, seen.sight);
    }
  }

  MrclamResult Result() {
    result_.counts = team_.counts();
    return std::move(result_);
  }

 private:
  /// Who comes, who goes and what is written, before `time_ns`.
  void Until(Timestamp time_ns) {
    for (;;) {
      const Timestamp grid_ns =
          begin_ns_ + std::llround(static_cast<double>(written_) * 1e9 / settings_.rate_hz);
      const bool change = changed_ < memberships_.size() &&
                          memberships_[changed_].time_ns <= std::min(grid_ns, time_ns);
      if (change) {
        Apply(memberships_[changed_++]);
      } else if (grid_ns < time_ns) {
        Write(grid_ns);
        ++written_;
      } else {
        return;
      }
    }
  }

  void Apply(const Membership& membership) {
    if (membership.change == Change::kLeave) return team_.Leave(membership.robot);
    const auto& truth = data_.robots[static_cast<std::size_t>(membership.robot - 1)].truth;
    // Who is there already stays: times away that overlap.
    if (membership.change == Change::kPlace) {
      team_.Place(membership.robot, *TruthAt(truth, membership.time_ns), membership.time_ns)
          .IgnoreError();
    } else {
      team_.Join(membership.robot, membership.time_ns).IgnoreError();
    }
  }

  void Write(Timestamp time_ns) {
    for (std::size_t r = 0; r < data_.robots.size(); ++r) {
      // What has no odometry any more is not claimed to be anywhere.
      if (time_ns > data_.robots[r].odometry.back().time_ns) continue;
      if (const auto belief = team_.At(static_cast<int>(r) + 1, time_ns)) {
        result_.robots[r].push_back({time_ns, *belief});
      }
    }
  }

  const MrclamData& data_;
  const TeamSettings& settings_;
  PlanarTeam team_;
  Timestamp begin_ns_;
  std::vector<Membership> memberships_;
  std::size_t changed_ = 0;
  std::int64_t written_ = 0;
  MrclamResult result_;
};

}  // namespace

absl::StatusOr<MrclamResult> RunMrclam(const MrclamData& data, const TeamSettings& settings) {
  const Timestamp begin_ns = BeginOf(data);
  absl::StatusOr<std::vector<Membership>> memberships = Memberships(data, settings, begin_ns);
  if (!memberships.ok()) return memberships.status();
  std::size_t lost = 0;
  const std::vector<Event> arrivals = Arrivals(data, settings, lost);
  Replay replay(data, settings, begin_ns, *std::move(memberships));
  ReorderBuffer<Event> buffer(std::llround(settings.hold_ms * 1e6));
  for (const Event& event : arrivals) {
    buffer.Push(event.time_ns, event.robot, event.sequence, event);
    for (const Event& ready : buffer.Ready()) replay.Handle(ready);
  }
  for (const Event& rest : buffer.Rest()) replay.Handle(rest);
  MrclamResult result = replay.Result();
  result.late = buffer.late();
  result.lost = lost;
  return result;
}

MrclamScore ScoreMrclam(const std::vector<MrclamPose>& poses,
                        const std::vector<MrclamTruth>& truth) {
  MrclamScore score;
  score.poses = poses.size();
  for (const MrclamPose& each : poses) {
    const auto there = TruthAt(truth, each.time_ns);
    if (!there) continue;
    const Eigen::Vector2d off = each.belief.state.head<2>() - there->head<2>();
    const double turned = std::remainder(each.belief.state[kHeading] - there->z(), 2 * M_PI);
    ++score.compared;
    score.sum_m2 += off.squaredNorm();
    score.sum_rad2 += turned * turned;
    score.worst_m = std::max(score.worst_m, off.norm());
    score.sum_nees += off.dot(each.belief.covariance.topLeftCorner<2, 2>().ldlt().solve(off));
  }
  return score;
}

}  // namespace saccade
