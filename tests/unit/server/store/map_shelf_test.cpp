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

#include "server/store/map_transfer.hpp"

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

  /// A map whose file has several pieces.
  std::string LargeFile(const std::string& id) {
    StoredMap map = SmallMap();
    const DormantLandmark seen = map.at_rest.back();
    for (FeatureId more = 3; more < 3000; ++more) {
      map.at_rest.push_back(seen);
      map.at_rest.back().landmark.id = more;
      KeyframeGraph::Point point;
      point.anchor = 3;
      point.birth.id = more;
      map.keyframes.points[more] = point;
      map.keyframes.keyframes[3].births.push_back(more);
    }
    KeptMapFacts facts;
    facts.id = facts.world = id;
    facts.name = "Küche";
    return EncodeMapFile(facts, map);
  }
  static MapImportPiece Piece(const std::string& file, std::size_t offset, std::size_t size) {
    return {.upload_id = "af1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11",
            .total = file.size(),
            .offset = offset,
            .checksum = MapChecksum(file),
            .data = file.substr(offset, size)};
  }
  static absl::StatusOr<MapImportProgress> ImportAll(MapTransfer& transfer,
                                                     const std::string& file) {
    absl::StatusOr<MapImportProgress> progress = absl::InternalError("nothing was sent");
    for (std::size_t offset = 0; offset < file.size(); offset += kPiece) {
      progress = transfer.Import(Piece(file, offset, kPiece), now_);
      if (!progress.ok()) return progress;
    }
    return progress;
  }
  bool Any(const std::string& ending) const {
    std::error_code error;
    for (const auto& each : fs::directory_iterator(folder_, error)) {
      if (each.path().extension() == ending) return true;
    }
    return false;
  }

  static constexpr std::size_t kPiece = MapTransfer::kMostTaken;
  static inline const MapTransfer::Time now_ = std::chrono::steady_clock::now();
  fs::path folder_;
};

TEST_F(MapShelfTest, SurfacesGoWithTheirMapAndDamageInThemIsFound) {
  SurfaceChunk chunk;
  chunk.index = {-1, 0, 2};
  chunk.origin_in_world = {-0.5f, 0.0f, 1.0f};
  chunk.step_m = 0.001f;
  chunk.positions = {{0, 0, 0}, {9, 0, 0}, {0, 9, 1}};
  chunk.colors_rgb = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  chunk.triangles = {{0, 1, 2}};
  SurfaceSnapshot surface;
  surface.voxel = 0.015f;
  surface.chunks[chunk.index] = std::make_shared<const SurfaceChunk>(chunk);
  surface.chunks[{7, 7, 7}] = std::make_shared<const SurfaceChunk>();  // nothing is there any more

  MapShelf shelf(folder_);
  KeptMapFacts facts;
  facts.id = facts.world = kFirst;
  ASSERT_TRUE(shelf.Save(facts, SmallMap(), &surface).ok());
  const auto kept = shelf.Load(kFirst);
  ASSERT_TRUE(kept.ok()) << kept.status();
  ASSERT_NE(kept->surface, nullptr);
  EXPECT_EQ(kept->surface->voxel, 0.015f);
  ASSERT_EQ(kept->surface->chunks.size(), 1U);
  const SurfaceChunk& read = *kept->surface->chunks.at(chunk.index);
  EXPECT_EQ(read.positions, chunk.positions);
  EXPECT_EQ(read.colors_rgb, chunk.colors_rgb);
  EXPECT_EQ(read.triangles, chunk.triangles);
  EXPECT_EQ(read.origin_in_world, chunk.origin_in_world);
  ASSERT_EQ(shelf.List().size(), 1U);

  const std::string good = Read(kFirst);
  for (std::size_t back = 1; back < 90; back += 4) {
    std::string bad = good;
    bad[bad.size() - back] = static_cast<char>(~bad[bad.size() - back]);
    Write(kFirst, bad);
    EXPECT_TRUE(absl::IsDataLoss(shelf.Load(kFirst).status())) << back;
  }
  Write(kFirst, good.substr(0, good.size() - 1));
  EXPECT_TRUE(absl::IsDataLoss(shelf.Load(kFirst).status()));
  // Without surfaces it is what an older server reads.
  ASSERT_TRUE(Save(shelf, kSecond, 1).ok());
  EXPECT_EQ(Read(kSecond)[12], 1);
  EXPECT_EQ(shelf.Load(kSecond)->surface, nullptr);
}

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

