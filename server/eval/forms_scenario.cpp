#include "server/eval/forms_scenario.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <functional>
#include <iostream>

#include "server/eval/output_file.hpp"
#include "server/eval/points_tracker.hpp"
#include "server/eval/registration.hpp"
#include "server/eval/statistics.hpp"
#include "server/eval/xyz_filter.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;
using StepFunction = std::function<absl::StatusOr<PointsStep>(std::size_t)>;

/// One way to write features, over all runs.
struct Form {
  const char* name;
  Sample nees;        // of the position, mean of each run; 3 is ideal
  Sample rmse_m;      // of the position, of each run
  int lost_runs = 0;  // with a frame more than 10 cm or 5 deg off
  int broken_runs = 0;
};

void RunForm(std::size_t frames, const StepFunction& step, Form& form) {
  Sample nees, squares;
  bool lost = false;
  for (std::size_t i = 0; i < frames; ++i) {
    const absl::StatusOr<PointsStep> result = step(i);
    if (!result.ok()) {
      std::cerr << absl::StrCat(form.name, ", frame ", i, ": ", result.status().message(),
                                "; this run does not count\n");
      ++form.broken_runs;
      return;
    }
    nees.Add(result->position_nees);
    squares.Add(result->position_error_m * result->position_error_m);
    lost |= result->position_error_m > kLostPosition_m ||
            result->rotation_error_rad > kLostRotation_rad;
  }
  form.nees.Add(nees.Mean());
  form.rmse_m.Add(std::sqrt(squares.Mean()));
  form.lost_runs += lost ? 1 : 0;
}

Json FormReport(const Form& form, const Form& reference) {
  Json report;
  report["position_nees_mean"] = form.nees.Mean();
  report["position_nees_median_run"] = form.nees.Percentile(50);
  report["position_nees_worst_run"] = form.nees.Max();
  report["nees_ratio_to_xyz"] = form.nees.Mean() / reference.nees.Mean();
  report["nees_ratio_to_xyz_median_run"] = form.nees.Percentile(50) / reference.nees.Percentile(50);
  report["rmse_median_run_m"] = form.rmse_m.Percentile(50);
  report["rmse_worst_run_m"] = form.rmse_m.Max();
  report["lost_runs"] = form.lost_runs;
  report["broken_runs"] = form.broken_runs;
  return report;
}

}  // namespace

absl::StatusOr<Json> RunFormsScenario(const SimArguments& arguments) {
  Form xyz{"xyz", {}, {}}, sid{"sid", {}, {}}, esid{"esid", {}, {}};
  if (const absl::Status status = CreateFolder(arguments.out); !status.ok()) return status;
  PointsOptions options;
  options.duration_s = arguments.duration_s;
  for (int run = 0; run < arguments.runs; ++run) {
    options.seed = arguments.seed + static_cast<std::uint64_t>(run);
    const PointsWorld world = MakePointsWorld(options);
    const std::size_t frames = world.frames.size();
    XyzFilter reference(world, options);
    RunForm(
        frames, [&](std::size_t i) { return reference.Step(i); }, xyz);
    for (Form* form : {&sid, &esid}) {
      PointsSetup setup = MakeConsistencySetup(options);
      setup.tracker.range_only = form == &esid;
      auto tracker = PointsTracker::Create(world, options, setup, world.frames.front());
      if (!tracker.ok()) return tracker.status();
      RunForm(
          frames, [&](std::size_t i) { return tracker->Step(world.frames[i]); }, *form);
    }
    std::cerr << absl::StrFormat("run %d of %d done\n", run + 1, arguments.runs);
  }
  if (xyz.nees.size() == 0)
    return absl::FailedPreconditionError("forms: every reference run broke");
  Json report;
  report["scenario"] = "forms";
  report["seed"] = arguments.seed;
  report["duration_s"] = arguments.duration_s;
  report["runs"] = arguments.runs;
  for (const Form* form : {&xyz, &sid, &esid}) report[form->name] = FormReport(*form, xyz);
  return report;
}

}  // namespace saccade
