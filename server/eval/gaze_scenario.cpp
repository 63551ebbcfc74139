#include "server/eval/gaze_scenario.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <random>

#include "server/eval/gaze_result.hpp"
#include "server/eval/gaze_run.hpp"
#include "server/eval/outline.hpp"
#include "shared/geometry/angle.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kStart_s = 2.2;  // on the chessboard, and the first features
constexpr double kArrived_deg = 1.0;
constexpr double kArrived_s = 0.2;
constexpr double kFarWay_deg = 120.0;  // of a joint: 4 s at the default rate

/// Clicks again, a frame later, until the click is taken or `until_s` has come.
absl::StatusOr<GazeRun::Clicked> ClickUntil(GazeRun& run, double until_s,
                                            const std::optional<Eigen::Vector3d>& object,
                                            GazeResult& result) {
  absl::StatusOr<GazeRun::Clicked> clicked = run.Click(object);
  while (!clicked.ok() && run.time_s() < until_s) {
    ++result.refused_clicks;
    if (const absl::Status ran = run.RunUntil(run.time_s() + 0.1); !ran.ok()) return ran;
    clicked = run.Click(object);
  }
  return clicked;
}

/// A saccade, watched by truth for `for_s` seconds; the run goes on meanwhile.
absl::Status Look(GazeRun& run, const GazeRun::Clicked& target, bool fast, double for_s,
                  GazeResult& result) {
  const Eigen::Vector3d& true_point = target.true_point;
  ++result.asked;
  const double begin = run.time_s();
  // Past the target, in the plane of the approach: from 5 deg before it until 1.5 s later.
  std::optional<Eigen::Vector3d> normal;
  double near_since = 0;
  const Eigen::Vector3d rest = ToVector(run.mount().TrueAngles(run.now_ns()));
  double arrival = for_s, within_since = -1, moved = -1;
  bool arrived = false;
  if (const absl::Status told = run.loop().Fixate(GazeAnnotation{target.id}, fast); !told.ok()) {
    std::cerr << "  refused: " << told.message() << "\n";
    result.arrival_s.Add(for_s);
    return run.RunUntil(begin + for_s);
  }
  const absl::Status ran = run.RunUntil(begin + for_s, [&] {
    const double now = run.time_s(), error = run.TrueError_deg(true_point);
    const Eigen::Vector3d joints = ToVector(run.mount().TrueAngles(run.now_ns()));
    if (moved < 0 && (joints - rest).norm() > 0.05 * kDegree) moved = now - begin;
    if (error >= kArrived_deg) within_since = -1;
    if (error < kArrived_deg && within_since < 0) within_since = now;
    if (!arrived && within_since >= 0 && now - within_since >= kArrived_s - 1e-9) {
      arrived = true;
      arrival = within_since - begin;
    }
    const Rigid3 seen = run.TrueCamera();
    const Eigen::Vector3d line = (true_point - seen.translation).normalized();
    const Eigen::Vector3d axis = seen.rotation * Eigen::Vector3d::UnitZ();
    if (!normal && error < 5.0) {
      normal = axis.cross(line).normalized();
      near_since = now;
    }
    if (normal && now - near_since < 1.5) {
      result.overshoot_deg =
          std::max(result.overshoot_deg, std::asin(line.cross(axis).dot(*normal)) / kDegree);
    }
  });
  result.arrived += arrived ? 1 : 0;
  result.arrival_s.Add(arrival);
  run.WriteLook(target, begin, arrived ? std::optional(arrival) : std::nullopt);
  if (moved >= 0) result.command_to_motion_ms.Add(1e3 * moved);
  return ran;
}

/// A point 2 m away in the direction that joint angles give, by where the wearer is believed to be.
GazePoint Towards(GazeRun& run, double pan_deg, double elevation_deg) {
  const Rigid3 base = run.loop()
                          .controller()
                          .WorldFromMount(run.now_ns())
                          .value_or(run.source().wearer().WorldFromShoulder(run.time_s()));
  const Rigid3 camera =
      base * run.mount().model().MountFromCamera({pan_deg * kDegree, elevation_deg * kDegree, 0});
  return {camera * Eigen::Vector3d(0, 0, 2)};
}

