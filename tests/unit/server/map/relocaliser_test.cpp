#include "server/map/relocaliser.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "server/features/corner_detector.hpp"
#include "shared/geometry/so3.hpp"
#include "tests/unit/server/features/recording.hpp"

namespace saccade {
namespace {

/// Point nearest to two rays; nothing if the rays are nearly parallel or it misses their pixels.
std::optional<Eigen::Vector3d> Triangulate(const CameraModel& camera, const Rigid3& first,
                                           const Eigen::Vector2d& a, const Rigid3& second,
                                           const Eigen::Vector2d& b) {
  const auto ray_a = camera.Unproject(a), ray_b = camera.Unproject(b);
  if (!ray_a || !ray_b) return std::nullopt;
  const Eigen::Vector3d u = first.rotation * *ray_a, v = second.rotation * *ray_b;
  const double parallax = std::acos(std::clamp(u.dot(v), -1.0, 1.0));
  if (parallax < 0.02) return std::nullopt;
  Eigen::Matrix<double, 3, 2> m;
  m << u, -v;
  const Eigen::Vector2d s = m.colPivHouseholderQr().solve(second.translation - first.translation);
  if (s[0] < 0.2 || s[1] < 0.2) return std::nullopt;
  const Eigen::Vector3d point =
      0.5 * (first.translation + s[0] * u + second.translation + s[1] * v);
  const auto at_a = camera.Project(first.Inverse() * point);
  const auto at_b = camera.Project(second.Inverse() * point);
  if (!at_a || !at_b || (*at_a - a).norm() > 2.0 || (*at_b - b).norm() > 2.0) return std::nullopt;
  return point;
}

/// About 60 features of `frame` with points from optical flow to a later frame and the true poses.
std::vector<KeyframePoint> MapPoints(const Recording& recording, const CameraModel& camera,
                                     int frame) {
  const cv::Mat image = recording.Image(frame);
  ImagePyramid pyramid;
  if (!pyramid.Build(image).ok()) return {};
  CornerDetector detector({.min_score = 3000, .cell_px = 40});
  std::vector<Corner> corners;
  detector.DetectAll(pyramid, {}, 120, corners);
  std::vector<cv::Point2f> from, to;
  for (const Corner& c : corners) {
    from.emplace_back(static_cast<float>(c.pixel.x()), static_cast<float>(c.pixel.y()));
  }
  cv::Mat previous = image;
  to = from;
  std::vector<bool> alive(from.size(), true);
  int last = frame;
  for (int k = frame + 3; k < std::min(frame + 31, recording.size()); k += 3) {
    const cv::Mat next = recording.Image(k);
    std::vector<cv::Point2f> moved;
    std::vector<std::uint8_t> status;
    std::vector<float> error;
    cv::calcOpticalFlowPyrLK(previous, next, to, moved, status, error);
    for (std::size_t i = 0; i < to.size(); ++i) alive[i] = alive[i] && status[i] != 0;
    to = moved;
    previous = next;
    last = k;
    if ((recording.Truth(k).translation - recording.Truth(frame).translation).norm() > 0.12) break;
  }
  std::vector<KeyframePoint> points;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (!alive[i]) continue;
    const Eigen::Vector2d a(from[i].x, from[i].y), b(to[i].x, to[i].y);
    const auto point = Triangulate(camera, recording.Truth(frame), a, recording.Truth(last), b);
    if (point) points.push_back({static_cast<FeatureId>(frame * 1000 + i), a, *point});
  }
  return points;
}

class RelocaliserOnDesk : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!desk_.present()) return;
    relocaliser_ = std::make_unique<Relocaliser>(RelocaliserOptions{});
    for (int frame = 20; frame + 31 < desk_.size() && frame < 760; frame += 60) {
      map_[frame] = MapPoints(desk_, *camera_, frame);
      const auto status =
          relocaliser_->AddKeyframe(frame, desk_.Image(frame), desk_.Truth(frame), map_[frame]);
      if (status.ok()) points_ += static_cast<int>(map_[frame].size());
    }
    // A poor map: every second feature. And the same with corners beside them.
    thin_ = std::make_unique<Relocaliser>(RelocaliserOptions{});
    for (const auto& [frame, points] : map_) {
      std::vector<KeyframePoint> some;
      for (std::size_t k = 0; k < points.size(); k += 2) some.push_back(points[k]);
      thin_->AddKeyframe(frame, desk_.Image(frame), desk_.Truth(frame), some).IgnoreError();
    }
    dense_ = std::make_unique<Relocaliser>(*thin_);
    for (bool more = true; more;) {
      const auto start = std::chrono::steady_clock::now();
      more = dense_->Densify(*camera_);
      const std::chrono::duration<double, std::milli> took =
          std::chrono::steady_clock::now() - start;
      slowest_step_ms_ = std::max(slowest_step_ms_, took.count());
    }
  }
  static void TearDownTestSuite() {
    relocaliser_.reset();
    thin_.reset();
    dense_.reset();
  }
  void SetUp() override {
    if (!desk_.present()) GTEST_SKIP() << "needs ../shared/data/tum_fr1_xyz";
    ASSERT_GE(relocaliser_->size(), 6U);
  }
  static inline const Recording desk_{"tum_fr1_xyz"};
  static inline const std::shared_ptr<const CameraModel> camera_ = TumCamera();
  static inline std::unique_ptr<Relocaliser> relocaliser_;
  static inline std::unique_ptr<Relocaliser> thin_;   // half the features
  static inline std::unique_ptr<Relocaliser> dense_;  // those with corners
  static inline double slowest_step_ms_ = 0;
  static inline std::map<int, std::vector<KeyframePoint>> map_;  // by keyframe
  static inline int points_ = 0;
};

