#include "server/anchors/scale_chain.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <vector>

#include "server/anchors/anchor_place.hpp"

namespace saccade::scale_chain_test {
namespace {

constexpr double kRadiansPerPx = 1.0 / 500;

/// A wearer who turns on the spot: features all round him at 2 m, in view while they are within
/// 35 deg of where he looks, known from 3 px of parallax on.
class Turn {
 public:
  /// Degrees a second, and how fast he walks sideways meanwhile.
  void Go(double from_deg, double to_deg, double rate_deg_s, double speed_m_s) {
    const double way = to_deg - from_deg;
    const int frames = static_cast<int>(std::abs(way) / rate_deg_s * 30) + 1;
    for (int k = 0; k < frames; ++k) Show(from_deg + way * k / frames, speed_m_s / 30);
  }
  void Rest(double at_deg, double seconds, double speed_m_s) {
    for (int k = 0; k < seconds * 30; ++k) Show(at_deg, speed_m_s / 30);
  }
  /// Sigma of scale of what lies in that direction.
  double SigmaAt(double deg) const { return std::sqrt(chain.Of(Id(deg))); }
  static FeatureId Id(double deg) { return 1000 + static_cast<FeatureId>(std::lround(deg + 360)); }

  MapSnapshot Show(double look_deg, double step_m) {
    eye_.y() += step_m;
    MapSnapshot snapshot;
    snapshot.status = TrackingStatus::kTracking;
    snapshot.map_generation = 1;
    snapshot.metric = true;
    snapshot.capture_time_ns = 33'333'333 * ++frame_;
    snapshot.world_from_camera.translation = eye_;
    for (int deg = -180; deg <= 180; deg += 3) {
      FeatureSnapshot feature;
      feature.id = Id(deg);
      const double rad = deg * M_PI / 180;
      feature.point_in_world = {2 * std::sin(rad), 0, 2 * std::cos(rad)};
      feature.covariance_in_world = 1e-6 * Eigen::Matrix3d::Identity();
      feature.covariance_in_camera = feature.covariance_in_world;
      if (std::abs(deg - look_deg) < 35) {
        feature.state = FeatureState::kMeasured;
        const auto [first, is_new] = first_.try_emplace(feature.id, eye_);
        const double parallax = (eye_ - first->second).norm() / 2 / kRadiansPerPx;
        feature.depth_known = frame_ < 30 || parallax > 3;
      } else {
        feature.depth_known = first_.contains(feature.id);
      }
      snapshot.features.push_back(feature);
    }
    chain.Observe(snapshot, kRadiansPerPx);
    return snapshot;
  }

  ScaleChain chain;

 private:
  Eigen::Vector3d eye_ = Eigen::Vector3d::Zero();
  std::int64_t frame_ = 0;
  std::map<FeatureId, Eigen::Vector3d> first_;
};

TEST(ScaleChain, WhatIsSeenFirstHasTheMapsOwnScale) {
  Turn turn;
  turn.Rest(0, 2, 0.1);
  EXPECT_LT(turn.SigmaAt(0), 1e-9);
  EXPECT_LT(turn.SigmaAt(30), 1e-9);
}

TEST(ScaleChain, AFastTurnHandsScaleOnBadly) {
  Turn fast;
  fast.Rest(0, 1, 0);
  fast.Go(0, 150, 60, 0.1);
  EXPECT_GT(fast.SigmaAt(150), 0.03) << "three hand-overs at some pixels";
  EXPECT_LT(fast.SigmaAt(0), 1e-9) << "what was known stays so";
  EXPECT_GT(fast.SigmaAt(150), fast.SigmaAt(60)) << "and it adds up";
}

TEST(ScaleChain, ASlowTurnWithParallaxHandsItOnWell) {
  Turn slow;
  slow.Rest(0, 1, 0);
  slow.Go(0, 150, 15, 0.3);
  EXPECT_LT(slow.SigmaAt(150), 0.015);
}

TEST(ScaleChain, LookingOnWithinTheSamePartLearnsNothing) {
  Turn turn;
  turn.Rest(0, 1, 0);
  turn.Go(0, 150, 60, 0.1);
  const double before = turn.SigmaAt(150);
  turn.Rest(150, 10, 0.3);
  EXPECT_GT(turn.SigmaAt(150), 0.5 * before);
}

TEST(ScaleChain, BackAtTheBeginningIsAsSureAsBefore) {
  Turn turn;
  turn.Rest(0, 1, 0);
  turn.Go(0, 150, 60, 0.1);
  turn.Go(150, 0, 60, 0.1);
  EXPECT_LT(std::sqrt(turn.chain.Now()), 0.01);
}

TEST(ScaleChain, AMarkClaimsNoBetterThanThePartItHangsIn) {
  Turn turn;
  turn.Rest(0, 1, 0);
  turn.Go(0, 150, 60, 0.1);
  auto snapshot = std::make_shared<MapSnapshot>(turn.Show(150, 0));
  const auto claim = [&](const ScaleChain* chain) {
    AnchorPlace place;
    place.attached = true;
    place.map_generation = 1;
    place.distance_m = 2;
    place.point = place.clicked_point = {2 * std::sin(2.6), 0, 2 * std::cos(2.6)};
    int selections = 1;
    const PlaceEstimate estimate =
        Follow(MapView(snapshot, chain), AnchorOptions(), place, selections);
    return std::sqrt(estimate.covariance_in_camera.trace());
  };
  EXPECT_LT(claim(nullptr), 0.005) << "each of its members is known to a millimetre";
  EXPECT_GT(claim(&turn.chain), 0.06) << "but all of them may be too near";
}

}  // namespace
}  // namespace saccade::scale_chain_test