absl::Status RunFixate(GazeRun& run, const SimArguments& arguments, GazeResult& result) {
  if (absl::Status ran = run.RunUntil(kStart_s + 0.5); !ran.ok()) return ran;
  // The named object nearest to the picture's centre, about a metre away.
  const SimTruth truth = run.source().Truth(run.newest_frame());
  const Eigen::Vector2d middle(320, 240);
  std::optional<Eigen::Vector3d> object;
  double nearest = 250;
  for (const SimObject& each : truth.objects) {
    if (!each.visible || !each.pixel) continue;
    const double away = (*each.pixel - middle).norm();
    if (away < nearest) {
      nearest = away;
      object = each.point_in_world;
    }
  }
  const absl::StatusOr<GazeRun::Clicked> clicked =
      ClickUntil(run, run.time_s() + 2.0, object, result);
  if (!clicked.ok()) return clicked.status();
  if (absl::Status looked = Look(run, *clicked, false, 2.0, result); !looked.ok()) {
    return looked;
  }
  return run.RunUntil(arguments.duration_s, [&] {
    result.squared_error_deg.Add(std::pow(run.TrueError_deg(clicked->true_point), 2));
    result.squared_roll_deg.Add(std::pow(run.TrueRoll_deg(), 2));
  });
}

absl::Status RunSaccade(GazeRun& run, std::uint64_t seed, bool fast, GazeResult& result) {
  if (absl::Status ran = run.RunUntil(kStart_s + 0.3); !ran.ok()) return ran;
  // The expert looks round first: what he later asks for is in the map, and out of view.
  const double side = seed % 2 == 0 ? 1.0 : -1.0;
  for (const double pan : {30.0, 60.0, 90.0}) {
    if (absl::Status told = run.loop().Fixate(Towards(run, side * pan, -5), false); !told.ok()) {
      return told;
    }
    if (absl::Status ran = run.RunUntil(run.time_s() + 1.6); !ran.ok()) return ran;
  }
  const absl::StatusOr<GazeRun::Clicked> clicked =
      ClickUntil(run, run.time_s() + 2.0, std::nullopt, result);
  if (!clicked.ok()) return clicked.status();
  if (absl::Status ran = run.RunUntil(run.time_s() + 0.3); !ran.ok()) return ran;
  // Back until the pan joint has exactly 90 deg to go.
  const Rigid3 base = run.loop().controller().WorldFromMount(run.now_ns()).value_or(Rigid3());
  const MountAngles there =
      run.mount().model().Fixate(base.Inverse() * clicked->true_point, std::nullopt, {}).angles;
  const GazePoint start =
      Towards(run, there.pan_rad / kDegree - side * 90.0, there.elevation_rad / kDegree);
  if (absl::Status told = run.loop().Fixate(start, false); !told.ok()) return told;
  if (absl::Status ran = run.RunUntil(run.time_s() + 4.2); !ran.ok()) return ran;
  return Look(run, *clicked, fast, 5.0, result);
}

absl::Status RunHorizon(GazeRun& run, const SimArguments& arguments, GazeResult& result) {
  if (absl::Status ran = run.RunUntil(kStart_s); !ran.ok()) return ran;
  run.loop().controller().KeepHorizon();
  if (absl::Status ran = run.RunUntil(kStart_s + 2.0); !ran.ok()) return ran;
  return run.RunUntil(arguments.duration_s,
                      [&] { result.squared_roll_deg.Add(std::pow(run.TrueRoll_deg(), 2)); });
}

/// Twelve named objects, round the wearer, that can be seen from where he starts.
std::vector<Eigen::Vector3d> TourObjects(GazeRun& run) {
  const Rigid3 base = run.source().wearer().WorldFromShoulder(0);
  std::vector<std::pair<double, Eigen::Vector3d>> seen;  // by azimuth
  for (const NamedPoint& object : run.source().objects()) {
    const Eigen::Vector3d line = object.point_in_world - base.translation;
    const std::optional<double> surface =
        run.source().SurfaceAlong(base.translation, line.normalized());
    if (surface && *surface < line.norm() - 0.02) continue;
    if (IsOnOutline(run.source(), base.translation, object.point_in_world)) continue;
    const Eigen::Vector3d in_base = base.Inverse() * object.point_in_world;
    if (std::abs(std::atan2(in_base.y(), in_base.head<1>().norm() + std::abs(in_base.z()))) >
        50 * kDegree) {
      continue;
    }
    seen.emplace_back(std::atan2(in_base.x(), in_base.z()), object.point_in_world);
  }
  std::sort(seen.begin(), seen.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Eigen::Vector3d> chosen;
  const std::size_t count = std::min<std::size_t>(12, seen.size());
  for (std::size_t k = 0; k < count; ++k) chosen.push_back(seen[k * seen.size() / count].second);
  return chosen;
}

void MeasureDrift(GazeRun& run, double duration_s, GazeResult& result) {
  const std::vector<PosePair> pairs = Associate(run.recorder().trajectory(), run.truth());
  if (pairs.size() < 3) return;
  std::vector<Eigen::Vector3d> estimate, truth;
  for (const PosePair& pair : pairs) {
    estimate.push_back(pair.estimate.translation);
    truth.push_back(pair.truth.translation);
  }
  const Similarity aligned = AlignPoints(estimate, truth, TrajectoryAlignment::kSe3);
  Sample first, last;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const double squared = (aligned * estimate[k] - truth[k]).squaredNorm();
    const double at = Seconds(pairs[k].time_ns);
    if (at < 60) first.Add(squared);
    if (at >= duration_s - 60) last.Add(squared);
  }
  if (first.size() == 0 || last.size() == 0) return;
  result.drift_first_m = std::sqrt(first.Mean());
  result.drift_last_m = std::sqrt(last.Mean());
}

