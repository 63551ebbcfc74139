#include "server/anchors/frame_ring.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <ctime>
#include <opencv2/imgproc.hpp>

namespace saccade::frame_ring_test {
namespace {

constexpr int kSize = 100;

/// 100x100 pixels of noise in colour, which nothing packs well.
std::shared_ptr<Frame> NoisyFrame(FrameId id, Timestamp time_ns) {
  auto frame = std::make_shared<Frame>();
  frame->id = id;
  frame->capture_time_ns = time_ns;
  frame->color = cv::Mat(kSize, kSize, CV_8UC3);
  cv::RNG random(id + 1);
  random.fill(frame->color, cv::RNG::UNIFORM, 0, 256);
  cv::cvtColor(frame->color, frame->grey, cv::COLOR_BGR2GRAY);
  return frame;
}

/// A frame a second.
void PushFrames(FrameId first, FrameId end, FrameRing& ring) {
  for (FrameId id = first; id < end; ++id) {
    ring.Push({NoisyFrame(id, static_cast<Timestamp>(id) * 1'000'000'000),
               std::make_shared<MapSnapshot>()});
  }
  ring.WaitUntilPacked();
}

TEST(FrameRing, HoldsWhatWasFetchedUntilTheSourceStartsAgain) {
  FrameRing::Options options;
  options.max_held = 2;
  FrameRing ring(options);
  PushFrames(0, 6, ring);
  for (const FrameId id : {1u, 2u, 3u, 2u}) ring.Hold(*ring.Find(id));
  PushFrames(6, 40, ring);
  EXPECT_FALSE(ring.Find(1).ok());
  EXPECT_FALSE(ring.Find(4).ok());
  ASSERT_TRUE(ring.Find(2).ok());
  EXPECT_EQ(ring.Find(2)->frame->id, 2u);
  EXPECT_FALSE(ring.Find(2)->frame->color.empty());
  ASSERT_TRUE(ring.Find(3).ok());
  PushFrames(0, 1, ring);
  EXPECT_FALSE(ring.Find(2).ok());
}

TEST(FrameRing, KeepsTenSecondsAndDropsColourFirst) {
  FrameRing::Options options;
  options.max_bytes = kSize * kSize * 4 * 4;
  FrameRing ring(options);
  PushFrames(0, 8, ring);  // the newest four are as they came
  ASSERT_TRUE(ring.Find(7).ok());
  EXPECT_FALSE(ring.Find(7)->frame->color.empty());
  ASSERT_TRUE(ring.Find(5).ok());
  EXPECT_TRUE(ring.Find(5)->frame->color.empty());
  EXPECT_FALSE(ring.Find(5)->frame->grey.empty());
  auto restarted = std::make_shared<Frame>();
  restarted->grey = cv::Mat(100, 100, CV_8UC1);
  ring.Push({restarted, std::make_shared<MapSnapshot>()});
  EXPECT_FALSE(ring.Find(7).ok());
  EXPECT_EQ(ring.Newest()->frame->id, 0u);
}

/// What a picture of the world looks like: shapes, shading, sensor noise of 1.5 grey levels.
std::shared_ptr<Frame> PictureLike(FrameId id, const cv::Size& size) {
  auto frame = std::make_shared<Frame>();
  frame->id = id;
  frame->capture_time_ns = static_cast<Timestamp>(id) * 33'333'333;
  cv::RNG random(7);
  cv::Mat color(size, CV_8UC3, cv::Scalar(90, 120, 150));
  for (int i = 0; i < 60; ++i) {
    cv::circle(color, {random.uniform(0, size.width), random.uniform(0, size.height)},
               random.uniform(5, 90),
               cv::Scalar(random.uniform(0, 255), random.uniform(0, 255), random.uniform(0, 255)),
               cv::FILLED, cv::LINE_AA);
  }
  cv::GaussianBlur(color, color, {0, 0}, 1.0);
  cv::Mat noise(size, CV_16SC3), wide;
  cv::RNG(id + 1).fill(noise, cv::RNG::NORMAL, 0, 1.5);
  color.convertTo(wide, CV_16SC3);
  wide += noise;
  wide.convertTo(frame->color, CV_8UC3);
  cv::cvtColor(frame->color, frame->grey, cv::COLOR_BGR2GRAY);
  return frame;
}

/// `awake` features that the filter has and `resting` that the map remembers, as seen from where
/// frame `id` was taken.
std::shared_ptr<MapSnapshot> SnapshotOf(FrameId id, int awake, int resting) {
  auto snapshot = std::make_shared<MapSnapshot>();
  snapshot->frame_id = id;
  snapshot->advice = "look left";
  snapshot->world_from_camera = {ExpQuaternion({0, 0.01 * static_cast<double>(id), 0.2}),
                                 {0.1, 0.02 * static_cast<double>(id), 0}};
  const Eigen::Matrix3d turn = snapshot->world_from_camera.Inverse().RotationMatrix();
  for (int k = 0; k < awake + resting; ++k) {
    FeatureSnapshot& feature = snapshot->features.emplace_back();
    feature.id = static_cast<FeatureId>(k < awake ? 7 * k + 1 : 7 * (k - awake) + 3);
    feature.point_in_world = {0.1 * k, 0.3, 2.0 / (k + 1)};
    feature.covariance_in_world = Eigen::Vector3d(1e-4, 2e-4 * (k + 1), 3e-4).asDiagonal();
    feature.matched_count = static_cast<std::uint32_t>(k);
    feature.depth_known = true;
    if (k < awake) {
      feature.covariance_in_camera = 1.1 * feature.covariance_in_world;
      feature.pixel = Eigen::Vector2d(k, static_cast<double>(id));
      feature.state = FeatureState::kMeasured;
    } else {
      feature.covariance_in_camera = turn * feature.covariance_in_world * turn.transpose();
    }
  }
  return snapshot;
}

void ExpectSame(const MapSnapshot& a, const MapSnapshot& b) {
  EXPECT_EQ(a.frame_id, b.frame_id);
  EXPECT_EQ(a.advice, b.advice);
  EXPECT_EQ(a.world_from_camera.translation, b.world_from_camera.translation);
  ASSERT_EQ(a.features.size(), b.features.size());
  for (std::size_t k = 0; k < a.features.size(); ++k) {
    const FeatureSnapshot &x = a.features[k], &y = b.features[k];
    EXPECT_EQ(x.id, y.id);
    EXPECT_EQ(x.state, y.state);
    EXPECT_EQ(x.point_in_world, y.point_in_world);
    EXPECT_EQ(x.covariance_in_world, y.covariance_in_world);
    EXPECT_TRUE(x.covariance_in_camera.isApprox(y.covariance_in_camera, 1e-9));
    EXPECT_EQ(x.pixel, y.pixel);
    EXPECT_EQ(x.matched_count, y.matched_count);
    EXPECT_EQ(x.depth_known, y.depth_known);
  }
}

TEST(FrameRing, OldFramesHaveTheirGreyPictureAndSnapshotBitByBitAndColourAsVideoHasIt) {
  FrameRing ring;
  for (FrameId id = 0; id < 20; ++id)
    ring.Push({PictureLike(id, {641, 479}), SnapshotOf(id, 150, 900)});
  ring.WaitUntilPacked();
  for (const FrameId id : {0u, 7u, 19u}) {
    const auto past = ring.Find(id);
    ASSERT_TRUE(past.ok()) << past.status();
    const auto truth = PictureLike(id, {641, 479});
    EXPECT_EQ(past->frame->id, id);
    EXPECT_EQ(past->frame->capture_time_ns, truth->capture_time_ns);
    EXPECT_EQ(cv::norm(past->frame->grey, truth->grey, cv::NORM_INF), 0);
    ASSERT_EQ(past->frame->color.size(), truth->color.size());
    EXPECT_GT(cv::PSNR(past->frame->color, truth->color), 33.0) << "edges of strong colours";
    ExpectSame(*past->snapshot, *SnapshotOf(id, 150, 900));
    EXPECT_TRUE(id == 19 || ring.Find(id, FrameRing::Want::kGrey)->frame->color.empty());
  }
}

TEST(FrameRing, TenSecondsOfFramesAndALargeMapTakeAQuarterOfWhatTheyTook) {
  FrameRing ring;
  const auto cpu_ms = [] { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; };
  std::vector<std::shared_ptr<Frame>> pictures;
  for (FrameId id = 0; id < 10; ++id) pictures.push_back(PictureLike(id, {640, 480}));
  const double before_ms = cpu_ms();
  for (FrameId id = 0; id < 300; ++id) {
    auto frame = std::make_shared<Frame>(*pictures[id % 10]);
    frame->id = id;
    frame->capture_time_ns = static_cast<Timestamp>(id) * 33'333'333;
    ring.Push({frame, SnapshotOf(id, 160, 1000)});
    ring.WaitUntilPacked();
  }
  const double packed_ms = cpu_ms() - before_ms;
  const double begin_ms = cpu_ms();
  for (FrameId id = 0; id < 100; ++id) ASSERT_TRUE(ring.Find(id, FrameRing::Want::kGrey).ok());
  const double grey_ms = (cpu_ms() - begin_ms) / 100;
  std::printf("300 frames: %.1f MB, %.2f ms to make and pack each, %.2f ms to find one in grey\n",
              1e-6 * static_cast<double>(ring.bytes()), packed_ms / 300, grey_ms);
  EXPECT_TRUE(ring.Find(0).ok()) << "10 s are kept";
  EXPECT_FALSE(ring.Find(0)->frame->color.empty());
  EXPECT_LT(ring.bytes(), 100'000'000u);  // 450 MB as they came, of which 300 were kept
}

TEST(FrameRing, AnswersDoNotDependOnHowFarThePackerIs) {
  FrameRing ring;
  for (FrameId id = 0; id < 12; ++id) ring.Push({PictureLike(id, {64, 48}), SnapshotOf(id, 5, 5)});
  std::vector<PastFrame> early;
  for (FrameId id = 0; id < 12; ++id) early.push_back(*ring.Find(id));
  ring.WaitUntilPacked();
  for (FrameId id = 0; id < 12; ++id) {
    const auto late = ring.Find(id);
    EXPECT_EQ(cv::norm(late->frame->color, early[id].frame->color, cv::NORM_INF), 0) << id;
    for (std::size_t k = 0; k < 10; ++k) {
      EXPECT_EQ(late->snapshot->features[k].covariance_in_camera,
                early[id].snapshot->features[k].covariance_in_camera);
    }
  }
}

TEST(FrameRing, AClockSetBackLeavesNothingOfTheTimeBefore) {
  FrameRing ring;
  constexpr Timestamp kHour_ns = 3'600'000'000'000;
  for (FrameId id = 0; id < 5; ++id) {
    ring.Push(
        {NoisyFrame(id, kHour_ns + static_cast<Timestamp>(id)), std::make_shared<MapSnapshot>()});
  }
  ring.Push({NoisyFrame(5, 0), std::make_shared<MapSnapshot>()});
  EXPECT_FALSE(ring.Find(4).ok());
  EXPECT_TRUE(ring.Find(5).ok());
}

}  // namespace
}  // namespace saccade::frame_ring_test
