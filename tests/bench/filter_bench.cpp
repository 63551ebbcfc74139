#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <array>

#include "tests/bench/bench.hpp"
#include "tests/bench/filter_run.hpp"

namespace saccade {
namespace {

constexpr std::array<const char*, kFilterStages> kStageNames = {"predict", "pixels and gates",
                                                                "robust pose", "update", "sum"};
using StageLeast = std::array<LeastTimes, kFilterStages>;

/// T42: p99 of the update with so many features, all measured.
std::optional<double> Bar(int features) {
  if (features == 50) return 1.0;
  if (features == 100) return 2.0;
  if (features == 150) return 4.0;
  return std::nullopt;
}

absl::Status RunOnce(int features, PointForm form, int updates, StageLeast& least, int& dim) {
  FilterState filter(FilterRun::Options(form));
  filter.Reset(CameraMotion(), FilterRun::StartCovariance());
  FilterRun run(features, filter);
  if (const absl::Status status = run.WarmUp(); !status.ok()) return status;
  dim = filter.dim();
  std::array<double, kFilterStages> ms{};
  for (int k = 0; k < updates; ++k) {
    if (const absl::Status status = run.Step(ms); !status.ok()) return status;
    for (int stage = 0; stage < kFilterStages; ++stage) {
      least[stage].Add(static_cast<std::size_t>(k), ms[stage]);
    }
  }
  if (!(run.PositionError() < 0.5)) {  // scale is only the prior's
    return absl::InternalError(absl::StrCat("bench filter: ", features, " features: the filter is ",
                                            run.PositionError(), " m off; its times mean nothing"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TimingReport> BenchFilter(const FilterBenchArguments& arguments) {
  TimingReport report;
  report.bench = "filter";
  report.facts = {{"measured",
                   "every feature in every update; state: camera 12, read-out 1, clones (of 60, "
                   "then 15 features) "
                   "6 each, features 3 (SID) or 1 (ESID) each"},
                  {"times", absl::StrCat("least of ", arguments.repeats, " identical runs of ",
                                         arguments.updates, " updates")}};
  for (const int features : arguments.features) {
    for (const PointForm form : {PointForm::kBearingRange, PointForm::kRangeOnly}) {
      const char* name = form == PointForm::kBearingRange ? "SID" : "ESID";
      if (arguments.form != "both" && !absl::EqualsIgnoreCase(arguments.form, name)) continue;
      StageLeast least;
      int dim = 0;
      for (int k = 0; k < arguments.repeats; ++k) {
        const absl::Status status = RunOnce(features, form, arguments.updates, least, dim);
        if (!status.ok()) return status;
      }
      const std::string group = absl::StrCat(features, " features, ", name, ", ", dim, " states");
      for (int stage = 0; stage < kFilterStages; ++stage) {
        report.rows.push_back({group, kStageNames[stage], least[stage].ToSample(),
                               stage == kUpdate ? Bar(features) : std::nullopt});
      }
    }
  }
  return report;
}

}  // namespace saccade
