// Squares that are carried, in pictures with real ones, by the detectors and the search themselves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <random>

#include "server/markers/marker_pattern.hpp"
#include "server/markers/square_map.hpp"
#include "server/tracker/carried_squares.hpp"
#include "server/tracker/square_landmarks.hpp"

namespace saccade::carried_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kSide_m = 0.08;
constexpr double kFrame_s = 1.0 / 30.0;
constexpr double kPaper = 0.7;  // from the middle, in sides
constexpr double kWall = 120;
constexpr int kRays = 3;  // along each side of a pixel

std::shared_ptr<const CameraModel> Camera() {
  CameraIntrinsics lens;
  lens.width = 480;
  lens.height = 360;
  lens.fx = lens.fy = 450;
  lens.cx = 239.5;
  lens.cy = 179.5;
  return std::make_shared<const CameraModel>(lens);
}

/// Faces the camera at the origin from one metre, `turn` about its own axes first.
Rigid3 Facing(const Vector3d& turn, const Vector3d& where) {
  return {ExpQuaternion(Vector3d(M_PI, 0, 0)) * ExpQuaternion(turn), where};
}

/// Frames in which one square is seen, or something before it.
class CarriedWorld {
 public:
  explicit CarriedWorld(const std::string& family, int id)
      : family_(family), pattern_(*PatternOf(family, id)) {}

  Frame Seen(int index, const Rigid3& world_from_camera, const Rigid3& world_from_marker,
             bool covered = false) {
    Frame frame;
    frame.id = static_cast<FrameId>(index);
    frame.capture_time_ns = TimeOf(index);
    frame.camera = camera_;
    frame.grey = cv::Mat(360, 480, CV_8UC1, cv::Scalar(kWall));
    const Rigid3 marker_from_camera = world_from_marker.Inverse() * world_from_camera;
    if (!covered) Draw(marker_from_camera, frame.grey);
    cv::GaussianBlur(frame.grey, frame.grey, {3, 3}, 0.6);
    cv::Mat noise(frame.grey.size(), CV_16SC1);
    cv::RNG random(static_cast<std::uint64_t>(index) + 7);
    random.fill(noise, cv::RNG::NORMAL, 0, 3);
    cv::add(frame.grey, noise, frame.grey, cv::noArray(), CV_8UC1);
    return frame;
  }
  MapSnapshot Tracked(const Frame& frame, const Rigid3& world_from_camera) const {
    MapSnapshot snapshot;
    snapshot.frame_id = frame.id;
    snapshot.capture_time_ns = frame.capture_time_ns;
    snapshot.status = TrackingStatus::kTracking;
    snapshot.metric = true;
    snapshot.world_from_camera = world_from_camera;
    return snapshot;
  }
  static Timestamp TimeOf(int index) {
    return static_cast<Timestamp>(1e9 * kFrame_s * (index + 1));
  }

