#include "server/eval/team/pair_run.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <iostream>

#include "server/eval/run_recorder.hpp"
#include "server/eval/team/pair_score.hpp"
#include "server/pipeline/frame_cost.hpp"
#include "server/pipeline/stop_watch.hpp"
#include "server/team/merge/keyframe_maker.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kCommon_m = 0.5, kCommon_rad = 0.5236;  // what counts as a common view
constexpr Timestamp kMatch_ns = 40'000'000;              // truth of a frame is no further away

/// One wearer while he runs.
struct Running {
  PairMember member;
  std::optional<Frame> next;
  Timestamp began_ns = 0;
  std::optional<RunRecorder> recorder;
  KeyframeMaker maker;
  std::vector<std::pair<double, Rigid3>> keyframes;  // told after [s], true pose
  std::size_t told = 0;
  double Due() const { return Seconds(next->capture_time_ns - began_ns); }
};

/// One order: whose map is `own`, and what came of it.
struct Order {
  MapJoiner joiner;
  std::optional<MapJoin> first;
  double merged_s = 0;
  int lost = 0;  // joins given up
  double slowest_ms = 0, total_ms = 0;
};

absl::Status Advance(Running& running) {
  absl::StatusOr<std::optional<Frame>> frame = running.member.source->Next();
  if (!frame.ok()) return frame.status();
  running.next = *std::move(frame);
  return absl::OkStatus();
}

void Hear(Order& order, MapSide side, const TeamKeyframe& keyframe) {
  order.joiner.Take(side, keyframe);
}

void WorkOff(Order& order, double now_s, bool all) {
  const bool was = order.joiner.join().has_value();
  StopWatch watch;
  order.joiner.Work(all);
  const double took = watch.Lap_ms();
  order.total_ms += took;
  order.slowest_ms = std::max(order.slowest_ms, took);
  if (was && !order.joiner.join()) ++order.lost;
  if (order.joiner.join() && !order.first) {
    order.first = order.joiner.join();
    order.merged_s = now_s;
  }
}

/// When both first had told of a place that the other had been near, by truth [s].
std::optional<double> CommonView(const Running& a, const Running& b) {
  std::optional<double> first;
  for (const auto& [ta, pa] : a.keyframes) {
    for (const auto& [tb, pb] : b.keyframes) {
      if ((pa.translation - pb.translation).norm() > kCommon_m ||
          RotationAngle(pa, pb) > kCommon_rad) {
        continue;
      }
      const double both = std::max(ta, tb);
      if (!first || both < *first) first = both;
    }
  }
  return first;
}

Json ErrorJson(const std::optional<MergeError>& error) {
  if (!error) return nullptr;
  return {{"off_m", error->off_m},          {"off_deg", error->off_deg},
          {"rms_m", error->rms_m},          {"rms_deg", error->rms_deg},
          {"sigma_m", error->sigma_m},      {"poses", error->poses},
          {"seam_m", error->seam_m},        {"seam_deg", error->seam_deg},
          {"seam_poses", error->seam_poses}};
}

/// `pairs`: of own and other; the map of the wider way carries.
Json JoinJson(const MapJoin& join, const std::vector<PosePair>& own,
              const std::vector<PosePair>& other) {
  const bool own_carries = TrueSpread(own) >= TrueSpread(other);
  // The covariance is of the own map's units and side; where the other carries it is left out.
  const Similarity3& own_from_other = join.fit.own_from_other;
  const auto error = own_carries
                         ? ScoreMerge(own, other, own_from_other, join.fit.covariance)
                         : ScoreMerge(other, own, own_from_other.Inverse(), Matrix7d::Zero());
  const Eigen::Vector3d& t = own_from_other.translation;
  const Eigen::Vector4d q = own_from_other.rotation.coeffs();
  return {{"own_from_other",
           {{"scale", own_from_other.scale},
            {"pose", {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}}}},
          {"metric", join.metric},
          {"places", join.places},
          {"disagreeing", join.disagreeing},
          {"views_tested", join.views_tested},
          {"views_contradicting", join.views_contradicting},
          {"cells_tested", join.cells},
          {"cells_empty", join.empty_cells},
          {"points", join.fit.points},
          {"rms_px", join.fit.rms_px},
          {"error", ErrorJson(error)}};
}

