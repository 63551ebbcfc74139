#include "server/eval/run.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "server/eval/run_recorder.hpp"

namespace saccade::run_test {
namespace {

/// `count` empty frames at 30 Hz.
class BlankSource final : public FrameSource {
 public:
  explicit BlankSource(std::uint64_t count) : count_(count) {
    CameraIntrinsics camera;
    camera.width = camera.height = 16;
    camera.fx = camera.fy = 10;
    info_.camera = std::make_shared<CameraModel>(camera);
    info_.frame_count = count;
  }
  const SourceInfo& info() const override { return info_; }
  absl::StatusOr<std::optional<Frame>> Next() override {
    if (next_ == count_) return std::nullopt;
    Frame frame;
    frame.id = next_++;
    frame.capture_time_ns = static_cast<Timestamp>(frame.id) * 33'000'000;
    frame.source_timestamp =
        "0." + std::string(frame.id < 4 ? "0" : "") + std::to_string(33 * frame.id);
    frame.grey = cv::Mat(16, 16, CV_8UC1, cv::Scalar(0));
    return frame;
  }
  std::uint64_t bad_frames() const override { return 3; }

 private:
  std::uint64_t count_, next_ = 0;
  SourceInfo info_;
};

Rigid3 TruePose(FrameId id) {
  const double t = static_cast<double>(id) / 30.0;
  return {ExpQuaternion({0, t, 0}), {std::sin(9 * t), std::cos(7 * t), t}};
}

/// Tracks perfectly, but: frames 0 and 1 initialise, 5 is tracked with four matches, 6 coasts, 7 is
/// lost and 8 relocalises.
std::shared_ptr<const MapSnapshot> FakeTrack(const Frame& frame) {
  auto snapshot = std::make_shared<MapSnapshot>();
  snapshot->frame_id = frame.id;
  snapshot->metric = true;
  snapshot->matched = frame.id == 5 ? 4 : 20;
  snapshot->attempted = 25;
  snapshot->status = frame.id < 2    ? TrackingStatus::kInitialising
                     : frame.id == 6 ? TrackingStatus::kCoasting
                     : frame.id == 7 ? TrackingStatus::kLost
                     : frame.id == 8 ? TrackingStatus::kRelocalising
                                     : TrackingStatus::kTracking;
  snapshot->world_from_camera = TruePose(frame.id);
  snapshot->features.resize(frame.id);
  return snapshot;
}

std::string Read(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class Run : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove_all(folder_); }
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("saccade-run-" + std::to_string(::getpid()));
};

TEST_F(Run, CountsSumToFramesAndOnlyTrackedPosesAreWritten) {
  BlankSource source(20);
  Trajectory truth;
  for (FrameId id = 0; id < 20; ++id) {
    truth.push_back({static_cast<Timestamp>(id) * 33'000'000, TruePose(id)});
  }
  const auto report = RunTracker(source, FakeTrack, truth, folder_);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->at("frames"), 20);
  EXPECT_EQ(report->at("initialising_frames"), 2);
  EXPECT_EQ(report->at("tracked_frames"), 14);
  EXPECT_EQ(report->at("coasting_frames"), 2);
  EXPECT_EQ(report->at("lost_frames"), 2);
  EXPECT_EQ(report->at("lost_after_start_frames"), 2);
  EXPECT_EQ(report->at("false_tracked_frames"), 0);
  EXPECT_EQ(report->at("scale_windows"), nullptr);  // the run is shorter than a window
  EXPECT_EQ(report->at("bad_frames"), 3);
  EXPECT_EQ(report->at("metric"), true);
  EXPECT_EQ(report->at("features").at("max"), 19);
  EXPECT_LT(report->at("ate_se3_m").get<double>(), 1e-9);
  EXPECT_GT(report->at("ate_null_m").get<double>(), 0.3);
  EXPECT_EQ(nlohmann::ordered_json::parse(Read(folder_ / "report.json")), *report);

  const auto written = LoadTrajectory(folder_ / "trajectory.tum");
  ASSERT_TRUE(written.ok()) << written.status();
  EXPECT_EQ(written->size(), 14);
  EXPECT_EQ(Read(folder_ / "trajectory.tum").substr(0, 6), "0.066 ");  // the stamp's own text
  std::istringstream frames(Read(folder_ / "frames.csv"));
  std::string line;
  std::getline(frames, line);
  EXPECT_EQ(line, "frame,timestamp,status,attempted,matched,wall_ms,cpu_ms");
  for (int i = 0; i < 6; ++i) std::getline(frames, line);
  EXPECT_EQ(line.substr(0, line.find(",4,") + 3), "5,0.165,coasting,25,4,");
}

TEST_F(Run, HalfARunIsTheFirstHalfOfTheWholeOne) {
  BlankSource whole(20), half(10);
  ASSERT_TRUE(RunTracker(whole, FakeTrack, {}, folder_ / "whole").ok());
  const auto report = RunTracker(half, FakeTrack, {}, folder_ / "half");
  ASSERT_TRUE(report.ok());
  EXPECT_FALSE(report->contains("ate_se3_m"));  // no truth
  const std::string first = Read(folder_ / "half" / "trajectory.tum");
  EXPECT_EQ(Read(folder_ / "whole" / "trajectory.tum").substr(0, first.size()), first);
  EXPECT_FALSE(first.empty());
}

TEST_F(Run, TableShowsTheNullErrorBesideEachAte) {
  BlankSource source(20);
  Trajectory truth;
  for (FrameId id = 0; id < 20; ++id) {
    truth.push_back({static_cast<Timestamp>(id) * 33'000'000, TruePose(id)});
  }
  const auto report = RunTracker(source, FakeTrack, truth, folder_);
  ASSERT_TRUE(report.ok());
  const std::string table = SummaryTable(*report);
  EXPECT_NE(table.find("ATE SE3        0.00 cm    standing still"), table.npos) << table;
  EXPECT_NE(table.find("ATE Sim3"), table.npos);
}

TEST_F(Run, FalseClaimsAndScaleAreTold) {
  BlankSource source(200);
  Trajectory truth;
  for (FrameId id = 0; id < 200; ++id) {
    truth.push_back({static_cast<Timestamp>(id) * 33'000'000, TruePose(id)});
  }
  const auto jumping = [](const Frame& frame) {
    auto snapshot = std::make_shared<MapSnapshot>(*FakeTrack(frame));
    if (frame.id >= 150 && frame.id < 155) snapshot->world_from_camera.translation.x() += 0.4;
    return snapshot;
  };
  const auto report = RunTracker(source, jumping, truth, folder_);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->at("false_tracked_frames"), 5);
  EXPECT_NEAR(report->at("false_tracked").at("first_s").get<double>(), 150 * 0.033, 1e-9);
  EXPECT_NEAR(report->at("scale_windows").at("min").get<double>(), 1.0, 0.05);
  EXPECT_NE(SummaryTable(*report).find("false tracked     5"), std::string::npos)
      << SummaryTable(*report);
}

TEST_F(Run, UnwritableFolderIsAnError) {
  BlankSource source(3);
  EXPECT_FALSE(RunTracker(source, FakeTrack, {}, "/dev/null/x").ok());
}

}  // namespace
}  // namespace saccade::run_test
