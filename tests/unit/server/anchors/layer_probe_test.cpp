// Outlines: what is in front and what is behind, in pictures drawn from two flat surfaces.
#include "server/anchors/layer_probe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>

#include "server/anchors/anchor_manager.hpp"
#include "server/anchors/depth_probe.hpp"

namespace saccade::layer_probe_test {
namespace {

using ::testing::HasSubstr;

constexpr double kFront_m = 1.0, kBack_m = 1.25;
constexpr double kPixel_x = 320;  // of the outline, in the first picture

std::shared_ptr<const CameraModel> Camera() {
  CameraIntrinsics c;
  c.width = 640;
  c.height = 480;
  c.fx = c.fy = 500;
  c.cx = 320;
  c.cy = 240;
  return std::make_shared<const CameraModel>(c);
}

/// Depth [m] and texture of a ray of the scene.
struct Scene {
  std::function<double(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray)> depth;
  bool bare_back = false;
};

/// In front of a wall: a board that ends at x = 0.
double BoardBeforeWall(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) {
  const double x = eye.x() + kFront_m * ray.x() / ray.z();
  return x < 0 ? kFront_m : kBack_m;
}
double Wall(const Eigen::Vector3d&, const Eigen::Vector3d&) { return kFront_m; }
/// Seen at 60 deg.
double Slope(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) {
  const double t = std::tan(M_PI / 3);
  return (kFront_m + t * eye.x()) / (1 - t * ray.x() / ray.z());
}

/// Frames of a camera that moves sideways by a centimetre each third frame.
class Pictures {
 public:
  explicit Pictures(const Scene& scene) : scene_(scene), texture_(512, 512, CV_8UC1) {
    cv::RNG rng(7);
    rng.fill(texture_, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture_, texture_, {}, 1.2);
    cv::normalize(texture_, texture_, 20, 235, cv::NORM_MINMAX);
  }

  void Take(int frames) {
    for (int k = 0; k < frames; ++k) {
      auto frame = std::make_shared<Frame>();
      frame->id = next_;
      frame->capture_time_ns = static_cast<Timestamp>(next_) * 33'333'333;
      frame->camera = camera_;
      const Eigen::Vector3d eye(0.01 * static_cast<double>(next_) / 3, 0, 0);
      frame->grey = Draw(eye);
      auto snapshot = std::make_shared<MapSnapshot>();
      snapshot->frame_id = next_++;
      snapshot->capture_time_ns = frame->capture_time_ns;
      snapshot->status = TrackingStatus::kTracking;
      snapshot->metric = true;
      snapshot->map_generation = 1;
      snapshot->world_from_camera.translation = eye;
      AddFeatures(eye, *snapshot);
      ring_.Push({frame, snapshot});
      newest_ = snapshot;
    }
  }
  absl::StatusOr<PastFrame> Find(FrameId id) const { return ring_.Find(id); }
  FrameLookup lookup() const {
    return [this](FrameId id) { return ring_.Find(id); };
  }
  std::optional<DepthLayers> Probe(const Eigen::Vector2d& pixel, double guess_m) const {
    return ProbeLayers(*ring_.Find(0), pixel, guess_m, next_ - 1, lookup());
  }
  const std::shared_ptr<const MapSnapshot>& newest() const { return newest_; }
  const CameraModel& camera() const { return *camera_; }

 private:
  cv::Mat Draw(const Eigen::Vector3d& eye) const {
    cv::Mat grey(480, 640, CV_8UC1, cv::Scalar(128));
    for (int v = 140; v < 340; ++v) {
      for (int u = 120; u < 520; ++u) {
        const Eigen::Vector3d ray((u - 320) / 500.0, (v - 240) / 500.0, 1.0);
        const double z = scene_.depth(eye, ray);
        const Eigen::Vector3d point = eye + z * ray;
        if (scene_.bare_back && z > kFront_m) continue;
        const float x = static_cast<float>(point.x() * 400 + 256 + (z > kFront_m ? 77 : 0));
        const float y = static_cast<float>(point.y() * 400 + 256);
        cv::Mat one;
        cv::getRectSubPix(texture_, {1, 1}, {x, y}, one);
        grey.at<std::uint8_t>(v, u) = one.at<std::uint8_t>(0, 0);
      }
    }
    return grey;
  }
  /// What a map would have: a few well known points on the board and none on the wall behind it.
  void AddFeatures(const Eigen::Vector3d& eye, MapSnapshot& snapshot) const {
    for (int k = 0; k < 12; ++k) {
      FeatureSnapshot feature;
      feature.id = 100 + k;
      feature.state = FeatureState::kMeasured;
      feature.point_in_world = {-0.03 - 0.03 * (k % 4), -0.06 + 0.06 * (k / 4), kFront_m};
      feature.covariance_in_world = 1e-6 * Eigen::Matrix3d::Identity();
      feature.covariance_in_camera = feature.covariance_in_world;
      feature.depth_known = true;
      feature.matched_count = 50;
      feature.pixel = camera_->Project(feature.point_in_world - eye);
      snapshot.features.push_back(feature);
    }
  }

