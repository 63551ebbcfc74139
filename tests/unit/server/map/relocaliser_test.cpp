#include "server/map/relocaliser.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <optional>

#include "server/features/corner_detector.hpp"
#include "server/sim/corridor_source.hpp"
#include "server/sim/sim_source.hpp"
#include "shared/geometry/so3.hpp"
#include "tests/unit/server/features/recording.hpp"

namespace saccade::relocaliser_test {
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

/// The same, drawn: on any machine. 12 s at a desk.
class Drawn {
 public:
  Drawn() {
    SimOptions options;
    options.motion = SimMotion::kDesk;
    options.duration_s = 12.0;
    auto source = SimSource::Open(options);
    if (!source.ok()) return;
    camera_ = (*source)->info().camera;
    for (auto frame = (*source)->Next(); frame.ok() && *frame; frame = (*source)->Next()) {
      images_.push_back((*frame)->grey);
      truth_.push_back((*source)->Truth((*frame)->id).world_from_camera);
    }
  }
  bool present() const { return !images_.empty(); }
  int size() const { return static_cast<int>(images_.size()); }
  cv::Mat Image(int frame) const { return images_.at(static_cast<std::size_t>(frame)); }
  Rigid3 Truth(int frame) const { return truth_.at(static_cast<std::size_t>(frame)); }
  std::shared_ptr<const CameraModel> camera() const { return camera_; }

 private:
  std::vector<cv::Mat> images_;
  std::vector<Rigid3> truth_;
  std::shared_ptr<const CameraModel> camera_;
};

/// About 60 features of `frame` with points from optical flow to a later frame and the true poses.
template <typename Pictures>
std::vector<ViewPoint> MapPoints(const Pictures& recording, const CameraModel& camera, int frame) {
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
  std::vector<ViewPoint> points;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (!alive[i]) continue;
    const Eigen::Vector2d a(from[i].x, from[i].y), b(to[i].x, to[i].y);
    const auto point = Triangulate(camera, recording.Truth(frame), a, recording.Truth(last), b);
    if (point) points.push_back({static_cast<FeatureId>(frame * 1000 + i), a, *point});
  }
  return points;
}

/// A real desk, where the recordings are.
struct RealDesk {
  static constexpr const char* kNeeds = "needs ../shared/data/tum_fr1_xyz";
  static constexpr int kKeyframeEvery = 60;
  static Recording Open() { return Recording("tum_fr1_xyz"); }
  static std::shared_ptr<const CameraModel> Camera(const Recording&) { return TumCamera(); }
};
/// A drawn one, everywhere.
struct DrawnDesk {
  static constexpr const char* kNeeds = "cannot draw";
  static constexpr int kKeyframeEvery = 30;
  static Drawn Open() { return Drawn(); }
  static std::shared_ptr<const CameraModel> Camera(const Drawn& desk) { return desk.camera(); }
};

template <typename Desk>
class RelocaliserOnDesk : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    desk_.emplace(Desk::Open());
    if (!desk_->present()) return;
    camera_ = Desk::Camera(*desk_);
    relocaliser_ = std::make_unique<Relocaliser>(RelocaliserOptions{});
    for (int frame = 20; frame + 31 < desk_->size() && frame < 760; frame += Desk::kKeyframeEvery) {
      map_[frame] = MapPoints(*desk_, *camera_, frame);
      const auto status =
          relocaliser_->AddView(frame, desk_->Image(frame), desk_->Truth(frame), map_[frame]);
      if (status.ok()) points_ += static_cast<int>(map_[frame].size());
    }
    // A poor map: every second feature. And the same with corners beside them.
    thin_ = std::make_unique<Relocaliser>(RelocaliserOptions{});
    for (const auto& [frame, points] : map_) {
      std::vector<ViewPoint> some;
      for (std::size_t k = 0; k < points.size(); k += 2) some.push_back(points[k]);
      thin_->AddView(frame, desk_->Image(frame), desk_->Truth(frame), some).IgnoreError();
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
    desk_.reset();
  }
  void SetUp() override {
    if (!desk_->present()) GTEST_SKIP() << Desk::kNeeds;
    ASSERT_GE(relocaliser_->size(), 6U);
  }
  using Pictures = decltype(Desk::Open());
  /// In the middle of the map, between keyframes.
  static int Middle() { return desk_->size() * 2 / 5; }
  static inline std::optional<Pictures> desk_;
  static inline std::shared_ptr<const CameraModel> camera_;
  static inline std::unique_ptr<Relocaliser> relocaliser_;
  static inline std::unique_ptr<Relocaliser> thin_;   // half the features
  static inline std::unique_ptr<Relocaliser> dense_;  // those with corners
  static inline double slowest_step_ms_ = 0;
  static inline std::map<int, std::vector<ViewPoint>> map_;  // by keyframe
  static inline int points_ = 0;
};
using Desks = ::testing::Types<RealDesk, DrawnDesk>;
TYPED_TEST_SUITE(RelocaliserOnDesk, Desks);

