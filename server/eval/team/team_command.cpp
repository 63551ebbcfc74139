#include "server/eval/team/team_command.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "server/eval/output_file.hpp"
#include "server/eval/team/mrclam_run.hpp"
#include "server/eval/team/pair_command.hpp"
#include "server/eval/team/team_settings.hpp"
#include "server/eval/team/wand_run.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;
using Path = std::filesystem::path;

constexpr double kDegrees = 180.0 / M_PI;

std::string StampOf(Timestamp time_ns) {
  return absl::StrFormat("%d.%09d", time_ns / 1'000'000'000, time_ns % 1'000'000'000);
}

absl::Status WriteTrajectory(const Path& file, const Trajectory& trajectory) {
  std::string text;
  for (const StampedPose& each : trajectory) {
    text += TumLine(StampOf(each.time_ns), each.world_from_camera);
  }
  return WriteFileAtomically(file, text);
}

Rigid3 Planar(const Eigen::Vector3d& pose) {
  return {ExpQuaternion({0, 0, pose.z()}), {pose.x(), pose.y(), 0}};
}

Json ScoreJson(const MrclamScore& score) {
  const double n = static_cast<double>(score.compared);
  if (score.compared == 0) return {{"poses", score.poses}, {"compared", 0}};
  return {{"poses", score.poses},
          {"compared", score.compared},
          {"rms_m", std::sqrt(score.sum_m2 / n)},
          {"rms_deg", std::sqrt(score.sum_rad2 / n) * kDegrees},
          {"worst_m", score.worst_m},
          {"nees_xy", score.sum_nees / n}};
}

absl::StatusOr<Json> RunRobots(const TeamArguments& arguments, const TeamSettings& settings) {
  const absl::StatusOr<MrclamData> data = LoadMrclam(arguments.datasets.front());
  if (!data.ok()) return data.status();
  const absl::StatusOr<MrclamResult> result = RunMrclam(*data, settings);
  if (!result.ok()) return result.status();
  Json report = {{"kind", "robots"},
                 {"mode", settings.joint ? "joint" : "separate"},
                 {"landmarks_seen_by", settings.landmarks},
                 {"start", settings.start_by_truth ? "truth" : "sights"}};
  Json robots = Json::array();
  MrclamScore all;
  for (std::size_t r = 0; r < data->robots.size(); ++r) {
    Trajectory estimate, truth;
    for (const MrclamPose& each : result->robots[r]) {
      estimate.push_back({each.time_ns, Planar(each.belief.state.head<3>())});
      const auto there = TruthAt(data->robots[r].truth, each.time_ns);
      if (there) truth.push_back({each.time_ns, Planar(*there)});
    }
    const std::string name = absl::StrCat("robot", r + 1);
    if (absl::Status done = WriteTrajectory(arguments.out / (name + ".tum"), estimate);
        !done.ok()) {
      return done;
    }
    if (absl::Status done = WriteTrajectory(arguments.out / (name + "_truth.tum"), truth);
        !done.ok()) {
      return done;
    }
    const MrclamScore score = ScoreMrclam(result->robots[r], data->robots[r].truth);
    Json one = {{"name", name}};
    one.update(ScoreJson(score));
    if (!estimate.empty()) {
      const PlanarVector& state = result->robots[r].back().belief.state;
      one["speed_scale"] = state[kSpeedScale];
      one["turn_scale"] = state[kTurnScale];
      one["turn_bias_rad_s"] = state[kTurnBias];
      one["range_bias_m"] = state[kRangeBias];
      one["bearing_bias_deg"] = state[kBearingBias] * kDegrees;
      one["sight_delay_s"] = state[kSightDelay_s];
    }
    robots.push_back(std::move(one));
    all.poses += score.poses;
    all.compared += score.compared;
    all.sum_m2 += score.sum_m2;
    all.sum_rad2 += score.sum_rad2;
    all.sum_nees += score.sum_nees;
    all.worst_m = std::max(all.worst_m, score.worst_m);
  }
  report.update(ScoreJson(all));
  report["robots"] = std::move(robots);
  const PlanarCounts& counts = result->counts;
  report["sightings"] = {{"landmarks", counts.landmarks}, {"mutual", counts.mutual},
                         {"waiting", counts.waiting},     {"doubted", counts.doubted},
                         {"refused", counts.refused},     {"unknown_codes", data->unknown_codes},
                         {"lost", result->lost}};
  report["late_events"] = result->late;
  return report;
}

