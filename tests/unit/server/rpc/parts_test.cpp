// Large states go in parts, whoever comes in between; what is behind needs no table of its own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "server/rpc/deltas.hpp"
#include "shared/wire/to_proto.hpp"
#include "tests/unit/server/rpc/packets.hpp"

namespace saccade::parts_test {
namespace {

using testing::MakeTracked;

constexpr std::size_t kDefaultReceiveLimit = 4 << 20;  // of a gRPC client

Annotation MakeStroke(int i, std::size_t points) {
  Annotation stroke;
  stroke.id = "6f1c2c9e-3d43-4d0a-9f5e-" + std::to_string(100000000000 + i);
  stroke.shape = AnnotationShape::kInk;
  stroke.text = "where the seal is";
  stroke.author = "Ann";
  stroke.created_unix_ns = i;
  stroke.revision = 1;
  stroke.anchor.point_in_world = {0.1 * i, 0.2, 1.3};
  stroke.anchor.covariance_in_world = 1e-4 * Eigen::Matrix3d::Identity();
  stroke.anchor.error_m = 0.01;
  stroke.anchor.error_px = 3.0;
  stroke.anchor.pixel = Eigen::Vector2d(320, 240);
  InkStroke::Points ink;
  for (std::size_t k = 0; k < points; ++k) ink.emplace_back(1e-4 * k, 0.01, -0.02 * i);
  stroke.ink_offset_m = std::move(ink);
  return stroke;
}

// What a page makes of the events.
struct Book {
  std::map<std::string, v1::Annotation> known;
  void Apply(const v1::AnnotationEvent& event) {
    if (event.full()) known.clear();
    for (const v1::Annotation& one : event.upserted()) known[one.id()] = one;
    for (const v1::AnchorUpdate& update : event.anchors()) {
      const auto at = known.find(update.id());
      ASSERT_NE(at, known.end()) << "an estimate of what was never sent";
      *at->second.mutable_anchor() = update.anchor();
    }
    for (const std::string& id : event.removed_ids()) known.erase(id);
  }
};

class AnnotationParts : public ::testing::Test {
 protected:
  NumberedState Publish(Timestamp now_ns = 0) {
    TrackedEvent event = MakeTracked(1);
    event.annotations = std::make_shared<AnnotationList>(list_);
    return log_.Next(event, now_ns);
  }
  // Reads until nothing is due; how many events, and the largest of them.
  int Drain(const NumberedState& state, AnnotationReader& reader, Book& book) {
    v1::AnnotationEvent event;
    int events = 0;
    bool more = true;
    while (more && reader.Next(state, event)) {
      ++events;
      more = event.more();
      largest_ = std::max(largest_, event.ByteSizeLong());
      bytes_ += event.ByteSizeLong();
      EXPECT_EQ(event.full() && events > 1, false) << "full is said once";
      book.Apply(event);
    }
    return events;
  }
  void ExpectSame(const Book& book) {
    ASSERT_EQ(book.known.size(), list_.size());
    for (const Annotation& one : list_) {
      const auto at = book.known.find(one.id);
      ASSERT_NE(at, book.known.end()) << one.id;
      EXPECT_EQ(at->second.revision(), one.revision);
      EXPECT_EQ(static_cast<std::size_t>(at->second.ink_offset_m_size()), one.ink_offset_m.size());
    }
  }