absl::Status RunTour(GazeRun& run, const SimArguments& arguments, std::uint64_t seed,
                     GazeResult& result) {
  if (absl::Status ran = run.RunUntil(kStart_s + 0.3); !ran.ok()) return ran;
  std::vector<GazeRun::Clicked> clicked;
  for (const Eigen::Vector3d& object : TourObjects(run)) {
    // The expert looks at each by hand, once it is in view clicks it.
    if (absl::Status told = run.loop().Fixate(GazePoint{object}, false); !told.ok()) return told;
    const double begin = run.time_s();
    absl::Status ran = absl::OkStatus();
    while (ran.ok() && run.time_s() < begin + 7.0 && run.TrueError_deg(object) > 2.0) {
      ran = run.RunUntil(run.time_s() + 0.1);
    }
    if (ran.ok()) ran = run.RunUntil(run.time_s() + 1.0);  // features are born
    if (!ran.ok()) return ran;
    const auto one = ClickUntil(run, run.time_s() + 1.5, object, result);
    if (one.ok()) clicked.push_back(*one);
  }
  if (clicked.size() < 2) return absl::FailedPreconditionError("tour: no object could be clicked");
  std::mt19937_64 rng(seed);
  std::size_t last = clicked.size();
  while (run.time_s() + 8.0 <= arguments.duration_s) {
    std::size_t next = last;
    while (next == last) {
      next = std::uniform_int_distribution<std::size_t>(0, clicked.size() - 1)(rng);
    }
    last = next;
    // At 30 deg/s a whole turn takes 12 s: what is far away, or only to be had the other way round
    // because the pan joint ends, the expert asks for fast.
    const bool fast = run.Way_deg(clicked[next].id).value_or(0) > kFarWay_deg;
    const absl::Status looked = Look(run, clicked[next], fast, 8.0, result);
    if (!looked.ok()) return looked;
  }
  if (absl::Status ran = run.RunUntil(arguments.duration_s); !ran.ok()) return ran;
  MeasureDrift(run, arguments.duration_s, result);
  return absl::OkStatus();
}

absl::Status RunSpin(GazeRun& run, const SimArguments& arguments, GazeResult& result) {
  if (absl::Status ran = run.RunUntil(kStart_s); !ran.ok()) return ran;
  // To and fro between the pan joint's ends, 20 deg a step: the head never rests for long.
  double pan = 0, way = 1;
  while (run.time_s() < arguments.duration_s) {
    if (std::abs(pan + 20 * way) > 180) way = -way;
    pan += 20 * way;
    const double tilt = 8 * std::sin(pan * kDegree);
    if (absl::Status told = run.loop().Fixate(Towards(run, pan, tilt), false); !told.ok()) {
      return told;
    }
    const absl::Status ran = run.RunUntil(std::min(run.time_s() + 0.8, arguments.duration_s));
    if (!ran.ok()) return ran;
  }
  const Rigid3 truth = run.source().WorldFromCamera(run.newest_frame());
  result.orientation_end_deg = RotationAngle(run.newest()->world_from_camera, truth) / kDegree;
  return absl::OkStatus();
}

struct Scenario {
  const char* name;
  SimMotion motion;
  double duration_s;  // unless --duration says otherwise; 0: as long as it takes
};
constexpr Scenario kScenarios[] = {
    {"fixate", SimMotion::kRock, 180},      {"saccade", SimMotion::kStand, 0},
    {"saccade_fast", SimMotion::kStand, 0}, {"horizon", SimMotion::kRoll, 60},
    {"tour", SimMotion::kStroll, 600},      {"spin", SimMotion::kStill, 120},
};

