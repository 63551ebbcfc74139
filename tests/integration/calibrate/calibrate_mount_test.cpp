// calibrate-mount through pixels, on simulated time: the simulated head, which is not built as
// everybody believes, turns the rendered camera; the real tracker sees the pictures, with noise and
// blur; gaze control drives the head and solves.
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <fstream>
#include <numbers>
#include <random>

#include "server/gaze/gaze_loop.hpp"
#include "server/mount/drivers/sim_mount.hpp"
#include "server/sim/sim_source.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade::calibrate_mount_test {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr Timestamp kStep = 10'000'000, kDelay = 40'000'000;
const GazeCaller kAnn{{"a", "Ann"}, false};

class World {
 public:
  explicit World(std::uint64_t seed) {
    SimMountOptions mount;
    mount.seed = seed;
    mount.truth = CrookedMount(seed);
    mount_ = std::make_shared<SimMount>(mount);
    SimOptions sim;
    sim.seed = seed;
    sim.motion = SimMotion::kStill;
    sim.fps = 15;
    absl::StatusOr<std::unique_ptr<SimSource>> source = SimSource::Open(sim);
    if (!source.ok()) return;
    source_ = *std::move(source);
    source_->DriveHead(mount_);
    SourceInfo info = source_->info();
    info.mount = nullptr;
    absl::StatusOr<std::unique_ptr<Tracker>> tracker = Tracker::Create(info, {});
    if (!tracker.ok()) return;
    tracker_ = *std::move(tracker);
    loop_ = std::make_unique<GazeLoop>(*mount_, GazeOptions(), [] { return "lease"; });
    mount_->AdvanceTo(0);
  }

  bool ready() const { return loop_ != nullptr; }
  int lost() const { return lost_; }
  const GazeSnapshot& state() const { return *loop_->snapshot(); }

  absl::Status Begin() {
    absl::Status begun = absl::InternalError("not answered");
    loop_->Execute(AcquireGazeLease{kAnn, "", [](auto) {}}, now_ns_);
    loop_->Execute(SteerGaze{kAnn, SteerGaze::What::kCalibrate,
                             [&](const auto& answer) { begun = answer.status(); }},
                   now_ns_);
    return begun;
  }

  /// Lets time pass while the pilot's heart beats.
  void Run(double seconds) {
    const Timestamp end = now_ns_ + static_cast<Timestamp>(1e9 * seconds);
    while (now_ns_ < end) {
      now_ns_ += kStep;
      mount_->AdvanceTo(now_ns_);
      // A picture can be taken once the head has moved past it.
      while (Seconds(now_ns_) > static_cast<double>(frames_) / 15 + 0.02) TakeFrame();
      while (!due_.empty() && due_.front().capture_time_ns + kDelay <= now_ns_) {
        loop_->OnView({.map = std::make_shared<const MapSnapshot>(due_.front()),
                       .annotations = nullptr,
                       .angles = std::nullopt,
                       .down_in_world = std::nullopt});
        due_.pop_front();
      }
      loop_->Execute(AcquireGazeLease{kAnn, "lease", [](auto) {}}, now_ns_);
      loop_->Step(now_ns_);
    }
  }

 private:
  void TakeFrame() {
    absl::StatusOr<std::optional<Frame>> frame = source_->Next();
    ASSERT_TRUE(frame.ok() && frame->has_value());
    (*frame)->mount.reset();
    const std::shared_ptr<const MapSnapshot> seen = tracker_->Track(**frame);
    if (++frames_ > 30 && seen->status != TrackingStatus::kTracking) ++lost_;
    due_.push_back(*seen);
  }

  std::shared_ptr<SimMount> mount_;
  std::unique_ptr<SimSource> source_;
  std::unique_ptr<Tracker> tracker_;
  std::unique_ptr<GazeLoop> loop_;
  std::deque<MapSnapshot> due_;
  Timestamp now_ns_ = 0;
  int frames_ = 0, lost_ = 0;
};

/// Worst disagreement of two models on how the camera turns between two raw positions [deg].
double Worst(const MountOptions& a, const MountOptions& b) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> angle(-20 * kDegree, 20 * kDegree);
  const auto pose = [](const MountOptions& options, const Eigen::Vector3d& raw) {
    Eigen::Vector3d angles;
    for (int k = 0; k < kMountJoints; ++k) {
      angles(k) = options.of(static_cast<MountJoint>(k)).FromRaw(raw(k));
    }
    return MountModel(options).MountFromCamera(ToAngles(angles));
  };
  double worst = 0;
  for (int k = 0; k < 300; ++k) {
    const Eigen::Vector3d from(angle(rng), angle(rng), angle(rng)),
        to(angle(rng), angle(rng), angle(rng));
    worst = std::max(worst, RotationAngle(pose(a, from).Inverse() * pose(a, to),
                                          pose(b, from).Inverse() * pose(b, to)));
  }
  return worst / kDegree;
}

TEST(CalibrateMountThroughPixels, TheRealTrackerTellsHowACrookedHeadIsBuilt) {
  World world(1);
  ASSERT_TRUE(world.ready());
  world.Run(3);  // a map
  ASSERT_EQ(world.state().joints_rad.has_value(), true);
  ASSERT_TRUE(world.Begin().ok());
  for (int k = 0; k < 120 && world.state().calibration->running; ++k) world.Run(1);
  const std::shared_ptr<const MountCalibrationReport> report = world.state().calibration;
  ASSERT_FALSE(report->running);
  ASSERT_EQ(report->problem, "");
  const std::filesystem::path file = ::testing::TempDir() + "calibrate_mount_test.toml";
  std::ofstream(file) << report->toml;
  MountOptions found;
  ASSERT_TRUE(found.LoadToml(file).ok());
  const MountOptions truth = CrookedMount(1);
  const double before = Worst({}, truth), after = Worst(found, truth);
  std::printf(
      "through pixels: %.1f deg off before, %.2f deg after; residual %.2f deg RMS, %.1f mm; delay "
      "%.1f ms, latency %.1f ms; %d pictures, %d left out, %d not tracked\n",
      before, after, report->orientation_rms_rad / kDegree, 1e3 * report->position_rms_m,
      1e3 * report->encoder_delay_s, 1e3 * report->command_latency_s, report->pictures,
      report->outliers, world.lost());
  EXPECT_GT(before, 20);
  EXPECT_LT(after, 0.6);
  EXPECT_NEAR(report->encoder_delay_s, 0.035, 0.004);
  EXPECT_NEAR(report->command_latency_s, 0.06, 0.006);
  for (std::size_t k = 0; k < kMountJoints; ++k) {
    EXPECT_EQ(found.joints[k].encoder_sign, truth.joints[k].encoder_sign);
  }
}

}  // namespace
}  // namespace saccade::calibrate_mount_test
