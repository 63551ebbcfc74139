// Maps on the disk: whole or refused, and never half.
#include "server/store/map_shelf.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

namespace saccade::map_shelf_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr char kFirst[] = "0f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11";
constexpr char kSecond[] = "1f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11";

/// A map of one keyframe that saw two landmarks first; one of them is a known point.
StoredMap SmallMap() {
  StoredMap map;
  map.lens.width = 640;
  map.lens.height = 480;
  map.lens.fx = map.lens.fy = 500.0;
  map.metric = true;
  Landmark known;
  known.id = 1;
  known.known.emplace();
  known.known->point_in_world = {0.1, 0.2, 1.0};
  map.known.push_back(known);
  DormantLandmark dormant;
  dormant.landmark.id = 2;
  dormant.landmark.attempted = 50;
  dormant.landmark.matched = 40;
  map.at_rest.push_back(dormant);
  KeyframeGraph::Point point;
  point.anchor = 3;
  point.birth.id = 2;
  map.keyframes.points[2] = point;
  map.keyframes.keyframes[3].births = {2};
  return map;
}

class MapShelfTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              ("map_shelf_" + std::to_string(::getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  absl::Status Save(MapShelf& shelf, const std::string& id, std::int64_t when,
                    const std::string& name = "") {
    KeptMapFacts facts;
    facts.id = facts.world = id;
    facts.name = name;
    facts.saved_unix_s = when;
    return shelf.Save(facts, SmallMap());
  }
  std::string Read(const std::string& id) {
    std::ifstream in(folder_ / (id + ".map"), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void Write(const std::string& id, const std::string& bytes) {
    std::ofstream(folder_ / (id + ".map"), std::ios::binary) << bytes;
  }

  fs::path folder_;
};

TEST_F(MapShelfTest, KeepsListsAndRemoves) {
  MapShelf shelf(folder_);
  EXPECT_TRUE(shelf.List().empty());
  ASSERT_TRUE(Save(shelf, kFirst, 100, "kitchen").ok());
  ASSERT_TRUE(Save(shelf, kSecond, 200).ok());
  const auto all = shelf.List();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].id, kSecond) << "newest first";
  EXPECT_EQ(all[1].name, "kitchen");
  EXPECT_EQ(all[1].landmarks, 2U);
  EXPECT_TRUE(all[1].metric);
  EXPECT_EQ(all[1].bytes, fs::file_size(folder_ / (std::string(kFirst) + ".map")));
  const auto kept = shelf.Load(kFirst);
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_EQ(kept->map.at_rest.size(), 1U);
  EXPECT_EQ(kept->map.known[0].known->point_in_world, Eigen::Vector3d(0.1, 0.2, 1.0));
  ASSERT_TRUE(shelf.Remove(kFirst).ok());
  EXPECT_EQ(shelf.Load(kFirst).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(shelf.Remove(kFirst).code(), absl::StatusCode::kNotFound);
}

TEST_F(MapShelfTest, OfThoseWithoutANameTheOldestGo) {
  MapShelf shelf(folder_);
  ASSERT_TRUE(Save(shelf, kFirst, 100).ok());
  ASSERT_TRUE(Save(shelf, kSecond, 200).ok());
  ASSERT_TRUE(Save(shelf, "2f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11", 50, "kept").ok());
  shelf.Thin(1);
  const auto all = shelf.List();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].id, kSecond);
  EXPECT_EQ(all[1].name, "kept");
}

TEST_F(MapShelfTest, WhatIsDamagedOrNewerIsRefusedByName) {
  MapShelf shelf(folder_);
  ASSERT_TRUE(Save(shelf, kFirst, 100).ok());
  const std::string whole = Read(kFirst);
  for (std::size_t at = 0; at < whole.size(); at += 97) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    Write(kFirst, damaged);
    EXPECT_FALSE(shelf.Load(kFirst).ok()) << at;
    Write(kFirst, whole.substr(0, at));
    const absl::Status cut = shelf.Load(kFirst).status();
    EXPECT_EQ(cut.code(), absl::StatusCode::kDataLoss) << at;
    EXPECT_THAT(std::string(cut.message()), HasSubstr(kFirst));
  }
  std::string newer = whole;
  newer[12] = 9;  // the version
  Write(kFirst, newer);
  const absl::Status refused = shelf.Load(kFirst).status();
  EXPECT_THAT(std::string(refused.message()), HasSubstr("version 9"));
  EXPECT_TRUE(shelf.List().empty());
  EXPECT_EQ(Read(kFirst), newer) << "and nothing is lost";
}

// The graph has a count for each keyframe from its first to its newest.
TEST_F(MapShelfTest, IdsThatLeaveNoRoomAreRefused) {
  for (const KeyframeId far : {KeyframeId{1} << 40, std::numeric_limits<KeyframeId>::max()}) {
    StoredMap map = SmallMap();
    map.keyframes.keyframes[far] = {};
    EXPECT_FALSE(DecodeMap(EncodeMap(map)).ok()) << far;
  }
  StoredMap map = SmallMap();
  map.known.back().id = std::numeric_limits<FeatureId>::max();
  EXPECT_FALSE(DecodeMap(EncodeMap(map)).ok());
  EXPECT_TRUE(DecodeMap(EncodeMap(SmallMap())).ok());
}

TEST_F(MapShelfTest, AnIdLeadsNowhereElse) {
  MapShelf shelf(folder_);
  for (const char* id : {"", "../../../etc/passwd", "../0f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d",
                         "0F1C2C9E-3D43-4D0A-9F5E-0C9B1A7F2D11"}) {
    EXPECT_EQ(shelf.Load(id).status().code(), absl::StatusCode::kInvalidArgument) << id;
    EXPECT_EQ(shelf.Remove(id).code(), absl::StatusCode::kInvalidArgument) << id;
  }
}

}  // namespace
}  // namespace saccade::map_shelf_test
