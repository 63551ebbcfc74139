#include "server/eval/surface/clicks_command.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/strip.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <random>
#include <vector>

#include "server/eval/eval_wearable.hpp"
#include "server/eval/outline.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/statistics.hpp"
#include "server/sim/sim_source.hpp"
#include "server/surface/surface_map.hpp"

namespace saccade {
namespace {

using ClicksJson = nlohmann::ordered_json;

constexpr double kFirst_s = 5.0;       // the map has to exist
constexpr double kSettled_s = 2.0;     // a mark is looked at again
constexpr double kBorder_px = 8.0;     // of the picture
constexpr int kPublishEvery = 12;      // frames: 0.4 s
constexpr double kFar = 0.04;          // of the range: "the rest", which has to say so
constexpr double kSaysSo_sigma = 3.0;  // an error within so many of what is claimed was said

/// One click, and what became of it.
struct RandomClick {
  std::string id;
  FrameId frame = 0;
  double time_s = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double true_range_m = 0;
  bool outline = false;
  AnchorMethod method = AnchorMethod::kPoint;
  double error = 0, claimed = 0;  // shares of the range
  std::optional<double> settled_error, settled_claimed;
};

class ClicksRun {
 public:
  ClicksRun(const ClicksArguments& arguments, SimSource& source, Wearable& wearable,
            SurfaceMap* surfaces)
      : arguments_(arguments), source_(source), wearable_(wearable), surfaces_(surfaces) {
    const SourceInfo& info = source.info();
    fps_ = info.camera->intrinsics().fps;
    const double last_s = static_cast<double>(info.frame_count.value_or(0)) / fps_ - kSettled_s;
    every_s_ = (last_s - kFirst_s) / std::max(1, arguments.count);
  }

  absl::Status Run() {
    while (true) {
      absl::StatusOr<std::optional<Frame>> frame = source_.Next();
      if (!frame.ok()) return frame.status();
      if (!*frame) return absl::OkStatus();
      Step(**frame);
    }
  }

  const std::vector<RandomClick>& clicks() const { return clicks_; }
  int refused() const { return refused_; }
  int asked() const { return asked_; }

 private:
  void Step(const Frame& frame) {
    const WearableStep& step = wearable_.Step(frame);
    poses_.push_back(step.snapshot->world_from_camera);
    if (surfaces_ != nullptr && step.snapshot->status == TrackingStatus::kTracking) {
      FindSurfaces(*step.frame);
    }
    const double now_s = static_cast<double>(frame.id) / fps_;
    while (asked_ < arguments_.count && now_s >= kFirst_s + asked_ * every_s_) {
      ++asked_;
      Click(frame.id, now_s);
    }
    LookAgainAt(frame, *step.snapshot, now_s);
  }

  void FindSurfaces(const Frame& frame) {
    const auto places = wearable_.tracker().keyframes();
    if (!places || places->keyframes.empty()) return;
    if (surfaces_->Wants(frame.id, *places)) {
      surfaces_->Add(frame, *places);
    } else if (frame.id % kPublishEvery == 0) {
      surfaces_->SetPlaces(*places);
    }
    while (surfaces_->Work()) {
    }
    if (frame.id % kPublishEvery == 0) {
      wearable_.SetSurface(std::make_shared<const SurfaceSnapshot>(surfaces_->Snapshot()));
    }
  }

