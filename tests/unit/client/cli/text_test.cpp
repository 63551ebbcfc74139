#include "client/cli/text.hpp"

#include <gtest/gtest.h>

#include <set>

#include "client/net/connection.hpp"

namespace saccade::cli::text_test {
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
  nlohmann::json json = ToJson(annotation, true);
  EXPECT_TRUE(json["anchor"]["pixel"].is_null());
  EXPECT_TRUE(json["anchor"]["error_px"].is_null());
  EXPECT_DOUBLE_EQ(json["anchor"]["error_mm"].get<double>(), 3.0);
  EXPECT_EQ(json["anchor"]["point_in_world_m"], nlohmann::json::array({1.0, 2.0, 3.0}));
  EXPECT_EQ(json["anchor"]["covariance_in_world_m2_upper"].size(), 6u);
  EXPECT_EQ(json["color_rgba"], "00ff0080");

  annotation.anchor.pixel = Eigen::Vector2d(10, 20);
  annotation.anchor.error_px = 0.8;
  json = ToJson(annotation, true);
  EXPECT_EQ(json["anchor"]["pixel"], nlohmann::json::array({10.0, 20.0}));
}

TEST(Json, AnAnchorWhosePlaceIsNotKnownHasNoPoint) {
  Annotation annotation;
  annotation.anchor.state = AnchorState::kPaused;
  annotation.anchor.point_in_world = {1, 2, 3};  // of another map
  annotation.anchor.error_m = 0.003;
  annotation.anchor.place_known = false;
  const nlohmann::json anchor = ToJson(annotation, true)["anchor"];
  for (const char* name : {"point_in_world_m", "covariance_in_world_m2_upper", "error_mm"}) {
    ASSERT_TRUE(anchor.contains(name)) << name;
    EXPECT_TRUE(anchor[name].is_null()) << name;
  }
  EXPECT_EQ(PlaceText(annotation.anchor), "place not known");
  EXPECT_EQ(ErrorText(annotation.anchor, true), "place not known");
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
  EXPECT_EQ(ErrorText(anchor, true), "out of view 3 mm");
  anchor.error_px = 0.84;
  EXPECT_EQ(ErrorText(anchor, true), "0.8 px 3 mm");
  anchor.error_m = 0.53;
  EXPECT_EQ(ErrorText(anchor, true), "0.8 px 53 cm");
  anchor.error_m = 23.087;
  EXPECT_EQ(ErrorText(anchor, true), "0.8 px more than 10 m");
}

TEST(ErrorText, AMapWithoutScaleHasNoLengths) {
  Annotation annotation;
  annotation.anchor.error_m = 0.0031;
  EXPECT_EQ(ErrorText(annotation.anchor, false), "out of view, scale unknown");
  annotation.anchor.error_px = 0.84;
  EXPECT_EQ(ErrorText(annotation.anchor, false), "0.8 px, scale unknown");
  const nlohmann::json anchor = ToJson(annotation, false)["anchor"];
  EXPECT_TRUE(anchor["error_mm"].is_null());
  EXPECT_EQ(anchor["metric"], false);
  EXPECT_DOUBLE_EQ(anchor["error_px"].get<double>(), 0.84);
}

TEST(Json, WhatReadersWouldRoundIsAString) {
  FeatureSnapshot feature;
  net::MapState map;
  for (const FeatureId id : {FeatureId{1} << 53, (FeatureId{1} << 53) + 1, ~FeatureId{0}}) {
    feature.id = id;
    map.features.push_back(feature);
  }
  map.frame_id = 7;
  const nlohmann::json json = ToJson(map);
  EXPECT_EQ(json["features"][0]["id"].dump(), "9007199254740992");
  EXPECT_EQ(json["features"][1]["id"].dump(), "\"9007199254740993\"");
  EXPECT_EQ(json["features"][2]["id"].dump(), "\"18446744073709551615\"");
  EXPECT_EQ(json["frame_id"].dump(), "7");

  Annotation annotation;
  annotation.created_unix_ns = 1'795'910'400'123'456'789;
  annotation.revision = (std::uint64_t{1} << 60) + 1;
  EXPECT_EQ(ToJson(annotation, true)["created_unix_ns"], "1795910400123456789");
  EXPECT_EQ(ToJson(annotation, true)["revision"], "1152921504606846977");
  MapSnapshot pose;
  pose.capture_time_ns = 5;  // a string at any size: its type does not change with the uptime
  pose.frame_id = ~FrameId{0};
  EXPECT_EQ(ToJson(pose)["capture_time_ns"], "5");
  EXPECT_EQ(ToJson(pose)["frame_id"], "18446744073709551615");
  EXPECT_EQ(
      ToJson(net::WatchEvent(net::SourceEnd{~std::uint64_t{0}}), true)["end_of_source"]["frames"],
      "18446744073709551615");
}

TEST(Json, BytesThatAreNotUtf8ArePrintedAllTheSame) {
  EXPECT_EQ(Dump({{"a", "x\xff"}}), "{\"a\":\"x\ufffd\"}");
}

TEST(Json, LiveAnchorsAreInTheEvent) {
  net::AnnotationChange change;
  change.anchors.push_back({"6f1c", {}});
  change.anchors[0].anchor.error_m = 0.002;
  const nlohmann::json json = ToJson(net::WatchEvent(change), true)["annotation"];
  EXPECT_EQ(json["anchors"][0]["id"], "6f1c");
  EXPECT_DOUBLE_EQ(json["anchors"][0]["anchor"]["error_mm"].get<double>(), 2.0);
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
}  // namespace saccade::cli::text_test
