#include "client/cli/text.hpp"

#include <gtest/gtest.h>

#include <set>

#include "client/net/connection.hpp"

namespace saccade::cli {
namespace {

TEST(Table, PadsByCharactersNotBytes) {
  EXPECT_EQ(Table({{"Öl", "x"}, {"abc", "y"}}), "Öl   x\nabc  y\n");
  EXPECT_EQ(Table({{"a", ""}, {"b"}}), "a\nb\n");
  EXPECT_EQ(Table({}), "");
}

TEST(Json, AnnotationOutOfViewHasNoPixel) {
  Annotation annotation;
  annotation.id = "6f1c";
  annotation.color_rgba = 0x00ff0080;
  annotation.anchor.error_m = 0.003;
  annotation.anchor.point_in_world = {1, 2, 3};
  nlohmann::json json = ToJson(annotation);
  EXPECT_TRUE(json["anchor"]["pixel"].is_null());
  EXPECT_TRUE(json["anchor"]["error_px"].is_null());
  EXPECT_DOUBLE_EQ(json["anchor"]["error_mm"].get<double>(), 3.0);
  EXPECT_EQ(json["anchor"]["point_in_world_m"], nlohmann::json::array({1.0, 2.0, 3.0}));
  EXPECT_EQ(json["anchor"]["covariance_in_world_m2_upper"].size(), 6u);
  EXPECT_EQ(json["color_rgba"], "00ff0080");

  annotation.anchor.pixel = Eigen::Vector2d(10, 20);
  annotation.anchor.error_px = 0.8;
  json = ToJson(annotation);
  EXPECT_EQ(json["anchor"]["pixel"], nlohmann::json::array({10.0, 20.0}));
}

TEST(Json, AnAnchorWhosePlaceIsNotKnownHasNoPoint) {
  Annotation annotation;
  annotation.anchor.state = AnchorState::kPaused;
  annotation.anchor.point_in_world = {1, 2, 3};  // of another map
  annotation.anchor.error_m = 0.003;
  annotation.anchor.place_known = false;
  const nlohmann::json anchor = ToJson(annotation)["anchor"];
  for (const char* name : {"point_in_world_m", "covariance_in_world_m2_upper", "error_mm"}) {
    ASSERT_TRUE(anchor.contains(name)) << name;
    EXPECT_TRUE(anchor[name].is_null()) << name;
  }
  EXPECT_EQ(PlaceText(annotation.anchor), "place not known");
  EXPECT_EQ(ErrorText(annotation.anchor), "place not known");
  annotation.anchor.place_known = true;
  EXPECT_EQ(PlaceText(annotation.anchor), "x 1.000 y 2.000 z 3.000");
}

TEST(Json, PoseHasItsQuaternionInWireOrder) {
  MapSnapshot pose;
  pose.world_from_camera.rotation = Eigen::Quaterniond(0.5, 0.1, 0.2, 0.3);  // w x y z
  const nlohmann::json json = ToJson(pose);
  EXPECT_EQ(json["world_from_camera"]["rotation_xyzw"],
            nlohmann::json::array({0.1, 0.2, 0.3, 0.5}));
  EXPECT_EQ(json["covariance_upper"].size(), 21u);
  EXPECT_EQ(json["status"], "initialising");
}

TEST(ErrorText, SaysWhenAnAnchorIsOutOfView) {
  Anchor anchor;
  anchor.error_m = 0.0031;
  EXPECT_EQ(ErrorText(anchor), "out of view 3 mm");
  anchor.error_px = 0.84;
  EXPECT_EQ(ErrorText(anchor), "0.8 px 3 mm");
}

TEST(RandomUuid, HasTheFormOfVersionFourAndDoesNotRepeat) {
  std::set<std::string> seen;
  for (int i = 0; i < 1000; ++i) {
    const std::string uuid = net::RandomUuid();
    ASSERT_EQ(uuid.size(), 36u) << uuid;
    EXPECT_EQ(uuid[14], '4') << uuid;
    EXPECT_NE(std::string("89ab").find(uuid[19]), std::string::npos) << uuid;
    EXPECT_TRUE(seen.insert(uuid).second);
  }
}

}  // namespace
}  // namespace saccade::cli
