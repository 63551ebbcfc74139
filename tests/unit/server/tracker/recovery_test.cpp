// The tracker on a recording, a real one and one of the simulator, whose lens is covered, or whose
// view jumps.
#include <gtest/gtest.h>

#include <ctime>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "server/capture/dataset.hpp"
#include "server/map/stored_map.hpp"
#include "server/sim/sim_source.hpp"
#include "server/tracker/tracker.hpp"

namespace saccade::recovery_test {
namespace {

using Snapshot = std::shared_ptr<const MapSnapshot>;

constexpr std::uint64_t kFrames = 330;

/// Null: it is not here.
std::unique_ptr<FrameSource> OpenRecorded() {
  SourceOptions options;
  options.end_frame = kFrames;
  auto source = OpenDataset(
      std::filesystem::path(SACCADE_SOURCE_DIR) / "../shared/data/tum_fr1_xyz", options);
  return source.ok() ? *std::move(source) : nullptr;
}

std::unique_ptr<FrameSource> OpenSimulated() {
  SimOptions options;
  options.motion = SimMotion::kDesk;
  options.duration_s = static_cast<double>(kFrames) / options.fps;
  auto source = SimSource::Open(options);
  return source.ok() ? *std::move(source) : nullptr;
}

/// Frames of a recording, handed out in any order at 30 Hz. Nobody knows of a target.
class Player {
 public:
  explicit Player(FrameSource& source) {
    info_ = source.info();
    info_.target.reset();
    for (auto frame = source.Next(); frame.ok() && *frame; frame = source.Next()) {
      frames_.push_back(**frame);
    }
    auto created = Tracker::Create(info_, TrackerOptions());
    if (created.ok()) tracker_ = *std::move(created);
  }
  bool ready() const { return tracker_ != nullptr && !frames_.empty(); }

  Snapshot Show(std::size_t index) { return Show(frames_[index]); }
  Snapshot ShowBlack() {
    Frame frame = frames_.front();
    frame.grey = cv::Mat::zeros(frame.grey.size(), CV_8UC1);
    return Show(frame);
  }
  Snapshot ShowNoise(cv::RNG& random) {
    Frame frame = frames_.front();
    frame.grey = cv::Mat(frame.grey.size(), CV_8UC1);
    random.fill(frame.grey, cv::RNG::UNIFORM, 0, 255);
    return Show(frame);
  }
  Snapshot Show(Frame frame) {
    frame.id = next_;
    frame.capture_time_ns = start_ns_ + static_cast<Timestamp>(next_++) * 33'333'333;
    return tracker_->Track(frame);
  }
  /// From now on the clock is `by_ns` ahead of what it would have been.
  void SetClock(Timestamp by_ns) { start_ns_ += by_ns; }
  Tracker& tracker() { return *tracker_; }
  /// Another run: its clock starts later, its frames are counted from 0.
  void BeginAnotherRun(TrackerOptions options = {}) {
    tracker_ = *Tracker::Create(info_, options);
    next_ = 0;
    SetClock(86'400'000'000'000);
  }

 private:
  SourceInfo info_;
  std::vector<Frame> frames_;
  std::unique_ptr<Tracker> tracker_;
  std::uint64_t next_ = 0;
  Timestamp start_ns_ = 10'000'000'000'000;
};

struct Place {
  const char* name;
  std::unique_ptr<FrameSource> (*open)();
};

class Recovery : public ::testing::TestWithParam<Place> {
 protected:
  void SetUp() override {
    const std::unique_ptr<FrameSource> source = GetParam().open();
    if (source == nullptr) GTEST_SKIP() << GetParam().name << " is not here (../shared/data)";
    player_ = std::make_unique<Player>(*source);
    ASSERT_TRUE(player_->ready());
    for (std::size_t k = 0; k < 300; ++k) {
      const Snapshot shown = player_->Show(k);
      poses_.push_back(shown->world_from_camera);
      revisions_.push_back(shown->map_revision);
    }
  }