absl::StatusOr<Json> RunCameras(const TeamArguments& arguments, const TeamSettings& settings) {
  const absl::StatusOr<WandData> data = LoadWand(arguments.datasets.front(), settings.tag_side_m);
  if (!data.ok()) return data.status();
  const absl::StatusOr<WandResult> result = RunWand(*data);
  if (!result.ok()) return result.status();
  for (const auto& [name, trajectory] :
       {std::pair{"wand.tum", &result->wand}, {"wand_online.tum", &result->online}}) {
    if (absl::Status done = WriteTrajectory(arguments.out / name, *trajectory); !done.ok()) {
      return done;
    }
  }
  const std::optional<WandScore> score = ScoreWand(*data, *result);
  Json report = {{"kind", "cameras"},
                 {"world", absl::StrCat("cam", result->reference)},
                 {"instants", data->times_ns.size()},
                 {"wand_poses", result->wand.size()},
                 {"corner_order", result->order},
                 {"rms_px", result->fit.rms_px}};
  if (score) {
    report["wand_rms_m"] = score->wand_rms_m;
    report["wand_rms_deg"] = score->wand_rms_deg;
    report["wand_online_rms_m"] = score->online_rms_m;
  }
  Json cameras = Json::array();
  for (const auto& [camera, pose] : result->world_from_camera) {
    const Eigen::Vector3d& t = pose.translation;
    const Eigen::Vector4d q = pose.rotation.coeffs();
    Json one = {{"name", absl::StrCat("cam", camera)},
                {"world_from_camera", {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}},
                {"placed_at_instant", result->first_placed.at(camera)}};
    if (const auto known = result->fit.camera_covariance.find(camera);
        known != result->fit.camera_covariance.end()) {
      one["sigma_m"] = std::sqrt(known->second.topLeftCorner<3, 3>().trace());
      one["sigma_deg"] = std::sqrt(known->second.bottomRightCorner<3, 3>().trace()) * kDegrees;
    }
    if (score && score->cameras.contains(camera)) {
      one["error_m"] = score->cameras.at(camera).first;
      one["error_deg"] = score->cameras.at(camera).second;
    }
    cameras.push_back(std::move(one));
  }
  report["cameras"] = std::move(cameras);
  Json unplaced = Json::array();
  for (std::size_t c = 0; c < data->lenses.size(); ++c) {
    if (!result->world_from_camera.contains(static_cast<int>(c))) {
      unplaced.push_back(absl::StrCat("cam", c));
    }
  }
  report["not_placed"] = std::move(unplaced);
  return report;
}

std::string TeamTable(const Json& report) {
  const bool robots = report["kind"] == "robots";
  std::string text;
  for (const Json& one : report[robots ? "robots" : "cameras"]) {
    const std::string name = one["name"];
    absl::StrAppend(
        &text, robots
                   ? absl::StrFormat("%-8s rms %.3f m %6.2f deg, worst %.2f m\n", name,
                                     one.value("rms_m", NAN), one.value("rms_deg", NAN),
                                     one.value("worst_m", NAN))
                   : absl::StrFormat("%-8s off %.1f mm %6.3f deg\n", name,
                                     1e3 * one.value("error_m", NAN), one.value("error_deg", NAN)));
  }
  if (robots) {
    return absl::StrCat(
        text, absl::StrFormat("all      rms %.3f m %6.2f deg\n", report.value("rms_m", NAN),
                              report.value("rms_deg", NAN)));
  }
  return absl::StrCat(
      text,
      absl::StrFormat("wand     rms %.2f mm %6.3f deg; as known at its instant %.2f mm\n",
                      1e3 * report.value("wand_rms_m", NAN), report.value("wand_rms_deg", NAN),
                      1e3 * report.value("wand_online_rms_m", NAN)));
}

}  // namespace

absl::Status TeamCommand(const TeamArguments& arguments) {
  if (arguments.foreign_pairs > 0) return ForeignCommand(arguments);
  if (arguments.datasets.size() == 2) return PairCommand(arguments);
  if (arguments.datasets.size() != 1) {
    return absl::InvalidArgumentError(
        "--dataset: one, or two recordings whose maps are to meet; or --foreign");
  }
  const Path& dataset = arguments.datasets.front();
  const absl::StatusOr<TeamSettings> settings = ParseTeamSettings(arguments.set);
  if (!settings.ok()) return settings.status();
  const bool robots = MayExist(dataset / "Barcodes.dat");
  if (!robots && !MayExist(dataset / "detections.csv")) {
    return absl::NotFoundError(
        absl::StrCat(dataset.string(),
                     ": is neither robots in a plane (Barcodes.dat, Robot1_Odometry.dat, ...) nor "
                     "static cameras "
                     "and a wand (cameras.yaml, detections.csv, wand_tags.csv)"));
  }
  if (absl::Status made = CreateFolder(arguments.out); !made.ok()) return made;
  const absl::StatusOr<Json> report =
      robots ? RunRobots(arguments, *settings) : RunCameras(arguments, *settings);
  if (!report.ok()) return report.status();
  if (absl::Status done =
          WriteFileAtomically(arguments.out / "report.json", report->dump(2) + "\n");
      !done.ok()) {
    return done;
  }
  std::cout << (arguments.json ? report->dump(2) + "\n" : TeamTable(*report));
  return absl::OkStatus();
}

}  // namespace saccade