TEST_F(RelocaliserOnDesk, FindsFramesBetweenTheKeyframes) {
  int asked = 0, found = 0, wrong = 0;
  std::vector<double> times, metres, degrees;
  double inliers = 0;
  for (int frame = 5; frame < desk_.size(); frame += 9) {
    const cv::Mat image = desk_.Image(frame);
    const auto start = std::chrono::steady_clock::now();
    const auto result = relocaliser_->Query(image, *camera_);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    times.push_back(took.count());
    ++asked;
    if (!result) continue;
    ++found;
    inliers += static_cast<double>(result->inliers.size());
    const Rigid3 truth = desk_.Truth(frame);
    metres.push_back((result->world_from_camera.translation - truth.translation).norm());
    degrees.push_back(RotationAngle(result->world_from_camera, truth) * 180 / M_PI);
    wrong += metres.back() > 0.10 || degrees.back() > 5;
  }
  const auto at = [](std::vector<double> v, double q) {
    std::sort(v.begin(), v.end());
    return v.empty() ? -1.0 : v[static_cast<std::size_t>(q * static_cast<double>(v.size() - 1))];
  };
  std::printf(
      "relocaliser on fr1/xyz: %zu keyframes, %d points; %d of %d found, %d wrong, mean %.0f "
      "inliers; error median %.1f p95 %.1f mm, %.2f p95 %.2f deg; time median %.1f p95 %.1f "
      "max %.1f ms\n",
      relocaliser_->size(), points_, found, asked, wrong, inliers / std::max(1, found),
      1e3 * at(metres, 0.5), 1e3 * at(metres, 0.95), at(degrees, 0.5), at(degrees, 0.95),
      at(times, 0.5), at(times, 0.95), at(times, 1.0));
  EXPECT_GE(found, asked * 0.9);
  EXPECT_EQ(wrong, 0);
  EXPECT_LT(at(metres, 0.5), 0.03);
  EXPECT_LT(at(degrees, 0.5), 1.0);
  EXPECT_LT(at(times, 0.5), 200.0);
}

TEST_F(RelocaliserOnDesk, CornersBesideTheFeaturesMisleadNobody) {
  int asked = 0, found = 0, without = 0;
  double slowest_ms = 0;
  for (int frame = 5; frame < desk_.size(); frame += 9) {
    const cv::Mat image = desk_.Image(frame);
    const auto start = std::chrono::steady_clock::now();
    const auto result = dense_->Query(image, *camera_);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    slowest_ms = std::max(slowest_ms, took.count());
    ++asked;
    without += thin_->Query(image, *camera_) ? 1 : 0;
    if (!result) continue;
    ++found;
    const Rigid3 truth = desk_.Truth(frame);
    EXPECT_LT((result->world_from_camera.translation - truth.translation).norm(), 0.10) << frame;
    EXPECT_LT(RotationAngle(result->world_from_camera, truth), 5 * M_PI / 180) << frame;
    // Only the map's own features are returned: the filter knows no others.
    for (const Correspondence& c : result->inliers) {
      const auto keyframe = map_.find(static_cast<int>(c.id / 1000));
      ASSERT_NE(keyframe, map_.end()) << c.id;
      EXPECT_TRUE(std::any_of(keyframe->second.begin(), keyframe->second.end(),
                              [&](const KeyframePoint& p) { return p.id == c.id; }));
    }
  }
  std::printf(
      "half the features with corners: %d of %d found, without %d; slowest query %.1f ms, slowest "
      "step %.1f\n",
      found, asked, without, slowest_ms, slowest_step_ms_);
  EXPECT_GE(found, without);
  EXPECT_GE(found, asked * 0.85);
}