  std::unique_ptr<Player> player_;
  std::vector<Rigid3> poses_;
  std::vector<std::uint64_t> revisions_;
};

TEST_P(Recovery, WhatIsRefinedAllTheTimeIsNoJump) { EXPECT_EQ(revisions_[299], revisions_[60]); }

TEST_P(Recovery, AfterTheViewJumpsBackToAMappedPlace) {
  Snapshot last;
  int tracked_after = -1;
  for (std::size_t k = 0; k < 45; ++k) {
    last = player_->Show(150 + k);
    if (tracked_after < 0 && last->status == TrackingStatus::kTracking && k > 3) {
      tracked_after = static_cast<int>(k);
      EXPECT_LT((last->world_from_camera.translation - poses_[150 + k].translation).norm(), 0.05)
          << "never at a wrong place";
    }
  }
  ASSERT_EQ(last->status, TrackingStatus::kTracking);
  EXPECT_LT((last->world_from_camera.translation - poses_[194].translation).norm(), 0.04);
  EXPECT_LT(RotationAngle(last->world_from_camera, poses_[194]), 0.03);
}

TEST_P(Recovery, AfterTheLensWasCovered) {
  Snapshot last;
  for (int k = 0; k < 40; ++k) last = player_->ShowBlack();
  EXPECT_EQ(last->status, TrackingStatus::kLost);
  EXPECT_FALSE(last->advice.empty());
  const std::size_t known = last->features.size();
  for (std::size_t k = 0; k < 20; ++k) last = player_->Show(285 + k / 2);
  ASSERT_EQ(last->status, TrackingStatus::kTracking);
  EXPECT_GE(last->features.size() + 5, known);  // the map was frozen, not thrown away
  EXPECT_LT((last->world_from_camera.translation - poses_[294].translation).norm(), 0.04);
}

/// Pause of an hour, of a year (nanoseconds taken for seconds), clock set back by an hour.
TEST_P(Recovery, AGapInTimeOfWhateverLengthIsANewStartInTheMapAtTheCostOfAFrame) {
  constexpr Timestamp kHour_ns = 3'600'000'000'000;
  std::size_t frame = 275;
  for (const Timestamp by_ns : {kHour_ns, 8760 * kHour_ns, -kHour_ns}) {
    player_->SetClock(by_ns);
    Snapshot last;
    std::size_t k = 0;
    for (; k < 20 && (last == nullptr || last->status != TrackingStatus::kTracking); ++k) {
      const std::clock_t begin = std::clock();
      last = player_->Show(frame + k);
      const double cpu_ms = 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
      EXPECT_LT(cpu_ms, 300.0) << by_ns;  // a relocalisation; before, 1400 and more
      ASSERT_TRUE(last->world_from_camera.translation.allFinite());
    }
    EXPECT_GT(k, 3) << "not tracked before three frames confirm it";
    ASSERT_EQ(last->status, TrackingStatus::kTracking) << by_ns;
    EXPECT_EQ(last->map_generation, 0) << "the same map";
    const Rigid3& then = poses_[frame + k - 1];
    EXPECT_LT((last->world_from_camera.translation - then.translation).norm(), 0.04);
    frame -= 55;
  }
}

TEST_P(Recovery, AGapBeforeThereIsAMapStartsAnother) {
  player_->tracker().Reset();
  const Snapshot before = player_->Show(100);
  player_->SetClock(3'600'000'000'000);
  Snapshot last = player_->Show(101);
  EXPECT_EQ(last->map_generation, before->map_generation + 1);
  for (std::size_t k = 102; k < 140; ++k) last = player_->Show(k);
  EXPECT_EQ(last->status, TrackingStatus::kTracking);
}

TEST_P(Recovery, ShortCoverIsCoastedThrough) {
  Snapshot last;
  for (int k = 0; k < 4; ++k) last = player_->ShowBlack();
  EXPECT_EQ(last->status, TrackingStatus::kCoasting);
  for (std::size_t k = 0; k < 6; ++k) last = player_->Show(300 + k);
  EXPECT_EQ(last->status, TrackingStatus::kTracking);
}

TEST_P(Recovery, ForeignPicturesAreNeverTakenForTheMap) {
  cv::RNG random(5);
  Snapshot last;
  for (int k = 0; k < 60; ++k) {
    last = player_->ShowNoise(random);
    EXPECT_NE(last->status, TrackingStatus::kRelocalising);
    if (k > 20) {
      EXPECT_EQ(last->status, TrackingStatus::kLost);
    }
  }
}

TEST_P(Recovery, ResetStartsANewMap) {
  const Snapshot before = player_->Show(300);
  player_->tracker().Reset();
  const Snapshot after = player_->Show(301);
  EXPECT_EQ(after->map_generation, before->map_generation + 1);
  EXPECT_GT(after->map_revision, before->map_revision);
  EXPECT_LT(after->world_from_camera.translation.norm(), 1e-9);
  Snapshot last;
  for (std::size_t k = 302; k < 325; ++k) last = player_->Show(k);
  EXPECT_EQ(last->status, TrackingStatus::kTracking);
}

TEST_P(Recovery, AnotherRunComesBackToTheStoredMap) {
  const auto stored = player_->tracker().Store();
  ASSERT_NE(stored, nullptr);
  const std::string bytes = EncodeMap(*stored);
  absl::StatusOr<StoredMap> read = DecodeMap(bytes);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(EncodeMap(*read).size(), bytes.size());
  EXPECT_LT(bytes.size(), 20'000'000U);

  TrackerOptions options;
  options.seed = 2;
  player_->BeginAnotherRun(options);
  ASSERT_TRUE(player_->tracker().Resume(std::make_shared<const StoredMap>(*read)).ok());
  cv::RNG random(7);
  Snapshot last;
  for (int k = 0; k < 20; ++k) last = player_->ShowNoise(random);
  EXPECT_EQ(last->status, TrackingStatus::kLost);
  EXPECT_NE(last->advice.find("mapped before"), std::string::npos) << last->advice;
  const std::uint64_t generation = last->map_generation;
  int waited = 0;
  for (std::size_t k = 150; k < 300; ++k) {
    last = player_->Show(k);
    const bool tracked = last->status == TrackingStatus::kTracking;
    waited += tracked ? 0 : 1;
    if (!tracked) continue;
    EXPECT_LT((last->world_from_camera.translation - poses_[k].translation).norm(), 0.05) << k;
    EXPECT_LT(RotationAngle(last->world_from_camera, poses_[k]), 0.03) << k;
  }
  EXPECT_EQ(last->status, TrackingStatus::kTracking);
  EXPECT_EQ(last->map_generation, generation) << "the stored map, not another";
  EXPECT_LT(waited, 60);  // 2 s
  EXPECT_NE(player_->tracker().Store(), nullptr) << "and it can be stored again";
}

TEST_P(Recovery, AnotherPlaceIsNotWaitedForLongerThanSaid) {
  const auto stored = player_->tracker().Store();
  ASSERT_NE(stored, nullptr);
  TrackerOptions options;
  options.resume_patience_s = 0.5;
  player_->BeginAnotherRun(options);
  ASSERT_TRUE(player_->tracker().Resume(stored).ok());
  cv::RNG random(7);
  const std::uint64_t generation = player_->ShowNoise(random)->map_generation;
  Snapshot last;
  for (int k = 0; k < 20; ++k) last = player_->ShowNoise(random);
  EXPECT_GT(last->map_generation, generation);
  for (std::size_t k = 100; k < 140; ++k) last = player_->Show(k);
  EXPECT_EQ(last->status, TrackingStatus::kTracking);
}

TEST_P(Recovery, ADamagedMapIsRefused) {
  const auto stored = player_->tracker().Store();
  ASSERT_NE(stored, nullptr);
  const std::string bytes = EncodeMap(*stored);
  std::mt19937_64 random(3);
  for (int k = 0; k < 60; ++k) {
    EXPECT_FALSE(DecodeMap(absl::string_view(bytes).substr(0, random() % bytes.size())).ok());
    std::string damaged = bytes;
    for (int n = 0; n < 20; ++n) damaged[random() % 4000] = static_cast<char>(random());
    DecodeMap(damaged).IgnoreError();  // must not crash; what it lets through is checked
  }
  EXPECT_FALSE(DecodeMap(bytes + "x").ok());
  StoredMap other = *stored;
  other.lens.fx *= 1.1;
  EXPECT_EQ(player_->tracker().Resume(std::make_shared<const StoredMap>(other)).code(),
            absl::StatusCode::kFailedPrecondition);
}

INSTANTIATE_TEST_SUITE_P(Recordings, Recovery,
                         ::testing::Values(Place{"TumFr1Xyz", OpenRecorded},
                                           Place{"Simulated", OpenSimulated}),
                         [](const auto& place) { return std::string(place.param.name); });

}  // namespace
}  // namespace saccade::recovery_test