TEST_F(MapShelfTest, AFileGoesOutAndComesInElsewhereByteForByte) {
  MapShelf shelf(folder_);
  MapTransfer transfer(shelf);
  const std::string file = LargeFile(kFirst);
  ASSERT_GT(file.size(), 2 * MapTransfer::kMostSent);
  const auto progress = ImportAll(transfer, file);
  ASSERT_TRUE(progress.ok()) << progress.status();
  ASSERT_TRUE(progress->whole.has_value());
  EXPECT_EQ(progress->whole->name, "Küche");
  EXPECT_EQ(progress->whole->landmarks, 2999U);
  EXPECT_EQ(Read(kFirst), file);
  EXPECT_EQ(fs::status(shelf.FileOf(kFirst)).permissions(),
            fs::perms::owner_read | fs::perms::owner_write);

  std::string out;
  MapFileRequest request{.id = kFirst};
  for (int piece = 0; piece == 0 || out.size() < file.size(); ++piece) {
    const auto read = transfer.Read(request, now_);
    ASSERT_TRUE(read.ok()) << read.status();
    out += read->data;
    request = {.id = kFirst, .offset = out.size(), .checksum = read->checksum};
    // Another one in its place: what was begun goes on.
    if (piece == 0) {
      ASSERT_TRUE(Save(shelf, kFirst, 5).ok());
    }
  }
  EXPECT_EQ(out, file);
  request.checksum ^= 1;
  EXPECT_EQ(transfer.Read(request, now_).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(transfer.Read({.id = kSecond}, now_).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(MapShelfTest, WhatMustNotComeInIsRefusedAndLeavesNothing) {
  MapShelf shelf(folder_);
  MapTransfer transfer(shelf);
  const std::string file = LargeFile(kFirst);
  const auto refused = [&](std::string bytes, absl::StatusCode code, const char* words) {
    const absl::Status status = ImportAll(transfer, bytes).status();
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(words));
    EXPECT_FALSE(Any(".part") || Any(".map")) << words;
  };
  std::string changed = file;
  changed[file.size() - 5] ^= 1;
  refused(changed, absl::StatusCode::kDataLoss, "file: is damaged");
  changed = file;
  changed[12] = 9;
  refused(changed, absl::StatusCode::kDataLoss, "file: is of version 9");
  refused(file.substr(0, file.size() - 1), absl::StatusCode::kDataLoss, "file: is damaged");
  refused("P6 640 480 255", absl::StatusCode::kDataLoss, "file: is no map");

  // On its way it became another.
  ASSERT_TRUE(transfer.Import(Piece(file, 0, kPiece), now_).ok());
  EXPECT_TRUE(Any(".part"));
  MapImportPiece rest = Piece(file, kPiece, kPiece);
  EXPECT_EQ(transfer.Import(Piece(file, 2 * kPiece, kPiece), now_).status().code(),
            absl::StatusCode::kAborted)
      << "not the one that is next";
  rest.data[7] ^= 1;
  absl::StatusOr<MapImportProgress> last = transfer.Import(rest, now_);
  for (std::size_t at = 2 * kPiece; last.ok() && at < file.size(); at += kPiece) {
    last = transfer.Import(Piece(file, at, kPiece), now_);
  }
  EXPECT_THAT(std::string(last.status().message()), HasSubstr("file_crc32"));
  EXPECT_FALSE(Any(".part") || Any(".map"));

  MapImportPiece huge = Piece(file, 0, kPiece);
  huge.total = kMostMapBytes + 1;
  EXPECT_THAT(std::string(transfer.Import(huge, now_).status().message()),
              HasSubstr("total_bytes"));
  huge = Piece(file, 0, kPiece);
  huge.upload_id = "../../../../../../../etc/cron.d/xxxxx";
  EXPECT_THAT(std::string(transfer.Import(huge, now_).status().message()), HasSubstr("upload_id"));

  ASSERT_TRUE(ImportAll(transfer, file).ok());
  const absl::Status again = transfer.Import(Piece(file, 0, kPiece), now_).status();
  EXPECT_EQ(again.code(), absl::StatusCode::kAlreadyExists) << "at its first piece";
  EXPECT_THAT(std::string(again.message()), HasSubstr(kFirst));
  EXPECT_EQ(Read(kFirst), file);
}

TEST_F(MapShelfTest, WhoDoesNotGoOnMakesRoom) {
  MapShelf shelf(folder_);
  {
    MapTransfer transfer(shelf);
    const std::string file = LargeFile(kFirst);
    const auto begin = [&](char first, MapTransfer::Time when) {
      MapImportPiece piece = Piece(file, 0, kPiece);
      piece.upload_id[0] = first;
      return transfer.Import(piece, when).status();
    };
    for (const char first : {'a', 'b', 'c', 'd'}) EXPECT_TRUE(begin(first, now_).ok());
    EXPECT_EQ(begin('e', now_).code(), absl::StatusCode::kResourceExhausted);
    EXPECT_TRUE(begin('d', now_).ok()) << "anew";
    EXPECT_TRUE(begin('e', now_ + MapTransfer::kPatience + std::chrono::seconds(1)).ok());
    EXPECT_TRUE(Any(".part"));
  }
  EXPECT_FALSE(Any(".part"));
  // What a killed server left goes with the next upload.
  Write("killed", "");
  fs::rename(folder_ / "killed.map", folder_ / "killed.part");
  MapTransfer transfer(shelf);
  ASSERT_TRUE(ImportAll(transfer, LargeFile(kFirst)).ok());
  EXPECT_FALSE(Any(".part"));
}

TEST_F(MapShelfTest, ANameThatNobodyCanShowIsDamage) {
  for (const std::string& name : {std::string("\xff"), std::string("\xc3"), std::string(201, 'a'),
                                  std::string("\xed\xa0\x80"), std::string("\xc0\xaf")}) {
    KeptMapFacts facts;
    facts.id = facts.world = kFirst;
    facts.name = name;
    EXPECT_FALSE(DecodeMapFacts("file", EncodeMapFile(facts, SmallMap())).ok()) << name;
  }
  KeptMapFacts facts;
  facts.id = facts.world = kFirst;
  facts.name = "Küche 厨房 \xf0\x9f\x94\xa7";
  EXPECT_TRUE(DecodeMapFacts("file", EncodeMapFile(facts, SmallMap())).ok());
}

}  // namespace
}  // namespace saccade::map_shelf_test
