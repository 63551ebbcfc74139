#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>
#include <iostream>

#include "server/eval/commands.hpp"
#include "server/eval/forms_scenario.hpp"
#include "server/eval/gaze_scenario.hpp"
#include "server/eval/landmarks/landmarks_scenario.hpp"
#include "server/eval/loop_scenario.hpp"
#include "server/eval/pixel_run.hpp"
#include "server/eval/points_scenario.hpp"
#include "server/eval/reloc_scenario.hpp"
#include "server/eval/soak_scenario.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

struct PixelScenario {
  absl::string_view name;
  SimMotion motion;
};
/// Scenarios through pixels; `points`, `forms` and `soak` are at feature level.
constexpr PixelScenario kPixelScenarios[] = {
    {"desk", SimMotion::kDesk}, {"sway", SimMotion::kSway},   {"walk", SimMotion::kWalk},
    {"turn", SimMotion::kTurn}, {"twist", SimMotion::kTwist}, {"still", SimMotion::kStill},
};

double Share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

Json PixelReport(const SimArguments& arguments, const PixelRunTotals& totals, const Sample& ates) {
  Json report;
  report["scenario"] = arguments.scenario;
  report["seed"] = arguments.seed;
  report["duration_s"] = arguments.duration_s;
  report["runs"] = arguments.runs;
  report["frames"] = totals.frames;
  report["lost_frames"] = totals.lost_frames;
  report["tracked_frames"] = totals.tracked_frames;
  report["lost_after_start_frames"] = totals.lost_after_start_frames;
  report["false_tracked_frames"] = totals.false_tracked_frames;
  report["scale_windows"] = totals.scale_windows ? Json{{"min", totals.scale_windows->min},
                                                        {"max", totals.scale_windows->max}}
                                                 : Json(nullptr);
  report["initialising_frames"] = totals.initialising_frames;
  report["coasting_frames"] = totals.coasting_frames;
  report["anchors"] = totals.anchors;
  report["refused_clicks"] = totals.refused_clicks;
  report["anchor_views"] = totals.views;
  report["anchor_tracking_fraction"] = Share(totals.tracking_views, totals.views);
  report["anchor_drawn_fraction"] = Share(totals.drawn_views, totals.views);
  // A run without three tracked frames has no ATE and is missing here: `runs` tells.
  report["ate_se3_runs"] = ates.size();
  report["ate_se3_runs_m"] = {
      {"median", ates.size() == 0 ? Json(nullptr) : Json(ates.Percentile(50))},
      {"max", ates.size() == 0 ? Json(nullptr) : Json(ates.Max())}};
  report["registration_px_rms"] =
      totals.views == 0 ? Json(nullptr) : Json(std::sqrt(totals.squared_px.Mean()));
  report["registration_mm_per_m"] = totals.squared_mm_per_m.size() == 0
                                        ? Json(nullptr)
                                        : Json(std::sqrt(totals.squared_mm_per_m.Mean()));
  report["frame_ms"] = {{"p50", totals.frame_ms.Percentile(50)},
                        {"p95", totals.frame_ms.Percentile(95)},
                        {"p99", totals.frame_ms.Percentile(99)},
                        {"max", totals.frame_ms.Max()}};
  report["claims"] = totals.claims.Report();
  return report;
}

absl::StatusOr<Json> RunPixels(const SimArguments& arguments, SimMotion motion) {
  PixelRunTotals totals;
  Sample ates;
  Json runs = Json::array();
  for (int run = 0; run < arguments.runs; ++run) {
    SimOptions options;
    options.seed = arguments.seed + static_cast<std::uint64_t>(run);
    options.motion = motion;
    options.duration_s = arguments.duration_s;
    PixelRunTotals own;
    absl::StatusOr<PixelRun> pixels =
        PixelRun::Create(options, arguments.tracker, ClickPlan(), arguments.targetless,
                         arguments.out / absl::StrFormat("run-%03d", run));
    if (!pixels.ok()) return pixels.status();
    const absl::StatusOr<std::optional<double>> ate = pixels->Run(own);
    if (!ate.ok()) return ate.status();
    if (*ate) ates.Add(**ate);
    std::cerr << absl::StrFormat(
        "run %d of %d: %d frames, %d lost, %d anchors, ATE %s, registration %.2f px\n", run + 1,
        arguments.runs, own.frames, own.lost_frames, own.anchors,
        *ate ? absl::StrFormat("%.2f cm", 100 * **ate) : "unknown",
        std::sqrt(own.squared_px.Mean()));
    Sample one;
    if (*ate) one.Add(**ate);
    SimArguments each = arguments;
    each.runs = 1;
    each.seed = options.seed;
    runs.push_back(PixelReport(each, own, one));
    totals.Add(own);
  }
  Json report = PixelReport(arguments, totals, ates);
  report["per_run"] = std::move(runs);
  return report;
}