TEST_F(RelocaliserOnDesk, CornersMoveWithTheFeatures) {
  const auto lookup = [&](FeatureId id) -> std::optional<Eigen::Vector3d> {
    for (const KeyframePoint& p : map_[static_cast<int>(id / 1000)]) {
      if (p.id == id) return p.point_in_world + Eigen::Vector3d(0.2, 0.1, 0);
    }
    return std::nullopt;
  };
  int found = 0;
  for (int frame = 5; frame < desk_.size(); frame += 27) {
    const auto result = dense_->Query(desk_.Image(frame), *camera_, lookup);
    if (!result) continue;
    ++found;
    const Eigen::Vector3d expected = desk_.Truth(frame).translation + Eigen::Vector3d(0.2, 0.1, 0);
    EXPECT_LT((result->world_from_camera.translation - expected).norm(), 0.10) << frame;
  }
  EXPECT_GE(found, 22);  // of 30
  EXPECT_FALSE(dense_->Query(desk_.Image(322), *camera_, [](FeatureId) { return std::nullopt; }));
}

TEST_F(RelocaliserOnDesk, AcceptsNothingForeign) {
  int asked = 0;
  std::vector<double> times;
  for (const char* name : {"hall_imu", "checkerboard", "davison_desk", "apriltag_corner"}) {
    const Recording other(name);
    for (int frame = 0; other.present() && frame < other.size(); frame += other.size() / 25) {
      cv::Mat image;
      cv::resize(other.Image(frame), image, cv::Size(640, 480));
      ++asked;
      EXPECT_FALSE(relocaliser_->Query(image, *camera_).has_value()) << name << " " << frame;
      const auto start = std::chrono::steady_clock::now();
      EXPECT_FALSE(dense_->Query(image, *camera_).has_value()) << name << " " << frame;
      const std::chrono::duration<double, std::milli> took =
          std::chrono::steady_clock::now() - start;
      times.push_back(took.count());
    }
  }
  std::sort(times.begin(), times.end());
  std::printf("relocaliser: %d foreign pictures refused; with corners in %.1f ms (median), %.1f\n",
              asked, times.empty() ? 0 : times[times.size() / 2], times.empty() ? 0 : times.back());
  EXPECT_GT(asked, 0);
}

TEST_F(RelocaliserOnDesk, UsesThePointsAsTheyAreNow) {
  // The map has moved since: everything 1 m along x. Every third feature was deleted.
  const auto lookup = [&](FeatureId id) -> std::optional<Eigen::Vector3d> {
    if (id % 3 == 0) return std::nullopt;
    for (const KeyframePoint& p : map_[static_cast<int>(id / 1000)]) {
      if (p.id == id) return p.point_in_world + Eigen::Vector3d::UnitX();
    }
    return std::nullopt;
  };
  const auto result = relocaliser_->Query(desk_.Image(322), *camera_, lookup);
  ASSERT_TRUE(result.has_value());
  const Eigen::Vector3d expected = desk_.Truth(322).translation + Eigen::Vector3d::UnitX();
  EXPECT_LT((result->world_from_camera.translation - expected).norm(), 0.06);
  for (const Correspondence& c : result->inliers) EXPECT_NE(c.id % 3, 0U);
  EXPECT_FALSE(
      relocaliser_->Query(desk_.Image(322), *camera_, [](FeatureId) { return std::nullopt; }));
}

TEST_F(RelocaliserOnDesk, StaysWithinItsLimitAndForgetsTheMostAlike) {
  RelocaliserOptions options;
  options.max_keyframes = 3;
  Relocaliser small(options);
  const auto& points = map_[20];
  Rigid3 pose;
  for (int k = 0; k < 6; ++k) {
    pose.translation.x() = k == 5 ? 4.1 : k;  // the last is nearly the one before
    ASSERT_TRUE(small.AddKeyframe(k, desk_.Image(20), pose, points).ok());
    EXPECT_LE(small.size(), 3U);
  }
  EXPECT_FALSE(small.NeedsKeyframe(pose, 0.05, 0.1));
  pose.translation.x() = 20;
  EXPECT_TRUE(small.NeedsKeyframe(pose, 0.05, 0.1));
}

TEST(Relocaliser, RefusesBadInput) {
  Relocaliser relocaliser{RelocaliserOptions{}};
  const auto camera = TumCamera();
  EXPECT_FALSE(relocaliser.Query(cv::Mat(480, 640, CV_8UC1), *camera).has_value());
  EXPECT_EQ(relocaliser.AddKeyframe(1, cv::Mat(), {}, {}).code(),
            absl::StatusCode::kInvalidArgument);
  std::vector<KeyframePoint> points(40);
  for (KeyframePoint& p : points) p.pixel = {NAN, 3};
  EXPECT_EQ(
      relocaliser.AddKeyframe(1, cv::Mat(480, 640, CV_8UC1, cv::Scalar(9)), {}, points).code(),
      absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(RelocaliserOptions{.ratio = 0}.Validate().ok());
  EXPECT_TRUE(RelocaliserOptions{}.Validate().ok());
}

}  // namespace
}  // namespace saccade