  void Click(FrameId now, double now_s) {
    const CameraModel& camera = *source_.info().camera;
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    RandomClick click;
    const auto late = static_cast<FrameId>(std::lround(arguments_.late_s * fps_));
    click.frame = now > late ? now - late : 0;
    click.time_s = now_s;
    click.pixel = {kBorder_px + unit(rng_) * (camera.width() - 1 - 2 * kBorder_px),
                   kBorder_px + unit(rng_) * (camera.height() - 1 - 2 * kBorder_px)};
    const std::optional<Eigen::Vector3d> bearing = camera.Unproject(click.pixel);
    const Rigid3 truth = source_.WorldFromCamera(click.frame);
    if (!bearing) return;
    const Eigen::Vector3d ray = (truth.rotation * *bearing).normalized();
    const std::optional<double> range = source_.SurfaceAlong(truth.translation, ray);
    if (!range) return;
    click.true_range_m = *range;
    click.outline = IsOnOutline(source_, truth.translation, truth.translation + *range * ray);
    const Rigid3& pose = poses_.at(click.frame);
    AnnotationTarget target = PixelTarget{click.frame, click.pixel};
    if (arguments_.in_map) {
      target = RayTarget{pose.translation, (pose.rotation * *bearing).normalized()};
    }
    const absl::StatusOr<Annotation> placed = PlaceAsExpert(wearable_, std::move(target), asked_);
    if (!placed.ok()) {
      ++refused_;
      std::cerr << absl::StrCat("click ", asked_, ": ", placed.status().message(), "\n");
      return;
    }
    click.id = placed->id;
    click.method = placed->anchor.method;
    const double range_now = (placed->anchor.point_in_world - pose.translation).norm();
    click.error = range_now / *range - 1.0;
    click.claimed = placed->anchor.error_m / *range;
    clicks_.push_back(click);
  }

  void LookAgainAt(const Frame& frame, const MapSnapshot& snapshot, double now_s) {
    const Rigid3 truth = source_.WorldFromCamera(frame.id);
    const auto annotations = wearable_.annotations();
    for (RandomClick& click : clicks_) {
      if (click.id.empty() || now_s < click.time_s + kSettled_s) continue;
      for (const Annotation& annotation : *annotations) {
        if (annotation.id != click.id) continue;
        const Rigid3 then = source_.WorldFromCamera(click.frame);
        const Eigen::Vector3d ray = then.rotation * *source_.info().camera->Unproject(click.pixel);
        const Eigen::Vector3d point = then.translation + click.true_range_m * ray.normalized();
        const Eigen::Vector3d seen =
            snapshot.world_from_camera.Inverse() * annotation.anchor.point_in_world;
        click.settled_error = (seen - truth.Inverse() * point).norm() / click.true_range_m;
        click.settled_claimed = annotation.anchor.error_m / click.true_range_m;
      }
      wearable_.Execute(
          DeleteAnnotation{.editor = "expert", .id = click.id, .done = [](const absl::Status&) {}});
      click.id.clear();
    }
  }