TYPED_TEST(RelocaliserOnDesk, FindsFramesBetweenTheKeyframes) {
  int asked = 0, found = 0, wrong = 0;
  std::vector<double> times, metres, degrees;
  double inliers = 0;
  for (int frame = 5; frame < this->desk_->size(); frame += 9) {
    const cv::Mat image = this->desk_->Image(frame);
    const auto start = std::chrono::steady_clock::now();
    const auto result = this->relocaliser_->Query(image, *this->camera_);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    times.push_back(took.count());
    ++asked;
    if (!result) continue;
    ++found;
    inliers += static_cast<double>(result->inliers.size());
    const Rigid3 truth = this->desk_->Truth(frame);
    metres.push_back((result->world_from_camera.translation - truth.translation).norm());
    degrees.push_back(RotationAngle(result->world_from_camera, truth) * 180 / M_PI);
    wrong += metres.back() > 0.10 || degrees.back() > 5;
  }
  const auto at = [](std::vector<double> v, double q) {
    std::sort(v.begin(), v.end());
    return v.empty() ? -1.0 : v[static_cast<std::size_t>(q * static_cast<double>(v.size() - 1))];
  };
  std::printf(
      "relocaliser: %zu keyframes, %d points; %d of %d found, %d wrong, mean %.0f "
      "inliers; error median %.1f p95 %.1f mm, %.2f p95 %.2f deg; time median %.1f p95 %.1f "
      "max %.1f ms\n",
      this->relocaliser_->size(), this->points_, found, asked, wrong, inliers / std::max(1, found),
      1e3 * at(metres, 0.5), 1e3 * at(metres, 0.95), at(degrees, 0.5), at(degrees, 0.95),
      at(times, 0.5), at(times, 0.95), at(times, 1.0));
  EXPECT_GE(found, asked * 0.9);
  EXPECT_EQ(wrong, 0);
  EXPECT_LT(at(metres, 0.5), 0.03);
  EXPECT_LT(at(degrees, 0.5), 1.0);
  EXPECT_LT(at(times, 0.5), 200.0);
}

TYPED_TEST(RelocaliserOnDesk, CornersBesideTheFeaturesMisleadNobody) {
  int asked = 0, found = 0, without = 0;
  double slowest_ms = 0;
  for (int frame = 5; frame < this->desk_->size(); frame += 9) {
    const cv::Mat image = this->desk_->Image(frame);
    const auto start = std::chrono::steady_clock::now();
    const auto result = this->dense_->Query(image, *this->camera_);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    slowest_ms = std::max(slowest_ms, took.count());
    ++asked;
    without += this->thin_->Query(image, *this->camera_) ? 1 : 0;
    if (!result) continue;
    ++found;
    const Rigid3 truth = this->desk_->Truth(frame);
    EXPECT_LT((result->world_from_camera.translation - truth.translation).norm(), 0.10) << frame;
    EXPECT_LT(RotationAngle(result->world_from_camera, truth), 5 * M_PI / 180) << frame;
    // Only the map's own features are returned: the filter knows no others.
    for (const Correspondence& c : result->inliers) {
      const auto keyframe = this->map_.find(static_cast<int>(c.id / 1000));
      ASSERT_NE(keyframe, this->map_.end()) << c.id;
      EXPECT_TRUE(std::any_of(keyframe->second.begin(), keyframe->second.end(),
                              [&](const ViewPoint& p) { return p.id == c.id; }));
    }
  }
  std::printf(
      "half the features with corners: %d of %d found, without %d; slowest query %.1f ms, slowest "
      "step %.1f\n",
      found, asked, without, slowest_ms, this->slowest_step_ms_);
  EXPECT_GE(found, without);
  EXPECT_GE(found, asked * 0.85);
}

TYPED_TEST(RelocaliserOnDesk, CornersMoveWithTheFeatures) {
  const auto lookup = [&](FeatureId id) -> std::optional<Eigen::Vector3d> {
    for (const ViewPoint& p : this->map_[static_cast<int>(id / 1000)]) {
      if (p.id == id) return p.point_in_world + Eigen::Vector3d(0.2, 0.1, 0);
    }
    return std::nullopt;
  };
  int found = 0, asked = 0;
  for (int frame = 5; frame < this->desk_->size(); frame += 27) {
    ++asked;
    const auto result = this->dense_->Query(this->desk_->Image(frame), *this->camera_, lookup);
    if (!result) continue;
    ++found;
    const Eigen::Vector3d expected =
        this->desk_->Truth(frame).translation + Eigen::Vector3d(0.2, 0.1, 0);
    EXPECT_LT((result->world_from_camera.translation - expected).norm(), 0.10) << frame;
  }
  EXPECT_GE(found, asked * 0.7);
  EXPECT_FALSE(this->dense_->Query(this->desk_->Image(this->Middle()), *this->camera_,
                                   [](FeatureId) { return std::nullopt; }));
}