 private:
  void Draw(const Rigid3& marker_from_camera, cv::Mat& grey) const {
    cv::Rect2d region;
    for (const Vector2d& corner : {Vector2d(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
      const Vector3d at(kPaper * kSide_m * corner.x(), kPaper * kSide_m * corner.y(), 0);
      const Vector2d pixel = *camera_->Project(marker_from_camera.Inverse() * at);
      const cv::Rect2d one(pixel.x() - 2, pixel.y() - 2, 4, 4);
      region = region.empty() ? one : region | one;
    }
    const cv::Rect inside = cv::Rect(region) & cv::Rect(0, 0, grey.cols, grey.rows);
    for (int v = inside.y; v < inside.br().y; ++v) {
      for (int u = inside.x; u < inside.br().x; ++u) {
        double sum = 0;
        for (int k = 0; k < kRays * kRays; ++k) {
          const double du = (k % kRays + 0.5) / kRays - 0.5, dv = (k / kRays + 0.5) / kRays - 0.5;
          sum += Shade(marker_from_camera, {u + du, v + dv});
        }
        grey.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(sum / (kRays * kRays));
      }
    }
  }
  /// In sides of the border from the middle.
  std::optional<Vector2d> OnMarker(const Rigid3& marker_from_camera, const Vector2d& pixel) const {
    const auto ray = camera_->Unproject(pixel);
    if (!ray) return std::nullopt;
    const Vector3d way = marker_from_camera.rotation * *ray;
    const Vector3d& eye = marker_from_camera.translation;
    if (!(way.z() < 0 && eye.z() > 0)) return std::nullopt;
    const Vector3d hit = eye - eye.z() / way.z() * way;
    return Vector2d(hit.x(), hit.y()) / kSide_m;
  }
  double Shade(const Rigid3& marker_from_camera, Vector2d pixel) const {
    const auto at = OnMarker(marker_from_camera, pixel);
    if (!at || at->cwiseAbs().maxCoeff() > kPaper) return kWall;
    const int column = static_cast<int>(std::floor((at->x() + 0.5) * pattern_.cells));
    const int row = static_cast<int>(std::floor((0.5 - at->y()) * pattern_.cells));
    const bool on = column >= 0 && row >= 0 && column < pattern_.cells && row < pattern_.cells;
    return !on || pattern_.At(row, column) == CellShade::kWhite ? 225 : 30;
  }

  std::string family_;
  MarkerPattern pattern_;
  std::shared_ptr<const CameraModel> camera_ = Camera();
};

std::shared_ptr<const CarriedSquareList> Wanted(const std::string& family, int id) {
  return std::make_shared<const CarriedSquareList>(CarriedSquareList{{family, id, kSide_m}});
}

/// A wearer who leans from side to side.
Rigid3 CameraAt(int index) {
  const double phase = 2 * M_PI * index * kFrame_s / 2.0;
  return {ExpQuaternion(Vector3d(0.03 * std::sin(phase), -0.1 * std::sin(phase), 0)),
          {0.12 * std::sin(phase), 0.04 * std::cos(phase), 0}};
}

/// A drawer that is pulled out by 30 cm in a second, then turned in the hand.
Rigid3 DrawerAt(int index) {
  const double out = 0.3 * std::clamp((index * kFrame_s - 0.3) / 1.0, 0.0, 1.0);
  const double turn = 0.6 * std::clamp((index * kFrame_s - 1.4) / 0.6, 0.0, 1.0);
  return Facing({0.25, 0.35 + turn, 0.1}, {0.05 + 0.3 * out, 0.1, 1.1 - out});
}

double NormalOff(const Rigid3& a, const Rigid3& b) {
  const double cosine = (a.rotation * Vector3d::UnitZ()).dot(b.rotation * Vector3d::UnitZ());
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

TEST(CarriedSquares, CornersAreThePatterns) {
  for (const char* family : {"apriltag36h11", "aruco_4x4_50"}) {
    const MarkerPattern pattern = *PatternOf(family, 3);
    const auto corners = SquareCorners(family, 1.0);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(pattern.corners[k].x(), corners[k].x() + 0.5, 1e-9);
      EXPECT_NEAR(pattern.corners[k].y(), 0.5 - corners[k].y(), 1e-9);
    }
  }
}

class Carried : public ::testing::TestWithParam<const char*> {};

TEST_P(Carried, AnOpeningDrawerIsFollowedFrameByFrame) {
  CarriedWorld world(GetParam(), 3);
  CarriedSquares carried(/*waits=*/true);
  carried.SetWanted(Wanted(GetParam(), 3));
  int told = 0, fresh = 0;
  std::vector<double> off_mm, off_px;
  for (int index = 0; index < 66; ++index) {
    const Rigid3 camera = CameraAt(index), drawer = DrawerAt(index);
    const Frame frame = world.Seen(index, camera, drawer);
    const auto poses = carried.Step(frame, frame.capture_time_ns + 5, world.Tracked(frame, camera));
    if (poses == nullptr) continue;
    ASSERT_EQ(poses->size(), 1u);
    const MarkerPose& pose = poses->front();
    EXPECT_EQ(pose.family, GetParam());
    EXPECT_EQ(pose.id, 3u);
    ++told;
    fresh += pose.seen_ns == frame.capture_time_ns + 5 ? 1 : 0;
    off_mm.push_back(1e3 * (pose.world_from_marker.translation - drawer.translation).norm());
    const auto seen = frame.camera->Project(camera.Inverse() * pose.world_from_marker.translation);
    const auto meant = frame.camera->Project(camera.Inverse() * drawer.translation);
    off_px.push_back((*seen - *meant).norm());
    EXPECT_LT(NormalOff(pose.world_from_marker, drawer), 0.26) << index;
  }
  std::ranges::sort(off_mm);
  std::ranges::sort(off_px);
  EXPECT_GE(told, 62);
  EXPECT_GE(fresh, 62);
  ASSERT_FALSE(off_mm.empty());
  const std::size_t p95 = off_mm.size() * 95 / 100;
  std::printf("%s: told %d, fresh %d, p50 %.1f mm, p95 %.1f mm, %.2f px\n", GetParam(), told, fresh,
              off_mm[off_mm.size() / 2], off_mm[p95], off_px[p95]);
  EXPECT_LT(off_mm[p95], 8.0);
  EXPECT_LT(off_px[p95], 0.5);
}

INSTANTIATE_TEST_SUITE_P(Families, Carried, ::testing::Values("apriltag36h11", "aruco_4x4_50"));

TEST(CarriedSquares, AHandBeforeItLeavesItWhereItWas) {
  CarriedWorld world("apriltag36h11", 5);
  CarriedSquares carried(/*waits=*/true);
  carried.SetWanted(Wanted("apriltag36h11", 5));
  const Rigid3 held = Facing({0.3, 0.3, 0}, {0, 0, 0.9});
  std::shared_ptr<const std::vector<MarkerPose>> before, poses;
  for (int index = 0; index < 24; ++index) {
    const bool covered = index >= 8 && index < 16;
    // It is moved behind the hand.
    const Rigid3 now = index < 12 ? held : Facing({0.3, 0.3, 0}, {0.2, -0.1, 0.9});
    const Frame frame = world.Seen(index, Rigid3(), now, covered);
    poses = carried.Step(frame, frame.capture_time_ns, world.Tracked(frame, Rigid3()));
    if (index < 4) continue;
    ASSERT_NE(poses, nullptr) << index;
    const MarkerPose& pose = poses->front();
    if (index == 7) before = poses;
    if (covered) {
      EXPECT_EQ(pose.seen_ns, before->front().seen_ns);
      EXPECT_EQ(pose.world_from_marker.translation, before->front().world_from_marker.translation);
    }
    if (index >= 19) {
      EXPECT_LT((pose.world_from_marker.translation - now.translation).norm(), 0.01) << index;
    }
  }
}

TEST(CarriedSquares, NobodyIsFollowedWithoutMetresOrUnasked) {
  CarriedWorld world("apriltag36h11", 5);
  const Rigid3 held = Facing({0.3, 0.3, 0}, {0, 0, 0.9});
  CarriedSquares carried(/*waits=*/true);
  const auto step = [&](int index, bool metric) {
    const Frame frame = world.Seen(index, Rigid3(), held);
    MapSnapshot tracked = world.Tracked(frame, Rigid3());
    tracked.metric = metric;
    return carried.Step(frame, frame.capture_time_ns, tracked);
  };
  for (int index = 0; index < 3; ++index) EXPECT_EQ(step(index, true), nullptr);
  carried.SetWanted(Wanted("apriltag36h11", 6));
  for (int index = 3; index < 6; ++index) EXPECT_EQ(step(index, true), nullptr);
  carried.SetWanted(Wanted("apriltag36h11", 5));
  for (int index = 6; index < 9; ++index) EXPECT_EQ(step(index, false), nullptr);
  for (int index = 9; index < 12; ++index) step(index, true);
  EXPECT_NE(step(12, true), nullptr);
  carried.SetWanted(std::make_shared<const CarriedSquareList>());
  EXPECT_EQ(step(13, true), nullptr);
}

TEST(CarriedSquares, OfAFlatThingSeenNearlyFromTheFrontTheRightWayRoundIsTold) {
  CarriedWorld world("apriltag36h11", 1);
  CarriedSquares carried(/*waits=*/true);
  carried.SetWanted(Wanted("apriltag36h11", 1));
  int told = 0, flipped = 0;
  for (int index = 0; index < 40; ++index) {
    const double phase = 2 * M_PI * index / 40.0;
    const Rigid3 held = Facing({0.2 * std::sin(phase), 0.2 * std::cos(phase), 0}, {0, 0, 1.1});
    const Frame frame = world.Seen(index, Rigid3(), held);
    const auto poses = carried.Step(frame, frame.capture_time_ns, world.Tracked(frame, Rigid3()));
    if (poses == nullptr) continue;
    ++told;
    flipped += NormalOff(poses->front().world_from_marker, held) > 0.26 ? 1 : 0;
  }
  std::printf("told %d, flipped %d\n", told, flipped);
  EXPECT_GT(told, 25);
  EXPECT_EQ(flipped, 0);
}

TEST(SquareLandmarks, ACarriedSquareIsNoLandmark) {
  CarriedWorld world("apriltag36h11", 5);
  LandmarkOptions options;
  options.family = "apriltag36h11";
  options.size_m = kSide_m;
  for (const bool carried : {false, true}) {
    auto squares = SquareLandmarks::Create(options);
    ASSERT_TRUE(squares.ok()) << squares.status();
    if (carried) (*squares)->SetCarried(Wanted("apriltag36h11", 5));
    for (int index = 0; index < 3; ++index) {
      (*squares)->Look(world.Seen(index, Rigid3(), Facing({0.3, 0.3, 0}, {0, 0, 0.9})), true);
    }
    EXPECT_EQ((*squares)->sees_unplaced(), !carried);
  }
}

TEST(CheckCarried, SaysWhatThereIs) {
  EXPECT_TRUE(CheckCarried({"aruco_4x4_50", 3, 0.1}).ok());
  EXPECT_THAT(CheckCarried({"koller", 3, 0.1}).message(), HasSubstr("marker.family: 'koller'"));
  EXPECT_THAT(CheckCarried({"apriltag36h11", 9999, 0.1}).message(), HasSubstr("marker.id: "));
}

}  // namespace
}  // namespace saccade::carried_test