  Scene scene_;
  cv::Mat texture_;
  std::shared_ptr<const CameraModel> camera_ = Camera();
  FrameRing ring_;
  FrameId next_ = 0;
  std::shared_ptr<const MapSnapshot> newest_;
};

TEST(Layers, AnOutlineShowsWhatIsInFrontAndWhatIsBehind) {
  Pictures pictures({BoardBeforeWall});
  pictures.Take(30);
  for (const double beside : {-3.0, 0.0, 3.0}) {
    const auto layers = pictures.Probe({kPixel_x + beside, 240}, 1.1);
    ASSERT_TRUE(layers) << beside;
    ASSERT_TRUE(layers->on_outline()) << beside;
    EXPECT_NEAR(layers->nearer_m(), kFront_m, 0.04) << beside;
    EXPECT_NEAR(std::max(layers->range_m, layers->other_range_m), kBack_m, 0.04) << beside;
  }
}

TEST(Layers, AFlatSurfaceIsOneWhateverItsSlope) {
  for (const auto& depth : {Wall, Slope}) {
    Pictures pictures({depth});
    pictures.Take(30);
    const auto layers = pictures.Probe({330, 240}, 1.15);
    ASSERT_TRUE(layers);
    EXPECT_FALSE(layers->on_outline());
    EXPECT_GT(layers->reach_px, 4.5);
    const Eigen::Vector3d ray(10 / 500.0, 0, 1);
    EXPECT_NEAR(layers->range_m, depth({0, 0, 0}, ray) * ray.norm(), 0.02);
  }
}

TEST(Layers, WhereOneSideIsBareNobodyKnowsAllRound) {
  Pictures pictures({BoardBeforeWall, /*bare_back=*/true});
  pictures.Take(30);
  const auto layers = pictures.Probe({kPixel_x + 2, 240}, 1.1);
  EXPECT_FALSE(layers && layers->reach_px > 4.5 && !layers->on_outline());
}

TEST(Layers, NothingIsSaidBeforeTheCameraMoved) {
  Pictures pictures({BoardBeforeWall});
  pictures.Take(2);
  EXPECT_FALSE(pictures.Probe({kPixel_x, 240}, 1.1));
}

/// A click on `pixel` of the first frame, made after `before` frames; then `after` more.
Anchor Click(const Scene& scene, const Eigen::Vector2d& pixel, int before, int after) {
  Pictures pictures(scene);
  AnchorManager manager(AnchorOptions(), pictures.lookup(), nullptr);
  for (int k = 0; k < before; ++k) {
    pictures.Take(1);
    manager.Resolve(pictures.newest(), pictures.camera());
  }
  AnnotationDraft draft;
  draft.target = PixelTarget{0, pixel};
  EXPECT_TRUE(manager.Create(draft, "expert").ok());
  for (int k = 0; k < after; ++k) {
    pictures.Take(1);
    manager.Resolve(pictures.newest(), pictures.camera());
  }
  return manager.Latest()->front().anchor;
}

TEST(Layers, AMarkOnAnOutlineSaysSo) {
  const Anchor anchor = Click({BoardBeforeWall}, {kPixel_x + 1, 240}, 30, 1);
  EXPECT_GT(anchor.error_m, 0.05) << "what is behind is 25 cm farther";
  EXPECT_EQ(anchor.state, AnchorState::kPaused);
  EXPECT_THAT(anchor.reason, HasSubstr("on an outline"));
}

TEST(Layers, AMarkPlacedBeforeTheCameraMovedIsLookedAtAgain) {
  const Anchor anchor = Click({BoardBeforeWall}, {kPixel_x + 1, 240}, 2, 60);
  EXPECT_EQ(anchor.state, AnchorState::kPaused);
  EXPECT_THAT(anchor.reason, HasSubstr("on an outline"));
}

TEST(Layers, WhatThePictureContradictsIsClaimedSo) {
  // The map knows points 25 cm before the wall that is clicked, and none on it.
  const auto behind = [](const Eigen::Vector3d&, const Eigen::Vector3d&) { return kBack_m; };
  const Anchor anchor = Click({behind}, {270, 240}, 2, 60);
  const double off_m =
      (anchor.point_in_world / anchor.point_in_world.z() * kBack_m - anchor.point_in_world).norm();
  EXPECT_LT(off_m, 3 * anchor.error_m);
}

TEST(Layers, ATrailOfPosesSparesTheLookups) {
  Pictures pictures({BoardBeforeWall});
  pictures.Take(90);
  PoseTrail trail;
  for (FrameId id = 0; id < 90; ++id) trail.Add(*pictures.Find(id)->snapshot);
  int asked = 0;
  const FrameLookup counting = [&](FrameId id) {
    ++asked;
    return pictures.Find(id);
  };
  const PastFrame clicked = *pictures.Find(0);
  for (const double x : {kPixel_x - 40, kPixel_x + 2}) {
    const auto slow = ProbeDepth(clicked, {x, 240}, 1.1, 89, pictures.lookup());
    const auto quick = ProbeDepth(clicked, {x, 240}, 1.1, 89, counting, &trail);
    ASSERT_EQ(slow.has_value(), quick.has_value());
    if (slow) {
      EXPECT_EQ(slow->range_m, quick->range_m);
    }
    const auto layers = ProbeLayers(clicked, {x, 240}, 1.1, 89, pictures.lookup());
    const auto same = ProbeLayers(clicked, {x, 240}, 1.1, 89, counting, &trail);
    ASSERT_EQ(layers.has_value(), same.has_value());
    if (layers) {
      EXPECT_EQ(layers->range_m, same->range_m);
    }
  }
  EXPECT_LE(asked, 2 * (12 + 6)) << "twelve pictures and six, twice; each is a millisecond";
}

TEST(Layers, AMarkOnAFlatSurfaceIsTrusted) {
  const Anchor anchor = Click({Wall}, {270, 240}, 30, 30);
  EXPECT_EQ(anchor.state, AnchorState::kTracking) << anchor.reason;
  EXPECT_NEAR(anchor.point_in_world.z(), kFront_m, 0.01);
}

}  // namespace
}  // namespace saccade::layer_probe_test