const Scenario* Find(const std::string& name) {
  for (const Scenario& each : kScenarios) {
    if (each.name == name) return &each;
  }
  return nullptr;
}

absl::StatusOr<double> RunOnce(const SimArguments& arguments, const Scenario& scenario,
                               std::uint64_t seed, const std::filesystem::path& folder,
                               bool encoders, GazeResult& result) {
  GazeRunOptions options;
  options.sim.seed = options.mount.seed = seed;
  options.sim.motion = scenario.motion;
  options.tracker = arguments.tracker;
  options.folder = folder;
  options.encoders = encoders;
  if (!arguments.tracker.config.empty()) {
    absl::Status read = options.gaze.LoadToml(arguments.tracker.config);
    if (read.ok()) read = options.mount.mount.LoadToml(arguments.tracker.config);
    if (!read.ok()) return read;
  }
  absl::StatusOr<std::unique_ptr<GazeRun>> made = GazeRun::Create(options);
  if (!made.ok()) return made.status();
  GazeRun& run = **made;
  const std::string name = scenario.name;
  absl::Status done = name == "fixate"    ? RunFixate(run, arguments, result)
                      : name == "horizon" ? RunHorizon(run, arguments, result)
                      : name == "tour"    ? RunTour(run, arguments, seed, result)
                      : name == "spin"    ? RunSpin(run, arguments, result)
                                          : RunSaccade(run, seed, name == "saccade_fast", result);
  if (!done.ok()) {
    // A loop that could not even start (nothing mapped) is a result, not an error of the program.
    std::cerr << "  " << done << "\n";
    ++result.asked;
  }
  result.frames = run.recorder().frames();
  result.lost_frames = run.recorder().CountOf(FrameVerdict::kLost);
  result.initialising_frames = run.recorder().CountOf(FrameVerdict::kInitialising);
  result.measured = run.measured();
  result.peak_rate_deg_s = run.peak_rate_deg_s();
  const GazeRun::DepthClaims claims = run.CheckDepths();
  result.false_depth = claims.false_depth;
  result.features = claims.total;
  result.claims.Add(run.claims(), 1.0);
  for (const absl::Status& closed : {run.claims().Write(folder / "claims.csv", 1.0), run.Close()}) {
    if (!closed.ok()) return closed;
  }
  return run.mean_searched_px2();
}

}  // namespace

bool IsGazeScenario(const std::string& name) { return Find(name) != nullptr; }

std::string GazeScenarioNames() {
  std::string names;
  for (const Scenario& each : kScenarios) {
    absl::StrAppend(&names, names.empty() ? "" : ", ", each.name);
  }
  return names;
}

absl::StatusOr<nlohmann::ordered_json> RunGazeScenario(const SimArguments& asked) {
  const Scenario& scenario = *Find(asked.scenario);
  SimArguments arguments = asked;
  if (arguments.duration_s <= 0) arguments.duration_s = scenario.duration_s;
  GazeResult total;
  Json runs = Json::array();
  for (int k = 0; k < arguments.runs; ++k) {
    const std::uint64_t seed = arguments.seed + static_cast<std::uint64_t>(k);
    GazeResult result;
    const std::filesystem::path folder = arguments.out / absl::StrFormat("run-%03d", k);
    const absl::StatusOr<double> with =
        RunOnce(arguments, scenario, seed, folder, /*encoders=*/true, result);
    if (!with.ok()) return with.status();
    // T28 compares with the same run without encoders in the filter.
    if (asked.scenario == "fixate" && *with > 0) {
      GazeResult other;
      const absl::StatusOr<double> without =
          RunOnce(arguments, scenario, seed, folder / "without-encoders", false, other);
      if (!without.ok()) return without.status();
      if (*without > 0) result.search_area_ratio = *with / *without;
    }
    std::cerr << absl::StrFormat(
        "run %d of %d: %d frames, %d lost, error %s deg RMS, roll %s deg RMS, %d of %d arrived%s\n",
        k + 1, arguments.runs, result.frames, result.lost_frames,
        RootMean(result.squared_error_deg).dump(), RootMean(result.squared_roll_deg).dump(),
        result.arrived, result.asked,
        result.arrival_s.size() > 0 ? absl::StrFormat(" in %.2f s", result.arrival_s.Percentile(50))
                                    : "");
    SimArguments each = arguments;
    each.runs = 1;
    each.seed = seed;
    runs.push_back(GazeReportOf(each, result));
    total.Add(result);
  }
  Json report = GazeReportOf(arguments, total);
  report["per_run"] = std::move(runs);
  return report;
}

}  // namespace saccade
