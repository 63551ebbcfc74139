// Trackers in a hall with squares on its walls: Koller's alone (T23), and fused.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "server/eval/landmarks/squares_source.hpp"
#include "server/eval/run_recorder.hpp"
#include "server/eval/score.hpp"
#include "server/tracker/landmark_tracker.hpp"
#include "server/tracker/make_tracker.hpp"
#include "shared/models/shapes.hpp"

namespace saccade::landmarks_test {
namespace {

class HallOfSquares : public ::testing::Test {
 protected:
  void SetUp() override {
    HallOptions options;
    options.width = 640;
    options.height = 480;
    options.fps = 12.5;
    options.duration_s = 13.0;
    auto made = SquaresSource::Create(options);
    ASSERT_TRUE(made.ok()) << made.status();
    source_ = *std::move(made);
    file_ = std::filesystem::path(::testing::TempDir()) /
            ("landmarks_of_hall-" + std::to_string(::getpid()) + ".toml");
    std::ofstream(file_) << source_->squares().ToToml();
  }

  LandmarkOptions Koller() const {
    LandmarkOptions options;
    options.mode = "koller";
    options.file = file_;
    return options;
  }

  std::unique_ptr<SquaresSource> source_;
  std::filesystem::path file_;
};

TEST_F(HallOfSquares, KollersTrackerHoldsWithHalfOfThemCoveredAndComesBackT23) {
  auto tracker = LandmarkTracker::Create(source_->info(), Koller());
  ASSERT_TRUE(tracker.ok()) << tracker.status();
  int half = 0, half_tracked = 0, half_lost = 0, covered = 0, attempted = 0, tracked = 0, wrong = 0;
  std::optional<double> back_s;
  while (true) {
    const auto frame = source_->Next();
    ASSERT_TRUE(frame.ok());
    if (!*frame) break;
    const auto snapshot = (*tracker)->Track(**frame);
    const double t = Seconds((*frame)->capture_time_ns);
    const bool good = VerdictOf(*snapshot) == FrameVerdict::kTracked;
    const double error_m = (snapshot->world_from_camera.translation -
                            source_->WorldFromCamera((*frame)->id).translation)
                               .norm();
    tracked += good ? 1 : 0;
    wrong += good && error_m > 0.03 ? 1 : 0;
    if (SquaresSource::kHalf.Holds(t)) {
      ++half;
      half_tracked += good ? 1 : 0;
      half_lost += snapshot->status == TrackingStatus::kLost ? 1 : 0;
    }
    if (SquaresSource::kAll.Holds(t) && t > SquaresSource::kAll.from_s + 0.1) {
      EXPECT_FALSE(good);
    }
    if (t >= SquaresSource::kAll.until_s && good && !back_s) {
      back_s = t - SquaresSource::kAll.until_s;
    }
    for (const FeatureSnapshot& feature : snapshot->features) {
      if (!source_->Covered((*frame)->id, (feature.id - 1) / 4)) continue;
      ++covered;
      attempted += feature.state != FeatureState::kNotAttempted ? 1 : 0;
    }
  }
  EXPECT_GT(tracked, 120);
  EXPECT_EQ(wrong, 0);
  // At half the rate and less of a picture than PAL (docs/measurements) a square may be too small.
  EXPECT_EQ(half_lost, 0);
  EXPECT_GT(half_tracked, 0.8 * half);
  ASSERT_TRUE(back_s);
  EXPECT_LT(*back_s, 0.5);
  EXPECT_GT(covered, 400);
  EXPECT_LT(attempted, covered / 50);  // a hidden square counts no failed attempt
}

TEST_F(HallOfSquares, KollersTrackerRefusesWhatItCannotUse) {
  LandmarkOptions options = Koller();
  options.file.clear();
  EXPECT_EQ(LandmarkTracker::Create(source_->info(), options).status().code(),
            absl::StatusCode::kInvalidArgument);
  options.file = "/nowhere/landmarks.toml";
  EXPECT_EQ(LandmarkTracker::Create(source_->info(), options).status().code(),
            absl::StatusCode::kNotFound);
  SquareMap one{{source_->squares().squares.front()}};
  std::ofstream(file_) << one.ToToml();
  EXPECT_EQ(LandmarkTracker::Create(source_->info(), Koller()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

/// What became of the corners behind the thing in the hall, over some seconds.
struct Behind {
  int hidden = 0, failed = 0, measured = 0;  // corner-frames
  int squares = 0, attempted = 0;            // square-frames, wholly hidden
  int frames = 0, tracked = 0;
  double worst_m = 0.0;
};

/// `mode` koller or fused; `told`: the tracker knows the thing's shape.
Behind FollowBehind(HallMotion motion, const std::string& mode, bool told, double duration_s) {
  HallOptions options;
  options.motion = motion;
  options.width = 640;
  options.height = 480;
  options.fps = 12.5;
  options.duration_s = duration_s;
  auto source = SquaresSource::Create(options);
  EXPECT_TRUE(source.ok());
  LandmarkOptions landmarks;
  landmarks.mode = mode;
  landmarks.file = std::filesystem::path(::testing::TempDir()) /
                   ("landmarks_behind_" + std::to_string(getpid()) + ".toml");
  std::ofstream(landmarks.file) << (*source)->squares().ToToml();
  auto tracker = MakeFrameTracker((*source)->info(), TrackerOptions(), landmarks);
  EXPECT_TRUE(tracker.ok()) << tracker.status();
  if (told) {
    const Eigen::AlignedBox3d box = (*source)->ThingAt(0);
    TriangleMesh mesh;
    Append(BoxMesh(box.sizes(), 0xffffffff),
           {Eigen::Quaterniond::Identity(), {box.center().x(), box.max().y(), box.center().z()}},
           1.0, mesh);
    (*tracker)->SetSight(std::make_shared<const Sight>(std::vector<TriangleMesh>{mesh}));
  }
  Behind behind;
  while (tracker.ok()) {
    const auto frame = (*source)->Next();
    if (!frame.ok() || !*frame) break;
    const FrameId id = (*frame)->id;
    const auto snapshot = (*tracker)->Track(**frame);
    ++behind.frames;
    if (VerdictOf(*snapshot) == FrameVerdict::kTracked) {
      ++behind.tracked;
      behind.worst_m = std::max(behind.worst_m, (snapshot->world_from_camera.translation -
                                                 (*source)->WorldFromCamera(id).translation)
                                                    .norm());
    }
    std::vector<FeatureState> corners;
    for (const FeatureSnapshot& feature : snapshot->features) corners.push_back(feature.state);
    if (const auto* fused = dynamic_cast<const Tracker*>(tracker->get())) {
      corners = fused->squares()->StatesOfKnown();
    }
    for (std::size_t k = 0; k < (*source)->squares().squares.size(); ++k) {
      int tried = 0;
      for (int c = 0; c < 4; ++c) {
        const FeatureState state = corners[4 * k + c];
        tried += state != FeatureState::kNotAttempted ? 1 : 0;
        if (!(*source)->Hidden(id, k, c)) continue;
        ++behind.hidden;
        behind.failed += state == FeatureState::kFailed ? 1 : 0;
        behind.measured += state == FeatureState::kMeasured ? 1 : 0;
      }
      if (!(*source)->Covered(id, k)) continue;
      ++behind.squares;
      behind.attempted += tried > 0 ? 1 : 0;
    }
  }
  std::cout << "hidden corners " << behind.hidden << ", failed " << behind.failed << ", measured "
            << behind.measured << "; hidden squares " << behind.squares << ", attempted "
            << behind.attempted << "; tracked " << behind.tracked << " of " << behind.frames
            << ", worst " << 1e3 * behind.worst_m << " mm\n";
  return behind;
}

TEST(KnownGeometry, ASquareBehindAPillarCountsNoAttemptInEitherTracker) {
  for (const char* mode : {"koller", "fused"}) {
    SCOPED_TRACE(mode);
    const Behind behind = FollowBehind(HallMotion::kPillar, mode, /*told=*/true, 3.0);
    EXPECT_GT(behind.squares, 20);
    EXPECT_EQ(behind.attempted, 0);
    EXPECT_LE(behind.failed + behind.measured, behind.hidden / 50);  // at its edge, by a pixel
    EXPECT_GT(behind.tracked, 0.5 * behind.frames);
    EXPECT_LT(behind.worst_m, 0.05);
  }
}

TEST(MovingThings, WhatAPasserByHidesIsNotMeasuredThoughNobodyToldOfHim) {
  for (const char* mode : {"koller", "fused"}) {
    SCOPED_TRACE(mode);
    const Behind behind = FollowBehind(HallMotion::kPasser, mode, /*told=*/false, 5.0);
    EXPECT_GT(behind.squares, 20);
    // A corner just behind his edge is where its sides meet, which are seen for the most part.
    EXPECT_LE(behind.measured, behind.hidden / 5);
    EXPECT_LE(behind.failed, behind.hidden / 10);
    EXPECT_GT(behind.tracked, 0.5 * behind.frames);
    EXPECT_LT(behind.worst_m, 0.07);
  }
}

/// A fused tracker in the textured hall; what it published as tracked, beside the truth.
std::vector<PosePair> FollowFused(const LandmarkOptions& landmarks, double duration_s,
                                  std::size_t& mapped) {
  HallOptions options;
  options.motion = HallMotion::kAway;
  options.width = 480;
  options.height = 360;
  options.fps = 15;
  options.duration_s = duration_s;
  auto source = SquaresSource::Create(options);
  EXPECT_TRUE(source.ok());
  LandmarkOptions with = landmarks;
  if (with.family.empty()) {
    with.file = std::filesystem::path(::testing::TempDir()) / "landmarks_of_away.toml";
    std::ofstream(with.file) << (*source)->squares().ToToml();
  }
  auto tracker = MakeTracker((*source)->info(), TrackerOptions(), with);
  EXPECT_TRUE(tracker.ok()) << tracker.status();
  std::vector<PosePair> pairs;
  while (tracker.ok()) {
    const auto frame = (*source)->Next();
    if (!frame.ok() || !*frame) break;
    const auto snapshot = (*tracker)->Track(**frame);
    if (VerdictOf(*snapshot) != FrameVerdict::kTracked) continue;
    EXPECT_TRUE(snapshot->metric) << "frame " << (*frame)->id;
    pairs.push_back({(*frame)->capture_time_ns, snapshot->world_from_camera,
                     (*source)->WorldFromCamera((*frame)->id)});
  }
  if (tracker.ok()) mapped = (*tracker)->squares()->mapped();
  return pairs;
}

TEST(FusedTracker, KnowsTheBuildingsMetresFromTheFirstPicturesOn) {
  std::size_t mapped = 0;
  const std::vector<PosePair> pairs = FollowFused(LandmarkOptions(), 5.0, mapped);
  ASSERT_GT(pairs.size(), 60u);
  EXPECT_LT(Seconds(pairs.front().time_ns), 0.3);
  for (const PosePair& pair : pairs) {
    EXPECT_LT((pair.estimate.translation - pair.truth.translation).norm(), 0.02);
  }
}

TEST(FusedTracker, MapsSquaresOfUnknownPlaceAndIsMetricByTheirSide) {
  LandmarkOptions landmarks;
  landmarks.family = "apriltag36h11";
  landmarks.size_m = 0.16;
  std::size_t mapped = 0;
  const std::vector<PosePair> pairs = FollowFused(landmarks, 5.0, mapped);
  ASSERT_GT(pairs.size(), 30u);
  EXPECT_GE(mapped, 4u);
  const auto score = Score(pairs, TrajectoryAlignment::kSe3);
  ASSERT_TRUE(score.ok());
  EXPECT_LT(score->ate_se3_m, 0.02);
}

}  // namespace
}  // namespace saccade::landmarks_test