/// Claims have a level of their own: a line each.
void AddClaims(const Json& claims, std::string& text) {
  const auto add = [&text](const std::string& name, const Json& each) {
    if (each.is_object()) {
      for (const auto& [kind, figures] : each.items()) {
        absl::StrAppendFormat(&text, "claims: %-20s %s\n", absl::StrCat(name, ", ", kind),
                              figures.dump());
      }
    } else {
      absl::StrAppendFormat(&text, "claims: %-20s %s\n", name, each.dump());
    }
  };
  for (const auto& [key, value] : claims.items()) {
    if (key != "by_method" && key != "by_age") {
      add(key, value);
      continue;
    }
    for (const auto& [name, each] : value.items()) add(name, each);
  }
}

std::string SimTable(const Json& report) {
  std::string text;
  for (const auto& [key, value] : report.items()) {
    if (key == "claims") {
      AddClaims(value, text);
      continue;
    }
    if (key != "per_run") absl::StrAppendFormat(&text, "%-28s %s\n", key, value.dump());
  }
  return text;
}

double DefaultDuration_s(absl::string_view scenario) {
  if (IsLandmarksScenario(scenario)) return LandmarksDuration_s(scenario);
  if (scenario == "soak" || scenario == "passerby") return 610;
  return scenario == "reloc" ? 30 : 60;
}

}  // namespace

std::string ScenarioNames() {
  std::string names = "points, forms, soak, passerby, reloc, loop";
  for (const PixelScenario& each : kPixelScenarios) absl::StrAppend(&names, ", ", each.name);
  absl::StrAppend(&names, ", ", LandmarksScenarioNames(), ", ", GazeScenarioNames());
  return names;
}

absl::Status SimCommand(const SimArguments& asked) {
  SimArguments arguments = asked;
  if (arguments.duration_s <= 0 && !IsGazeScenario(arguments.scenario)) {
    arguments.duration_s = DefaultDuration_s(arguments.scenario);
  }
  absl::StatusOr<Json> report = absl::InvalidArgumentError(absl::StrCat(
      "--scenario '", arguments.scenario, "' is unknown; use one of ", ScenarioNames()));
  if (arguments.scenario == "points") report = RunPointsScenario(arguments);
  if (arguments.scenario == "forms") report = RunFormsScenario(arguments);
  if (arguments.scenario == "soak" || arguments.scenario == "passerby") {
    report = RunSoakScenario(arguments);
  }
  if (arguments.scenario == "loop") report = RunLoopScenario(arguments);
  if (arguments.scenario == "reloc") report = RunRelocScenario(arguments);
  if (IsLandmarksScenario(arguments.scenario)) report = RunLandmarksScenario(arguments);
  if (IsGazeScenario(arguments.scenario)) report = RunGazeScenario(arguments);
  for (const PixelScenario& each : kPixelScenarios) {
    if (each.name == arguments.scenario) report = RunPixels(arguments, each.motion);
  }
  if (!report.ok()) return report.status();
  const absl::Status written =
      WriteFileAtomically(arguments.out / "report.json", report->dump(2) + "\n");
  if (!written.ok()) return written;
  std::cout << (arguments.json ? report->dump(2) + "\n" : SimTable(*report));
  return absl::OkStatus();
}

}  // namespace saccade
