#include "server/eval/team/pair_command.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>
#include <iostream>

#include "server/capture/dataset.hpp"
#include "server/eval/eval_wearable.hpp"
#include "server/eval/frame_range.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/team/foreign_rooms.hpp"
#include "server/eval/team/pair_run.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

using Json = nlohmann::ordered_json;

std::string PairTable(const Json& report) {
  std::string text;
  for (const Json& one : report["wearers"]) {
    absl::StrAppend(
        &text, absl::StrFormat("%-4s tracked %d of %d, %d keyframes, ATE (Sim3) %.2f cm\n",
                               one["name"].get<std::string>(), one["tracked_frames"].get<int>(),
                               one["frames"].get<int>(), one["keyframes"].get<int>(),
                               100 * one.value("ate_sim3_m", NAN)));
  }
  for (const Json& one : report["orders"]) {
    if (!one["merged"]) {
      absl::StrAppend(&text, "not merged; places recognised: ", one["places_found"].dump(), "\n");
      continue;
    }
    absl::StrAppend(&text, absl::StrFormat("merged at %.1f s (%.1f s after a common view)",
                                           one["merged_s"].get<double>(),
                                           one.value("after_common_view_s", NAN)));
    for (const char* when : {"first", "last"}) {
      if (!one.contains(when) || one[when]["error"].is_null()) continue;
      const Json& error = one[when]["error"];
      absl::StrAppend(
          &text, absl::StrFormat("; %s: off %.1f cm %.2f deg, at the seam %.1f cm", when,
                                 100 * error["off_m"].get<double>(), error["off_deg"].get<double>(),
                                 100 * error["seam_m"].get<double>()));
    }
    absl::StrAppend(&text, "\n");
  }
  return text;
}

}  // namespace

absl::Status PairCommand(const TeamArguments& arguments) {
  TrackerArguments setup;
  for (const std::string& pair : arguments.set) {
    if (absl::StartsWith(pair, "team.")) {
      return absl::InvalidArgumentError(
          absl::StrCat("--set ", pair, ": two recordings have a tracker's keys alone"));
    }
    setup.set.push_back(pair);
  }
  if (arguments.frames.size() != 0 && arguments.frames.size() != 2) {
    return absl::InvalidArgumentError("--frames: twice, once for each recording, or not at all");
  }
  if (absl::Status made = CreateFolder(arguments.out); !made.ok()) return made;
  std::array<PairMember, 2> members;
  std::array<std::unique_ptr<FrameSource>, 2> sources;
  std::array<std::unique_ptr<Tracker>, 2> trackers;
  for (std::size_t k = 0; k < 2; ++k) {
    SourceOptions options;
    if (!arguments.frames.empty()) {
      const absl::StatusOr<FrameRange> range = ParseFrameRange(arguments.frames[k]);
      if (!range.ok()) return range.status();
      options.first_frame = range->first;
      options.end_frame = range->end;
    }
    auto source = OpenDataset(arguments.datasets[k], options);
    if (!source.ok()) return source.status();
    sources[k] = *std::move(source);
    auto tracker = MakeTracker(sources[k]->info(), setup);
    if (!tracker.ok()) return tracker.status();
    trackers[k] = *std::move(tracker);
    members[k].name = std::string(1, static_cast<char>('A' + k));
    members[k].source = sources[k].get();
    members[k].track = [tracker = trackers[k].get()](const Frame& frame) {
      return tracker->Track(frame);
    };
    const auto truth = arguments.datasets[k] / "groundtruth.txt";
    if (!MayExist(truth)) continue;
    absl::StatusOr<Trajectory> loaded = LoadTrajectory(truth);
    if (!loaded.ok()) return loaded.status();
    members[k].truth = *std::move(loaded);
  }
  PairOptions options;
  options.out = arguments.out;
  const auto report = RunPair(std::move(members), options);
  if (!report.ok()) return report.status();
  if (absl::Status done =
          WriteFileAtomically(arguments.out / "report.json", report->dump(2) + "\n");
      !done.ok()) {
    return done;
  }
  std::cout << (arguments.json ? report->dump(2) + "\n" : PairTable(*report));
  return absl::OkStatus();
}

absl::Status ForeignCommand(const TeamArguments& arguments) {
  if (absl::Status made = CreateFolder(arguments.out); !made.ok()) return made;
  const Json report = RunForeignRooms(arguments.foreign_pairs, arguments.seed);
  if (absl::Status done = WriteFileAtomically(arguments.out / "report.json", report.dump(2) + "\n");
      !done.ok()) {
    return done;
  }
  std::cout << report.dump(2) << "\n";
  if (report["merged"] != 0) return absl::FailedPreconditionError("foreign rooms were merged");
  return absl::OkStatus();
}

}  // namespace saccade
