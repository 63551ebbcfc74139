#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <array>
#include <cmath>
#include <random>

#include "server/filter/filter_state.hpp"
#include "server/filter/robust_pose.hpp"
#include "tests/bench/bench.hpp"

namespace saccade {
namespace {

constexpr std::size_t kFirstBirths = 60;     // in one clone, as the tracker starts
constexpr std::size_t kBirthsPerClone = 15;  // afterwards (slam-spec 5.4)
constexpr int kBirthEvery = 5;               // frames, until all features are born
constexpr int kWarmUp = 120;                 // updates; past the first-estimates ones of a map
constexpr double kNoise_px = 0.5;
constexpr double kRelativeDepthSigma = 0.1;
constexpr double kFrame_s = 1.0 / 30.0;

enum Stage { kPredict, kPredictions, kRobustPose, kUpdate, kAll, kStages };
constexpr std::array<const char*, kStages> kStageNames = {"predict", "pixels and gates",
                                                          "robust pose", "update", "sum"};
using StageLeast = std::array<LeastTimes, kStages>;

CameraModel Lens() {
  CameraIntrinsics lens;
  lens.model = LensModel::kBrownConrady;
  lens.width = 640;
  lens.height = 480;
  lens.fx = lens.fy = 457.0;
  lens.cx = 319.5;
  lens.cy = 239.5;
  lens.distortion = {-0.12, 0.03, 0, 0, 0};
  return CameraModel(lens);
}

/// Somebody who sways by a few centimetres before things 1 to 4 m away, all of them always in view.
Rigid3 Sway(double t) {
  return {ExpQuaternion({0.04 * std::sin(1.1 * t), 0.05 * std::sin(0.9 * t), 0.05 * std::sin(t)}),
          {0.12 * std::sin(0.8 * t), 0.06 * std::sin(1.3 * t), 0.08 * std::sin(0.6 * t)}};
}

/// The work of the tracker's filter on one frame after another.
class FilterRun {
 public:
  FilterRun(int features, PointForm form) : lens_(Lens()), filter_(Options(form)), random_(7) {
    std::uniform_real_distribution<double> u(150, 490), v(120, 360), range(1.0, 4.0);
    for (int k = 0; k < features; ++k) {
      const Eigen::Vector2d pixel(u(random_), v(random_));
      points_.push_back(range(random_) * *lens_.Unproject(pixel));
    }
    Vector12d sigma = Vector12d::Zero();
    sigma.segment<3>(6).setConstant(0.1);
    sigma.tail<3>().setConstant(0.1);
    filter_.Reset(CameraMotion(), sigma.cwiseAbs2().asDiagonal());
  }

  int dim() const { return filter_.dim(); }
  bool complete() const { return filter_.feature_count() == points_.size(); }

  /// One frame. `ms` receives the times of the stages.
  absl::Status Step(std::array<double, kStages>& ms) {
    truth_ = Sway(kFrame_s * ++frame_);
    const std::vector<Observation> seen = See();
    StopWatch watch;
    filter_.Predict(kFrame_s, MotionNoise());
    ms[kPredict] = watch.Lap_ms();
    std::vector<PoseEvidence> evidence;
    evidence.reserve(seen.size());
    for (const Observation& each : seen) {
      const auto predicted = filter_.Predicted(lens_, each.id);
      if (!predicted) return absl::InternalError("bench filter: a feature left the view");
      evidence.push_back({filter_.Point(each.id), *predicted, each.pixel, each.noise});
    }
    ms[kPredictions] = watch.Lap_ms();
    const PosePrior prior = {filter_.camera().world_from_camera, filter_.PoseCovariance()};
    const RobustPose pose =
        EstimateRobustPose(lens_, prior, evidence, RobustPoseOptions(), random_);
    ms[kRobustPose] = watch.Lap_ms();
    const auto report = filter_.Update(lens_, seen, pose.world_from_camera);
    ms[kUpdate] = watch.Lap_ms();
    ms[kAll] = ms[kPredict] + ms[kPredictions] + ms[kRobustPose] + ms[kUpdate];
    if (!report.ok()) return report.status();
    return Birth();
  }

  /// Largest of the camera's position error so far: the filter must really have worked.
  double PositionError() const {
    return (filter_.camera().world_from_camera.translation - truth_.translation).norm();
  }

 private:
  static FilterOptions Options(PointForm form) {
    FilterOptions options;
    options.form = form;
    options.readout_sigma_s = 0.015;
    return options;
  }

  Eigen::Vector2d PixelOf(std::size_t point) {
    const Eigen::Vector2d exact = *lens_.Project(truth_.Inverse() * points_[point]);
    const double du = kNoise_px * normal_(random_), dv = kNoise_px * normal_(random_);
    return exact + Eigen::Vector2d(du, dv);
  }

  std::vector<Observation> See() {
    std::vector<Observation> seen;
    for (std::size_t k = 0; k < filter_.feature_count(); ++k) {
      Observation observation;
      observation.id = k + 1;
      observation.pixel = PixelOf(k);
      observation.noise = kNoise_px * kNoise_px * Eigen::Matrix2d::Identity();
      seen.push_back(observation);
    }
    return seen;
  }

  absl::Status Birth() {
    if (complete() || frame_ % kBirthEvery != 1) return absl::OkStatus();
    const AnchorPoseId anchor = filter_.AddAnchor();
    const std::size_t births = filter_.feature_count() == 0 ? kFirstBirths : kBirthsPerClone;
    for (std::size_t k = 0; k < births && !complete(); ++k) {
      const std::size_t point = filter_.feature_count();
      FeatureBirth birth;
      Eigen::Matrix<double, 3, 2> d_bearing;
      birth.id = point + 1;
      birth.bearing = *lens_.Unproject(PixelOf(point), &d_bearing);
      birth.bearing_covariance = kNoise_px * kNoise_px * d_bearing * d_bearing.transpose();
      // Depths roughly known: not how starts go is measured here, but what updates cost.
      const double inverse_range = 1.0 / (truth_.Inverse() * points_[point]).norm();
      birth.inverse_range_sigma = kRelativeDepthSigma * inverse_range;
      birth.inverse_range = inverse_range + birth.inverse_range_sigma * normal_(random_);
      if (const absl::Status status = filter_.AddFeature(anchor, birth); !status.ok()) {
        return status;
      }
    }
    return absl::OkStatus();
  }

  CameraModel lens_;
  FilterState filter_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<Eigen::Vector3d> points_;
  Rigid3 truth_;
  int frame_ = 0;
};

/// T42: p99 of the update with so many features, all measured.
std::optional<double> Bar(int features) {
  if (features == 50) return 1.0;
  if (features == 100) return 2.0;
  if (features == 150) return 4.0;
  return std::nullopt;
}

absl::Status RunOnce(int features, PointForm form, int updates, StageLeast& least, int& dim) {
  FilterRun run(features, form);
  std::array<double, kStages> ms{};
  for (int k = 0; !run.complete() || k < kWarmUp; ++k) {
    if (const absl::Status status = run.Step(ms); !status.ok()) return status;
  }
  dim = run.dim();
  for (int k = 0; k < updates; ++k) {
    if (const absl::Status status = run.Step(ms); !status.ok()) return status;
    for (int stage = 0; stage < kStages; ++stage) {
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
      for (int stage = 0; stage < kStages; ++stage) {
        report.rows.push_back({group, kStageNames[stage], least[stage].ToSample(),
                               stage == kUpdate ? Bar(features) : std::nullopt});
      }
    }
  }
  return report;
}

}  // namespace saccade