  const ClicksArguments& arguments_;
  SimSource& source_;
  Wearable& wearable_;
  SurfaceMap* surfaces_;
  double fps_ = 0, every_s_ = 0;
  std::mt19937_64 rng_{7};
  std::vector<Rigid3> poses_;  // by frame
  std::vector<RandomClick> clicks_;
  int asked_ = 0, refused_ = 0;
};

template <typename Of>
ClicksJson Figures(const std::vector<RandomClick>& clicks, Of of) {
  Sample errors;
  int far = 0, said = 0;
  for (const RandomClick& click : clicks) {
    const std::optional<std::pair<double, double>> one = of(click);
    if (!one) continue;
    errors.Add(std::abs(one->first));
    if (std::abs(one->first) <= kFar) continue;
    ++far;
    said += std::abs(one->first) <= kSaysSo_sigma * one->second ? 1 : 0;
  }
  return {{"clicks", errors.size()},      {"p50", errors.Percentile(50)},
          {"p90", errors.Percentile(90)}, {"p95", errors.Percentile(95)},
          {"above_4_percent", far},       {"of_these_said_so", said}};
}

using ErrorAndClaim = std::optional<std::pair<double, double>>;

ClicksJson ClicksReport(const ClicksRun& run) {
  const auto at_once = [](const RandomClick& click) {
    return ErrorAndClaim({click.error, click.claimed});
  };
  ClicksJson report;
  report["asked"] = run.asked();
  report["refused"] = run.refused();
  report["all"] = Figures(run.clicks(), at_once);
  report["no_outline"] = Figures(run.clicks(), [&](const RandomClick& click) {
    return click.outline ? ErrorAndClaim() : at_once(click);
  });
  report["by_surface"] = Figures(run.clicks(), [&](const RandomClick& click) {
    return click.method == AnchorMethod::kScene ? at_once(click) : ErrorAndClaim();
  });
  report["after_2_s"] = Figures(run.clicks(), [&](const RandomClick& click) {
    if (!click.settled_error) return ErrorAndClaim();
    return ErrorAndClaim({*click.settled_error, *click.settled_claimed});
  });
  return report;
}

absl::Status WriteClicks(const std::filesystem::path& file,
                         const std::vector<RandomClick>& clicks) {
  absl::StatusOr<OutputFile> csv = OutputFile::Create(file);
  if (!csv.ok()) return csv.status();
  csv->Write("frame,u_px,v_px,true_range_m,outline,method,error,claimed,error_2s,claimed_2s\n");
  for (const RandomClick& click : clicks) {
    csv->Write(absl::StrFormat("%d,%.1f,%.1f,%.4f,%d,%d,%.5f,%.5f,%.5f,%.5f\n", click.frame,
                               click.pixel.x(), click.pixel.y(), click.true_range_m, click.outline,
                               static_cast<int>(click.method), click.error, click.claimed,
                               click.settled_error.value_or(-1.0),
                               click.settled_claimed.value_or(-1.0)));
  }
  return csv->Close();
}

}  // namespace

void AddClicks(CLI::App& app, ClicksArguments& arguments) {
  CLI::App* clicks = app.add_subcommand(
      "clicks", "Click on random pixels of a simulated run and compare with truth; prints JSON");
  clicks->add_option("--source", arguments.source, "sim:desk?seed=N&motion=M&duration=S")
      ->required();
  clicks->add_option("--count", arguments.count, "Clicks, evenly over the run")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  clicks->add_option("--late", arguments.late_s, "Seconds that a click is late, 0 to 8")
      ->check(CLI::Range(0.0, 8.0))
      ->capture_default_str();
  clicks->add_flag("--in-map", arguments.in_map, "Along lines of sight, as in the map's view");
  clicks->add_flag("--surfaces,!--no-surfaces", arguments.surfaces, "Whether there are surfaces");
  clicks->add_option("--out", arguments.out, "Folder for clicks.csv and report.json")->required();
  clicks->add_option("--config", arguments.tracker.config, "TOML file with tracker options");
  clicks
      ->add_option("--set", arguments.tracker.set,
                   "One tracker option as key=value; may be repeated")
      ->take_all();
}

absl::Status ClicksCommand(const ClicksArguments& arguments) {
  absl::string_view rest = arguments.source;
  if (!absl::ConsumePrefix(&rest, "sim:")) {
    return absl::InvalidArgumentError(absl::StrCat("clicks: --source '", arguments.source,
                                                   "': only the simulator knows: give sim:desk?"
                                                   "duration=30"));
  }
  auto source = SimSource::OpenUri(rest, {});
  if (!source.ok()) return source.status();
  const auto frames = (*source)->info().frame_count;
  const double length_s =
      frames ? static_cast<double>(*frames) / (*source)->info().camera->intrinsics().fps : 0.0;
  if (length_s < kFirst_s + kSettled_s + 1.0) {
    return absl::InvalidArgumentError(absl::StrCat("clicks: --source '", arguments.source,
                                                   "': give duration=S, at least ",
                                                   kFirst_s + kSettled_s + 1.0));
  }
  absl::StatusOr<std::unique_ptr<Wearable>> wearable =
      MakeWearable((*source)->info(), arguments.tracker);
  if (!wearable.ok()) return wearable.status();
  absl::StatusOr<std::unique_ptr<SurfaceMap>> surfaces = SurfaceMap::Create(SurfaceOptions());
  if (!surfaces.ok()) return surfaces.status();
  if (absl::Status status = CreateFolder(arguments.out); !status.ok()) return status;
  ClicksRun run(arguments, **source, **wearable, arguments.surfaces ? surfaces->get() : nullptr);
  if (absl::Status status = run.Run(); !status.ok()) return status;
  const ClicksJson report = ClicksReport(run);
  for (const absl::Status& status :
       {WriteClicks(arguments.out / "clicks.csv", run.clicks()),
        WriteFileAtomically(arguments.out / "report.json", report.dump(2) + "\n")}) {
    if (!status.ok()) return status;
  }
  std::cout << report.dump(2) << "\n";
  return absl::OkStatus();
}

}  // namespace saccade
