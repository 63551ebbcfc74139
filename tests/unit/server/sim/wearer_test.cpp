#include "server/sim/wearer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/sim/ray_caster.hpp"
#include "server/sim/room.hpp"

namespace saccade::wearer_test {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr SimMotion kMotions[] = {SimMotion::kDesk, SimMotion::kSway,  SimMotion::kWalk,
                                  SimMotion::kTurn, SimMotion::kTwist, SimMotion::kStill};

double AngularSpeed(const Wearer& wearer, double time_s) {
  constexpr double kStep = 1e-3;
  return RotationAngle(wearer.WorldFromCamera(time_s, {}),
                       wearer.WorldFromCamera(time_s + kStep, {})) /
         kStep;
}

TEST(Wearer, FirstSecondRestsOnTheChessboard) {
  for (const SimMotion motion : kMotions) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const Wearer wearer(motion, seed);
      const Rigid3 start = wearer.WorldFromCamera(0, {});
      const Eigen::Vector3d middle = start.Inverse() * Eigen::Vector3d(0.16, 0.10, 0);
      EXPECT_LT(std::atan2(middle.head<2>().norm(), middle.z()), 8 * kDegree);
      EXPECT_GT(middle.z(), 0.6);
      const Rigid3 later = wearer.WorldFromCamera(1.0, {});
      EXPECT_LT((later.translation - start.translation).norm(), 0.02);
      EXPECT_LT(RotationAngle(start, later), 1.5 * kDegree);
    }
  }
}

TEST(Wearer, MotionIsSmooth) {
  for (const SimMotion motion : kMotions) {
    const Wearer wearer(motion, 3);
    constexpr double kStep = 1e-3;
    for (double t = 0; t < 30; t += 0.0371) {
      const Eigen::Vector3d a = wearer.WorldFromCamera(t, {}).translation;
      const Eigen::Vector3d b = wearer.WorldFromCamera(t + kStep, {}).translation;
      const Eigen::Vector3d c = wearer.WorldFromCamera(t + 2 * kStep, {}).translation;
      EXPECT_LT((b - a).norm() / kStep, 1.5) << t;                    // m/s
      EXPECT_LT((a - 2 * b + c).norm() / (kStep * kStep), 8.0) << t;  // m/s^2: no jumps
      EXPECT_LT(AngularSpeed(wearer, t), 2.6) << t;
    }
  }
}

TEST(Wearer, WalkCoversTenMetresAndComesBack) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Wearer wearer(SimMotion::kWalk, seed);
    double length = 0, nearest = 10;
    const Eigen::Vector3d start = wearer.WorldFromCamera(0, {}).translation;
    for (double t = 0; t < 30; t += 0.02) {
      const Eigen::Vector3d at = wearer.WorldFromCamera(t, {}).translation;
      length += (wearer.WorldFromCamera(t + 0.02, {}).translation - at).norm();
      if (t > 6) nearest = std::min(nearest, (at - start).norm());
    }
    EXPECT_GT(length, 12.0);
    EXPECT_LT(nearest, 0.35);
  }
}

TEST(Wearer, TurnsReachSixtyDegreesPerSecond) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Wearer wearer(SimMotion::kTurn, seed);
    double fastest = 0, widest = 0;
    const Rigid3 start = wearer.WorldFromCamera(0, {});
    for (double t = 0; t < 12; t += 0.02) {
      fastest = std::max(fastest, AngularSpeed(wearer, t));
      widest = std::max(widest, RotationAngle(start, wearer.WorldFromCamera(t, {})));
    }
    EXPECT_GT(fastest, 60 * kDegree);
    EXPECT_LT(fastest, 130 * kDegree);
    EXPECT_GT(widest, 55 * kDegree);
  }
}

TEST(Wearer, TwistTurnsAboutAllAxesInPlace) {
  const Wearer wearer(SimMotion::kTwist, 2);
  const Rigid3 start = wearer.WorldFromCamera(0, {});
  Eigen::Array3d widest = Eigen::Array3d::Zero();
  double fastest = 0;
  for (double t = 0; t < 21; t += 0.02) {
    const Rigid3 now = wearer.WorldFromCamera(t, {});
    const Eigen::AngleAxisd turn((start.Inverse() * now).rotation);
    widest = widest.max((turn.angle() * turn.axis()).array().abs());
    fastest = std::max(fastest, AngularSpeed(wearer, t));
    EXPECT_LT((now.translation - start.translation).norm(), 0.25);
  }
  EXPECT_GT(widest.minCoeff(), 25 * kDegree);
  EXPECT_GT(fastest, 50 * kDegree);
  EXPECT_LT(fastest, 85 * kDegree);
}

TEST(Wearer, SwayLeansFarEnoughForParallax) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Wearer wearer(SimMotion::kSway, seed);
    Eigen::Array3d low = Eigen::Array3d::Constant(1e9), high = -low;
    for (double t = 0; t < 30; t += 0.05) {
      const Eigen::Array3d at = wearer.WorldFromCamera(t, {}).translation.array();
      low = low.min(at);
      high = high.max(at);
    }
    EXPECT_GT((high - low).maxCoeff(), 0.2);
    EXPECT_LT((high - low).maxCoeff(), 0.8);
  }
}

TEST(Wearer, NeverTouchesTheRoom) {
  const RoomScene scene = BuildRoom(1);
  const RayCaster caster(scene);
  for (const SimMotion motion : kMotions) {
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      const Wearer wearer(motion, seed);
      for (double t = 0; t < 60; t += 0.2) {
        const Eigen::Vector3f at = wearer.WorldFromCamera(t, {}).translation.cast<float>();
        for (int k = 0; k < 24; ++k) {
          const float z = 1 - (2 * static_cast<float>(k) + 1) / 24;
          const float r = std::sqrt(1 - z * z), a = 2.39996f * static_cast<float>(k);
          ASSERT_FALSE(caster.Blocked(at, {r * std::cos(a), r * std::sin(a), z}, 0.15f))
              << "motion " << static_cast<int>(motion) << " seed " << seed << " at " << t << " s";
        }
      }
    }
  }
}

TEST(Wearer, HeadAnglesTurnAsTheMountProtocolSays) {
  const Wearer wearer(SimMotion::kStill, 1);
  const Rigid3 ahead = wearer.WorldFromCamera(0, {});
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const auto seen = [&](const MountAngles& head) -> Eigen::Vector3d {
    return ahead.rotation.conjugate() * (wearer.WorldFromCamera(0, head).rotation * z);
  };
  EXPECT_GT(seen({.pan_rad = 0.1}).x(), 0.09);         // to the right
  EXPECT_LT(seen({.elevation_rad = 0.1}).y(), -0.09);  // up: y points down
  EXPECT_NEAR(seen({.cyclotorsion_rad = 0.1}).z(), 1.0, 1e-12);
}

}  // namespace
}  // namespace saccade::wearer_test