  AnnotationList list_;
  ChangeLog log_;
  std::size_t largest_ = 0, bytes_ = 0;
};

TEST_F(AnnotationParts, NinetyLongStrokesNeedNoEventThatAReceiverRefuses) {
  for (int i = 0; i < 90; ++i) list_.push_back(MakeStroke(i, 2000));
  AnnotationReader reader;
  Book book;
  const int events = Drain(Publish(), reader, book);
  EXPECT_GT(bytes_, kDefaultReceiveLimit) << "in one event nobody could have taken it";
  EXPECT_GT(events, 20);
  EXPECT_LE(events, 30);
  EXPECT_LE(largest_, kPartBytes);
  EXPECT_GT(largest_, kPartBytes / 2) << "parts are not smaller than they need be";
  ExpectSame(book);
  RecordProperty("parts", events);
  RecordProperty("largest_part_bytes", static_cast<int>(largest_));
}

TEST_F(AnnotationParts, EstimatesOfSizeAreUpperBounds) {
  for (const std::size_t points : {0, 1, 17, 2000}) {
    Annotation one = MakeStroke(3, points);
    one.text.assign(500, 'x');
    one.author.assign(60, 'y');
    one.anchor.reason.assign(80, 'z');
    one.created_unix_ns = std::numeric_limits<std::int64_t>::max();
    one.revision = std::numeric_limits<std::uint64_t>::max();
    const std::size_t encoded = wire::ToProto(one).ByteSizeLong();
    EXPECT_LE(encoded, EncodedBytes(one));
    EXPECT_GE(encoded + 150, EncodedBytes(one)) << points << ": parts would be half empty";
  }
}

TEST_F(AnnotationParts, EstimatesHoldForEveryShape) {
  for (int shape = 0; shape < kAnnotationShapes; ++shape) {
    Annotation one = MakeStroke(3, shape == static_cast<int>(AnnotationShape::kMeasure) ? 1 : 0);
    one.shape = static_cast<AnnotationShape>(shape);
    one.author_person_id.assign(36, 'p');
    one.author.assign(60, 'y');
    one.created_unix_ns = std::numeric_limits<std::int64_t>::max();
    one.revision = std::numeric_limits<std::uint64_t>::max();
    one.locked = true;
    if (one.shape == AnnotationShape::kBox || one.shape == AnnotationShape::kArrow) {
      one.world_from_mark = Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5);
    }
    one.extent_m = {0.1, 0.2, 0.3};
    if (one.shape == AnnotationShape::kPin) one.number = 0xffffffff;
    if (one.shape == AnnotationShape::kMeasure) one.length_m = one.length_sigma_m = 0.1;
    if (one.shape == AnnotationShape::kPicture) {
      one.picture = std::make_shared<Picture>(
          Picture{std::string(64, 'f'), "image/jpeg", 4096, 4096, std::string(1000, 'x')});
    }
    if (one.shape == AnnotationShape::kCheckList) {
      one.check_items = std::make_shared<std::vector<CheckItem>>(
          30, CheckItem{std::string(100, 't'), true, std::string(60, 'n'),
                        std::numeric_limits<std::int64_t>::max()});
    }
    EXPECT_LE(wire::ToProto(one).ByteSizeLong(), EncodedBytes(one)) << ToString(one.shape);
  }
}

TEST_F(AnnotationParts, EditsAndDeletionsBetweenTwoPartsArriveToo) {
  for (int i = 0; i < 40; ++i) list_.push_back(MakeStroke(i, 2000));
  AnnotationReader reader;
  Book book;
  std::mt19937 random(5);
  v1::AnnotationEvent event;
  int next = 40;
  NumberedState state = Publish();
  for (int part = 0; part < 400 && reader.Next(state, event); ++part) {
    book.Apply(event);
    if (part < 60) {
      list_.erase(list_.begin() + static_cast<std::ptrdiff_t>(random() % list_.size()));
      list_.push_back(MakeStroke(next++, 1500));
      list_[random() % list_.size()].revision += 1;
      state = Publish();
    } else if (!event.more()) {
      break;
    }
  }
  EXPECT_FALSE(event.more());
  ExpectSame(book);
}

TEST_F(AnnotationParts, ALiveEstimateGoesWithoutTheStroke) {
  for (int i = 0; i < 20; ++i) list_.push_back(MakeStroke(i, 2000));
  AnnotationReader reader;
  Book book;
  Drain(Publish(), reader, book);
  for (Annotation& one : list_) one.anchor.point_in_world.x() += 0.05;
  bytes_ = 0;
  const NumberedState moved = Publish(1);
  EXPECT_EQ(Drain(moved, reader, book), 1);
  EXPECT_LT(bytes_, 20u * 300u) << "whole strokes would be 1.2 MB";
  EXPECT_NEAR(book.known.at(list_[7].id).anchor().point_in_world_m().x(), 0.75, 1e-9);
  ExpectSame(book);
  // An edit of one goes whole; who comes only now has all of them whole.
  list_[3].text = "another";
  list_[3].revision = 2;
  bytes_ = 0;
  const NumberedState edited = Publish(2);
  Drain(edited, reader, book);
  EXPECT_GT(bytes_, 50'000u);
  EXPECT_LT(bytes_, 70'000u);
  EXPECT_EQ(book.known.at(list_[3].id).text(), "another");
  AnnotationReader late;
  Book late_book;
  Drain(edited, late, late_book);
  ExpectSame(late_book);
}

// Every estimate moves in every frame while the first state is still going out, a part a frame.
TEST_F(AnnotationParts, ALivelyStateStarvesNobodyOfItsTail) {
  for (int i = 0; i < 200; ++i) list_.push_back(MakeStroke(i, 500));
  AnnotationReader reader;
  Book book;
  v1::AnnotationEvent event;
  std::map<std::string, int> whole;
  int frames = 0;
  do {
    for (Annotation& one : list_) one.anchor.point_in_world.x() += 0.05;
    ASSERT_TRUE(reader.Next(Publish(frames), event));
    for (const v1::Annotation& one : event.upserted()) ++whole[one.id()];
    book.Apply(event);
  } while (event.more() && ++frames < 100);
  EXPECT_LT(frames, 20) << "3 MB in parts of 256 KiB";
  ExpectSame(book);
  for (const auto& [id, times] : whole) EXPECT_EQ(times, 1) << id;
  EXPECT_NEAR(book.known.at(list_[0].id).anchor().point_in_world_m().x(),
              list_[0].anchor.point_in_world.x(), 1e-9);
}

TEST_F(AnnotationParts, ARevisionThatIsUsedAgainIsNotTakenForKnown) {
  list_ = {MakeStroke(0, 10)};
  AnnotationReader reader;
  Book book;
  list_[0].revision = 2;
  list_[0].text = "refused by the disk";
  Drain(Publish(), reader, book);
  list_[0].text = "kept";  // rolled back to 1, then edited: 2 again
  Drain(Publish(), reader, book);
  EXPECT_EQ(book.known.at(list_[0].id).text(), "kept");
}

TEST_F(AnnotationParts, DeletedAndUndoneIsThereForTheSlowToo) {
  list_ = {MakeStroke(0, 10), MakeStroke(1, 10)};
  AnnotationReader reader;
  Book book;
  Drain(Publish(), reader, book);
  const Annotation taken = list_[0];
  list_.erase(list_.begin());
  Publish();  // this reader is too slow to see it
  list_.insert(list_.begin(), taken);
  list_[0].revision += 2;
  Drain(Publish(), reader, book);
  ExpectSame(book);
}

TEST_F(AnnotationParts, WhoIsTooFarBehindBeginsAnew) {
  list_ = {MakeStroke(0, 10)};
  AnnotationReader reader;
  Book book;
  Drain(Publish(), reader, book);
  for (int i = 1; i < 2 * static_cast<int>(ChangeLog::kKeptRemovals); i += 100) {
    for (int k = 0; k < 100; ++k) list_.push_back(MakeStroke(i + k, 2));
    Publish();
    list_.resize(1);
    Publish();
  }
  const NumberedState state = Publish();
  EXPECT_LE(state.annotations->removed->size(), ChangeLog::kKeptRemovals);
  v1::AnnotationEvent event;
  ASSERT_TRUE(reader.Next(state, event));
  EXPECT_TRUE(event.full());
  EXPECT_EQ(event.removed_ids_size(), 0);
  book.Apply(event);
  ExpectSame(book);
}

MapSnapshot LargeMap(std::size_t features) {
  MapSnapshot map;
  map.features.resize(features);
  for (std::size_t i = 0; i < features; ++i) {
    FeatureSnapshot& feature = map.features[i];
    feature.id = 4'000'000'000 + i;
    feature.point_in_world = Eigen::Vector3d(1.0 / 3.0 * static_cast<double>(i), 2.0 / 3.0, 1.1);
    feature.covariance_in_world = 1.0 / 3.0 * Eigen::Matrix3d::Ones();
    feature.pixel = Eigen::Vector2d(100.0 / 3.0, 200.0 / 3.0);
    feature.depth_known = true;
    feature.matched_count = 4'000'000'000;
  }
  return map;
}

TEST(MapParts, ALargeMapGoesInParts) {
  TrackedEvent event = MakeTracked(1);
  event.snapshot = std::make_shared<MapSnapshot>(LargeMap(20'000));
  ChangeLog log;
  MapReader reader;
  const NumberedState state = log.Next(event, 0);
  v1::MapDelta delta;
  std::set<FeatureId> received;
  int parts = 0;
  do {
    ASSERT_TRUE(reader.Next(state, delta));
    EXPECT_EQ(delta.full(), parts == 0);
    EXPECT_LE(delta.ByteSizeLong(), kPartBytes);
    for (const v1::Feature& feature : delta.upserted()) received.insert(feature.id());
    ++parts;
  } while (delta.more() && parts < 100);
  EXPECT_EQ(received.size(), 20'000u);
  EXPECT_GE(parts, 8);
  EXPECT_FALSE(reader.Next(state, delta));
}

TEST(MapParts, AResetBetweenTwoPartsIsANewMap) {
  TrackedEvent event = MakeTracked(1);
  event.snapshot = std::make_shared<MapSnapshot>(LargeMap(5000));
  ChangeLog log;
  MapReader reader;
  v1::MapDelta delta;
  ASSERT_TRUE(reader.Next(log.Next(event, 0), delta));
  ASSERT_TRUE(delta.more());
  auto fresh = std::make_shared<MapSnapshot>(LargeMap(3));
  fresh->map_generation = 1;
  event.snapshot = fresh;
  ASSERT_TRUE(reader.Next(log.Next(event, 0), delta));
  EXPECT_TRUE(delta.full());
  EXPECT_FALSE(delta.more());
  EXPECT_EQ(delta.upserted_size(), 3);
  EXPECT_EQ(delta.removed_ids_size(), 0);
}

// MapService.Get and Export answer in one message: a map of 3000 landmarks (DormantOptions) and 250
// features in the filter stay far below what a client takes.
TEST(MapParts, ThreeThousandLandmarksAtRestFitIntoOneAnswer) {
  const v1::MapDelta whole = FullMap(LargeMap(3250));
  EXPECT_EQ(whole.upserted_size(), 3250);
  EXPECT_LT(whole.ByteSizeLong(), kDefaultReceiveLimit / 4);
  RecordProperty("bytes", static_cast<int>(whole.ByteSizeLong()));
}

// A subscriber that is up to date costs by what changed, not by what there is.
TEST_F(AnnotationParts, WhatDoesNotChangeCostsASubscriberNothing) {
  const auto cost = [](int strokes, std::size_t points) {
    AnnotationList list;
    for (int i = 0; i < strokes; ++i) list.push_back(MakeStroke(i, points));
    TrackedEvent event = MakeTracked(1);
    event.annotations = std::make_shared<AnnotationList>(list);
    ChangeLog log;
    AnnotationReader reader;
    v1::AnnotationEvent delta;
    NumberedState state = log.Next(event, 0);
    while (reader.Next(state, delta) && delta.more()) {
    }
    std::int64_t best_ns = std::numeric_limits<std::int64_t>::max();
    for (int frame = 1; frame < 60; ++frame) {
      list[0].anchor.point_in_world.x() += 0.05;
      event.annotations = std::make_shared<AnnotationList>(list);
      state = log.Next(event, frame);
      std::vector<AnnotationReader> readers(50, reader);
      const auto begin = std::chrono::steady_clock::now();
      for (AnnotationReader& one : readers) EXPECT_TRUE(one.Next(state, delta));
      const auto took = std::chrono::steady_clock::now() - begin;
      best_ns = std::min<std::int64_t>(best_ns, took / std::chrono::nanoseconds(1));
      EXPECT_EQ(delta.anchors_size(), points > 0 ? 1 : 0);
      reader = readers.back();
    }
    return best_ns;
  };
  const auto few = cost(1, 2);
  const auto many = cost(1000, 240);
  RecordProperty("ratio_percent", static_cast<int>(100 * many / few));
  EXPECT_LT(many, 4 * few) << "1000 strokes: " << many << " ns, one: " << few << " ns";
}

}  // namespace
}  // namespace saccade::parts_test