Json OrderJson(const Order& order, const std::vector<PosePair>& own,
               const std::vector<PosePair>& other, std::optional<double> common_s) {
  Json one = {{"merged", order.first.has_value()},
              {"places_found", order.joiner.places_found()},
              {"given_up", order.lost},
              {"slowest_ms", order.slowest_ms},
              {"total_ms", order.total_ms}};
  if (!order.first) return one;
  one["merged_s"] = order.merged_s;
  if (common_s) one["after_common_view_s"] = order.merged_s - *common_s;
  one["first"] = JoinJson(*order.first, own, other);
  if (order.joiner.join()) one["last"] = JoinJson(*order.joiner.join(), own, other);
  return one;
}

std::vector<PosePair> PairsOf(const Running& running) {
  const auto interval_ns =
      static_cast<Timestamp>(1e9 / running.member.source->info().camera->intrinsics().fps);
  return Associate(running.recorder->trajectory(), running.member.truth, interval_ns);
}

absl::Status Step(Running& running, std::array<Order, 2>& orders, int who, double now_s) {
  const Frame& frame = *running.next;
  CostMeter meter;
  const std::shared_ptr<const MapSnapshot> snapshot = running.member.track(frame);
  const FrameCost cost = meter.Read(snapshot->stage_ms.waited_ms);
  if (absl::Status added = running.recorder->Add(frame, *snapshot, cost); !added.ok()) return added;
  for (TeamKeyframe& keyframe : running.maker.Add(frame, *snapshot)) {
    // Both clocks count from the begin of the recordings here.
    keyframe.told_time_ns -= running.began_ns;
    ++running.told;
    const auto truth =
        PoseAt(running.member.truth, keyframe.capture_time_ns, 10 * kMatch_ns, kMatch_ns);
    if (keyframe.edition == 1 && truth) running.keyframes.emplace_back(now_s, *truth);
    for (int order = 0; order < 2; ++order) {
      Hear(orders[order], order == who ? MapSide::kOwn : MapSide::kOther, keyframe);
    }
  }
  for (Order& order : orders) WorkOff(order, now_s, false);
  return Advance(running);
}

}  // namespace

absl::StatusOr<Json> RunPair(std::array<PairMember, 2> members, const PairOptions& options) {
  std::array<Running, 2> running;
  std::array<Order, 2> orders{Order{MapJoiner(options.joiner), {}},
                              Order{MapJoiner(options.joiner), {}}};
  for (int k = 0; k < 2; ++k) {
    running[k].member = std::move(members[k]);
    auto recorder = RunRecorder::Create(options.out / running[k].member.name);
    if (!recorder.ok()) return recorder.status();
    running[k].recorder.emplace(*std::move(recorder));
    if (absl::Status status = Advance(running[k]); !status.ok()) return status;
    if (!running[k].next) {
      return absl::InvalidArgumentError(
          absl::StrCat(running[k].member.name, ": no frame; look at --frames"));
    }
    running[k].began_ns = running[k].next->capture_time_ns;
  }
  double now_s = 0, told_s = 0;
  while (running[0].next || running[1].next) {
    const int who = !running[1].next                                          ? 0
                    : !running[0].next || running[1].Due() < running[0].Due() ? 1
                                                                              : 0;
    now_s = running[who].Due();
    if (absl::Status status = Step(running[who], orders, who, now_s); !status.ok()) return status;
    if (now_s >= told_s) {
      std::cerr << absl::StrFormat("%.0f s: %d and %d keyframes, %s\n", now_s,
                                   running[0].keyframes.size(), running[1].keyframes.size(),
                                   orders[0].joiner.join() ? "merged" : "apart");
      told_s = now_s + 5.0;
    }
  }
  for (Order& order : orders) WorkOff(order, now_s, true);
  const std::vector<PosePair> pairs[2] = {PairsOf(running[0]), PairsOf(running[1])};
  const auto common_s = CommonView(running[0], running[1]);
  Json report = {{"kind", "pair"}};
  report["common_view_s"] = common_s ? Json(*common_s) : Json();
  for (int k = 0; k < 2; ++k) {
    Json one = {{"name", running[k].member.name},
                {"keyframes_told", running[k].told},
                {"keyframes", running[k].maker.All().size()}};
    one.update(running[k].recorder->Report(running[k].member.source->bad_frames()));
    if (!running[k].member.truth.empty()) AddScores(pairs[k], false, one);
    if (absl::Status closed = running[k].recorder->Close(); !closed.ok()) return closed;
    report["wearers"].push_back(std::move(one));
    report["orders"].push_back(OrderJson(orders[k], pairs[k], pairs[1 - k], common_s));
  }
  return report;
}

}  // namespace saccade
