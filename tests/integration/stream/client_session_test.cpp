// The desktop client's session, edits, pilot and decoder against a server in this process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "client/decode/player.hpp"
#include "client/session/edits.hpp"
#include "client/session/gaze_pilot.hpp"
#include "client/session/session.hpp"
#include "tests/integration/stream/in_process_server.hpp"

namespace saccade {
namespace {

using namespace std::chrono_literals;
using testing::InProcessServer;

/// A client without a window: polls as the window does.
class Expert {
 public:
  explicit Expert(const std::string& address)
      : session_(OptionsFor(address), player_, [] {}), edits_(session_), pilot_(session_) {}

  template <typename Condition>
  bool Until(Condition condition, std::chrono::milliseconds limit = 10s) {
    for (const auto end = std::chrono::steady_clock::now() + limit;
         std::chrono::steady_clock::now() < end; std::this_thread::sleep_for(2ms)) {
      session_.Poll();
      pilot_.Check();
      if (auto picture = player_.Take()) picture_ = std::move(picture);
      if (condition()) return true;
    }
    return false;
  }
  session::State& state() { return session_.state(); }
  session::Edits& edits() { return edits_; }
  session::GazePilot& pilot() { return pilot_; }
  std::optional<decode::Picture>& picture() { return picture_; }

 private:
  static session::SessionOptions OptionsFor(const std::string& address) {
    session::SessionOptions options;
    options.connection.server = address;
    options.connection.display_name = "Tess";
    return options;
  }
  decode::Player player_{[] {}};
  session::Session session_;
  session::Edits edits_;
  session::GazePilot pilot_;
  std::optional<decode::Picture> picture_;
};

TEST(ClientSession, PicturesComeWithTheirOwnFramesPoseAndFeatures) {
  InProcessServer server;
  Expert expert(server.address());
  for (int i = 0; i < 10; ++i) {
    expert.picture().reset();
    ASSERT_TRUE(expert.Until([&] { return expert.picture().has_value(); })) << i;
    const net::FrameFacts& facts = *expert.picture()->facts;
    ASSERT_TRUE(facts.pose);
    EXPECT_EQ(facts.pose->frame_id, facts.frame_id);
    EXPECT_TRUE(facts.features);
    EXPECT_EQ(expert.picture()->rgba.cols, facts.camera->width());
    EXPECT_GT(facts.stages.captured_ns, 0);
  }
  ASSERT_TRUE(expert.Until([&] { return expert.state().clock.offset_ns().has_value(); }));
  EXPECT_LT(std::abs(*expert.state().clock.offset_ns()), 50'000'000) << "one machine, one clock";
  EXPECT_TRUE(expert.state().link.live());
  EXPECT_GE(expert.state().features.size(), 20u);
}

TEST(ClientSession, AMarkIsShownAtOnceAnsweredUndoneAndMadeAgain) {
  InProcessServer server;
  Expert expert(server.address());
  ASSERT_TRUE(expert.Until([&] { return expert.picture().has_value(); }));
  session::Edits::Placement placement;
  placement.draft.shape = AnnotationShape::kCube;
  placement.draft.target = PixelTarget{expert.picture()->facts->frame_id, {160, 120}};
  placement.guess_in_world = Eigen::Vector3d(0, 0, 2);
  std::string id;
  expert.edits().Place(placement, [&id](const absl::StatusOr<std::string>& placed) {
    ASSERT_TRUE(placed.ok()) << placed.status();
    id = *placed;
  });
  EXPECT_EQ(expert.state().annotations.Pending().size(), 1u) << "before any answer";
  ASSERT_TRUE(expert.Until([&] { return !id.empty(); }));
  EXPECT_TRUE(expert.state().annotations.Pending().empty());
  ASSERT_NE(expert.state().annotations.Find(id), nullptr);
  EXPECT_EQ(expert.state().annotations.Find(id)->author, "Tess");
  bool undone = false;
  expert.edits().Undo([&undone](const auto& done) { undone = done.ok(); });
  ASSERT_TRUE(expert.Until([&] { return undone && expert.state().annotations.size() == 0; }));
  bool redone = false;
  expert.edits().Redo([&redone](const auto& done) { redone = done.ok(); });
  ASSERT_TRUE(expert.Until([&] { return redone && expert.state().annotations.size() == 1; }));
}

TEST(ClientSession, WhatIsRefusedIsSaidAndTakenBack) {
  InProcessServer server;
  Expert expert(server.address());
  ASSERT_TRUE(expert.Until([&] { return expert.state().link.live(); }));
  absl::Status refused;
  expert.edits().Remove("6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11",
                        [&refused](const auto& done) { refused = done.status(); });
  ASSERT_TRUE(expert.Until([&] { return !refused.ok(); }));
  absl::Status no_head;
  expert.pilot().Run(&net::Connection::Home,
                     [&no_head](const auto& done) { no_head = done.status(); });
  ASSERT_TRUE(expert.Until([&] { return !no_head.ok(); })) << "there is no mount";
}

TEST(ClientSession, AServerThatGoesIsMissedInWordsAndWhatWasToldStays) {
  InProcessServer server;
  Expert expert(server.address());
  ASSERT_TRUE(expert.Until([&] { return expert.state().features.size() >= 20; }));
  server.Stop();
  ASSERT_TRUE(
      expert.Until([&] { return expert.state().link.kind == session::Link::Kind::kReconnecting; }));
  EXPECT_FALSE(expert.state().link.reason.empty());
  EXPECT_GE(expert.state().features.size(), 20u);
  EXPECT_TRUE(expert.state().Age(MonotonicNow()).has_value());
  absl::Status refused;
  expert.edits().Undo([&refused](const auto& done) { refused = done.status(); });
  EXPECT_TRUE(absl::IsUnavailable(refused)) << "at once";
}

}  // namespace
}  // namespace saccade
