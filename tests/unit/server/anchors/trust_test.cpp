// What an anchor says of itself: state, expected error and the reason in words have to agree, over
// whole sequences.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "shared/scene/length_text.hpp"
#include "tests/unit/server/anchors/rig.hpp"

namespace saccade::trust_test {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using testing::LookFrom;
using ::testing::Not;
using testing::Rig;
using testing::SyntheticMap;

const Rigid3 kPose = LookFrom({0, 0, 0}, 0, 0.2);

SyntheticMap::Options Still(bool metric = true) {
  SyntheticMap::Options options;
  options.pose_sigma_m = options.pose_sigma_rad = 0;
  options.metric = metric;
  return options;
}

/// An annotation on a feature in view, 1 to 2 m away: its error is the feature's.
FeatureId PlaceOnFeature(Rig& rig) {
  const std::shared_ptr<const MapSnapshot> snapshot = rig.Show(kPose);
  for (const FeatureSnapshot& feature : snapshot->features) {
    const double distance_m = feature.point_in_world.norm();
    if (!feature.pixel || distance_m < 1.0 || distance_m > 2.0) continue;
    AnnotationDraft draft;
    draft.target = FeatureTarget{feature.id};
    EXPECT_TRUE(rig.manager.Create(draft, "e").ok());
    return feature.id;
  }
  ADD_FAILURE() << "no feature between 1 and 2 m";
  return 0;
}

/// `seconds` in which the feature is known to `sigma_m`; the point has come to rest then.
const Anchor& Hold(Rig& rig, FeatureId id, double sigma_m, double seconds) {
  rig.map.Improve(id, sigma_m);
  for (int i = 0; i < std::lround(30 * seconds); ++i) rig.Show(kPose);
  return rig.Only().anchor;
}

TEST(Trust, AMarkThatSettlesBelowItsLimitComesBack) {
  Rig rig(Still());
  const FeatureId id = PlaceOnFeature(rig);
  ASSERT_EQ(Hold(rig, id, 0.010, 3).state, AnchorState::kTracking) << rig.Only().anchor.reason;
  const Anchor& above = Hold(rig, id, 0.060, 5);
  EXPECT_EQ(above.state, AnchorState::kPaused);
  EXPECT_THAT(above.reason, ContainsRegex("expected error 6[0-9] mm is above 50 mm"));
  // 44 mm is more than 80 % of the limit: until 2026-11-28 it stayed so for ever, and said that
  // 44 mm is above 50 mm.
  const Anchor& below = Hold(rig, id, 0.044, 12);
  EXPECT_EQ(below.state, AnchorState::kTracking) << below.reason;
  EXPECT_GT(below.error_m, 0.040);
}

TEST(Trust, WellBelowItsLimitItIsBackAtOnce) {
  Rig rig(Still());
  const FeatureId id = PlaceOnFeature(rig);
  Hold(rig, id, 0.060, 3);
  ASSERT_EQ(rig.Only().anchor.state, AnchorState::kPaused);
  rig.map.Improve(id, 0.001);
  int frames = 0;
  while (rig.Only().anchor.error_m > 0.040 && frames < 100) {
    rig.Show(kPose);
    ++frames;
  }
  EXPECT_EQ(rig.Only().anchor.state, AnchorState::kTracking) << rig.Only().anchor.reason;
}

/// The two figures of a reason in one unit; nothing if it has none.
std::optional<std::pair<double, double>> Figures(const std::string& reason, bool& above) {
  static const std::regex pattern(
      "expected error ([0-9.]+) (mm|cm|m|px|%) is (above|below) ([0-9.]+) (mm|cm|m|px|%)(.*)");
  std::smatch parts;
  if (!std::regex_match(reason, parts, pattern)) return std::nullopt;
  const auto in_mm = [](const std::string& number, const std::string& unit) {
    return std::stod(number) * (unit == "cm" ? 10 : unit == "m" ? 1000 : 1);
  };
  above = parts[3] == "above";
  return std::pair(in_mm(parts[1], parts[2]), in_mm(parts[4], parts[5]));
}

TEST(Trust, WhatIsSaidIsWhatWasComparedInEveryFrame) {
  int said = 0, returns = 0;
  for (const bool metric : {true, false}) {
    for (unsigned seed = 1; seed <= 8; ++seed) {
      SyntheticMap::Options options = Still(metric);
      options.seed = seed;
      Rig rig(options);
      const FeatureId id = PlaceOnFeature(rig);
      std::uniform_real_distribution<double> sigma(0.001, 0.1), dice(0, 1);
      AnchorState before = AnchorState::kProvisional;
      for (int frame = 0; frame < 1500; ++frame) {
        if (dice(rig.map.random()) < 0.02) rig.map.Improve(id, sigma(rig.map.random()));
        rig.Show(kPose);
        const Anchor& anchor = rig.Only().anchor;
        bool above = false;
        if (const auto figures = Figures(anchor.reason, above)) {
          ++said;
          EXPECT_EQ(figures->first > figures->second, above) << anchor.reason;
          EXPECT_NE(figures->first, figures->second) << anchor.reason;
          EXPECT_EQ(anchor.state, AnchorState::kPaused);
        }
        if (anchor.state == AnchorState::kPaused) {
          EXPECT_THAT(anchor.reason, HasSubstr("expected error"));
          if (!metric) {
            EXPECT_THAT(anchor.reason, Not(ContainsRegex("[0-9] [cm]?m "))) << "no scale";
          }
        } else if (metric) {
          EXPECT_LE(anchor.error_m, 0.05) << "above its limit, but trusted";
        }
        returns += before == AnchorState::kPaused && anchor.state == AnchorState::kTracking;
        before = anchor.state;
      }
    }
  }
  std::printf("%d reasons with figures, %d returns\n", said, returns);
  EXPECT_GT(said, 1000);
  EXPECT_GT(returns, 20);
}

TEST(Trust, ANewMarkAboveItsLimitIsNotTrustedEither) {
  Rig rig(Still());
  rig.Show(kPose);
  const FeatureId id = rig.map.Add(rig.Truth(kPose, {330, 240}), 0.20);
  rig.Show(kPose);
  AnnotationDraft draft;
  draft.target = FeatureTarget{id};
  const absl::StatusOr<AnnotationEdit> edit = rig.manager.Create(draft, "e");
  ASSERT_TRUE(edit.ok()) << edit.status();
  EXPECT_EQ(edit->annotation.anchor.state, AnchorState::kPaused);
  EXPECT_THAT(edit->annotation.anchor.reason, HasSubstr("is above"));
  // And becomes one that is, without a click.
  EXPECT_EQ(Hold(rig, id, 0.005, 5).state, AnchorState::kTracking) << rig.Only().anchor.reason;
}

TEST(Trust, ACoastingCameraGivesNoFigureThatNobodyBelieves) {
  Rig rig(Still());
  PlaceOnFeature(rig);
  for (int i = 0; i < 40; ++i) rig.Show(kPose);
  ASSERT_EQ(rig.Only().anchor.state, AnchorState::kTracking) << rig.Only().anchor.reason;
  auto coasting = std::make_shared<MapSnapshot>(*rig.map.Snapshot(kPose));
  coasting->status = TrackingStatus::kCoasting;
  for (FeatureSnapshot& feature : coasting->features) {
    feature.covariance_in_camera += 23.087 * 23.087 * Eigen::Matrix3d::Identity();
  }
  rig.manager.Resolve(coasting, *rig.map.camera());
  const Anchor& anchor = rig.Only().anchor;
  EXPECT_EQ(anchor.state, AnchorState::kPaused);
  EXPECT_THAT(anchor.reason, HasSubstr("not known while coasting"));
  EXPECT_THAT(anchor.reason, Not(ContainsRegex("[0-9]")));
}

TEST(Trust, AClickWhereTheMapIsEmptyIsAGuessAndSaysSo) {
  Rig rig(Still());
  rig.Show(kPose);
  const Eigen::Vector3d ray = Eigen::Vector3d(0.3, -0.1, 1).normalized();
  for (std::size_t i = rig.map.size(); i-- > 0;) {
    const FeatureId id = rig.map.id(i);
    if (rig.map.estimate(id).normalized().dot(ray) > std::cos(0.4)) rig.map.Remove(id);
  }
  ASSERT_GT(rig.map.size(), 20u);
  rig.Show(kPose);
  AnnotationDraft draft;
  draft.target = RayTarget{{0, 0, 0}, ray};
  ASSERT_TRUE(rig.manager.Create(draft, "e").ok());
  for (int i = 0; i < 60; ++i) rig.Show(kPose);
  const Anchor& anchor = rig.Only().anchor;
  EXPECT_EQ(anchor.state, AnchorState::kPaused) << "drawn hollow";
  EXPECT_GT(anchor.error_m, 0.9 * anchor.point_in_world.norm()) << "any depth is as good";
  EXPECT_THAT(anchor.reason, HasSubstr("its depth is a guess; place it again"));
}

TEST(Trust, LengthsAreSaidInTheirOwnUnit) {
  EXPECT_EQ(LengthText(0.0031), "3 mm");
  EXPECT_EQ(LengthText(0.099), "99 mm");
  EXPECT_EQ(LengthText(0.0999), "10 cm");
  EXPECT_EQ(LengthText(0.53), "53 cm");
  EXPECT_EQ(LengthText(0.999), "1.0 m");
  EXPECT_EQ(LengthText(2.31), "2.3 m");
  EXPECT_EQ(LengthText(23.087), "more than 10 m");
  EXPECT_EQ(LengthText(std::nan("")), "more than 10 m");
}

}  // namespace
}  // namespace saccade::trust_test