TYPED_TEST(RelocaliserOnDesk, AcceptsNothingForeign) {
  int asked = 0;
  std::vector<double> times;
  const auto ask = [&](const auto& other, const std::string& name) {
    for (int frame = 0; other.present() && frame < other.size(); frame += other.size() / 25) {
      cv::Mat image;
      cv::resize(other.Image(frame), image, cv::Size(640, 480));
      ++asked;
      EXPECT_FALSE(this->relocaliser_->Query(image, *this->camera_).has_value())
          << name << " " << frame;
      const auto start = std::chrono::steady_clock::now();
      EXPECT_FALSE(this->dense_->Query(image, *this->camera_).has_value()) << name << " " << frame;
      const std::chrono::duration<double, std::milli> took =
          std::chrono::steady_clock::now() - start;
      times.push_back(took.count());
    }
  };
  for (const char* name : {"hall_imu", "checkerboard", "davison_desk", "apriltag_corner"}) {
    ask(Recording(name), name);
  }
  CorridorSource corridor{CorridorOptions()};
  for (int k = 0; k < 300; ++k) {
    const auto frame = corridor.Next();
    ASSERT_TRUE(frame.ok() && *frame);
    if (k % 12 != 0) continue;
    ++asked;
    EXPECT_FALSE(this->relocaliser_->Query((*frame)->grey, *this->camera_).has_value()) << k;
    EXPECT_FALSE(this->dense_->Query((*frame)->grey, *this->camera_).has_value()) << k;
  }
  std::sort(times.begin(), times.end());
  std::printf("relocaliser: %d foreign pictures refused; with corners in %.1f ms (median), %.1f\n",
              asked, times.empty() ? 0 : times[times.size() / 2], times.empty() ? 0 : times.back());
  EXPECT_GT(asked, 0);
}

TYPED_TEST(RelocaliserOnDesk, UsesThePointsAsTheyAreNow) {
  // The map has moved since: everything 1 m along x. Every third feature was deleted.
  const auto lookup = [&](FeatureId id) -> std::optional<Eigen::Vector3d> {
    if (id % 3 == 0) return std::nullopt;
    for (const ViewPoint& p : this->map_[static_cast<int>(id / 1000)]) {
      if (p.id == id) return p.point_in_world + Eigen::Vector3d::UnitX();
    }
    return std::nullopt;
  };
  const auto result =
      this->relocaliser_->Query(this->desk_->Image(this->Middle()), *this->camera_, lookup);
  ASSERT_TRUE(result.has_value());
  const Eigen::Vector3d expected =
      this->desk_->Truth(this->Middle()).translation + Eigen::Vector3d::UnitX();
  EXPECT_LT((result->world_from_camera.translation - expected).norm(), 0.06);
  for (const Correspondence& c : result->inliers) EXPECT_NE(c.id % 3, 0U);
  EXPECT_FALSE(this->relocaliser_->Query(this->desk_->Image(this->Middle()), *this->camera_,
                                         [](FeatureId) { return std::nullopt; }));
}

TYPED_TEST(RelocaliserOnDesk, StaysWithinItsLimitAndForgetsTheMostAlike) {
  RelocaliserOptions options;
  options.max_views = 3;
  Relocaliser small(options);
  const auto richest = std::max_element(
      this->map_.begin(), this->map_.end(),
      [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  const auto& [frame, points] = *richest;
  Rigid3 pose;
  for (int k = 0; k < 6; ++k) {
    pose.translation.x() = k == 5 ? 4.1 : k;  // the last is nearly the one before
    ASSERT_TRUE(small.AddView(k, this->desk_->Image(frame), pose, points).ok());
    EXPECT_LE(small.size(), 3U);
  }
  EXPECT_FALSE(small.NeedsView(pose, 0.05, 0.1));
  pose.translation.x() = 20;
  EXPECT_TRUE(small.NeedsView(pose, 0.05, 0.1));
}

TEST(Relocaliser, RefusesBadInput) {
  Relocaliser relocaliser{RelocaliserOptions{}};
  const auto camera = TumCamera();
  EXPECT_FALSE(relocaliser.Query(cv::Mat(480, 640, CV_8UC1), *camera).has_value());
  EXPECT_EQ(relocaliser.AddView(1, cv::Mat(), {}, {}).code(), absl::StatusCode::kInvalidArgument);
  std::vector<ViewPoint> points(40);
  for (ViewPoint& p : points) p.pixel = {NAN, 3};
  EXPECT_EQ(relocaliser.AddView(1, cv::Mat(480, 640, CV_8UC1, cv::Scalar(9)), {}, points).code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(RelocaliserOptions{.ratio = 0}.Validate().ok());
  EXPECT_TRUE(RelocaliserOptions{}.Validate().ok());
}

}  // namespace
}  // namespace saccade::relocaliser_test
