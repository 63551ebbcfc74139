// The desktop client's session, edits, pilot and decoder against a server in this process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "client/decode/player.hpp"
#include "client/session/edits.hpp"
#include "client/session/gaze_pilot.hpp"
#include "client/session/pointing.hpp"
#include "client/session/session.hpp"
#include "tests/integration/stream/in_process_server.hpp"

namespace saccade::client_session_test {
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

TEST(ClientSession, WhatIsSaidIsHeardAndWhatWasSaidBeforeIsKnown) {
  InProcessServer server;
  Expert first(server.address());
  ASSERT_TRUE(first.Until([&] { return first.state().link.live(); }));
  first.edits().Say("the left screw", "", [](const auto& said) { ASSERT_TRUE(said.ok()); });
  ASSERT_TRUE(first.Until([&] { return first.state().chat.messages().size() == 1; }));
  Expert second(server.address());
  ASSERT_TRUE(second.Until([&] { return second.state().chat.messages().size() == 1; }));
  EXPECT_EQ(second.state().chat.messages()[0].text, "the left screw");
  EXPECT_EQ(second.state().chat.messages()[0].display_name, "Tess");
  EXPECT_EQ(second.state().chat.Unread(second.state().joined.participant_id), 0u);
  second.edits().Say("here?", "", [](const auto& said) { ASSERT_TRUE(said.ok()); });
  ASSERT_TRUE(first.Until([&] { return first.state().chat.messages().size() == 2; }));
  EXPECT_EQ(first.state().chat.Unread(first.state().joined.participant_id), 1u);
}

TEST(ClientSession, ThePauseOfThePictureIsToldWithWhoDidIt) {
  InProcessServer server;
  Expert expert(server.address());
  ASSERT_TRUE(expert.Until([&] { return expert.picture().has_value(); }));
  EXPECT_FALSE(expert.state().pause);
  net::ConnectionOptions options;
  options.server = server.address();
  options.display_name = "Ann";
  options.role = net::Role::kWearer;
  const auto wearer = net::Connection::Create(options);
  ASSERT_TRUE(wearer.ok());
  ASSERT_TRUE((*wearer)->PausePicture(true).ok());
  ASSERT_TRUE(expert.Until([&] { return expert.state().pause.has_value(); }));
  EXPECT_EQ(expert.state().pause->by, "Ann");
  ASSERT_TRUE((*wearer)->PausePicture(false).ok());
  ASSERT_TRUE(expert.Until([&] { return !expert.state().pause; }));
}

TEST(ClientSession, AListIsTickedMarksOfOneGroupGoTogetherAndAStrokeIsSeenToGrow) {
  InProcessServer server;
  Expert expert(server.address()), other(server.address());
  ASSERT_TRUE(expert.Until([&] { return expert.picture().has_value(); }));
  ASSERT_TRUE(other.Until([&] { return other.state().link.live(); }));
  const FrameId frame = expert.picture()->facts->frame_id;
  std::vector<std::string> ids;
  for (const double u : {60.0, 100.0, 200.0}) {
    session::Edits::Placement placement;
    placement.draft.shape = AnnotationShape::kCheckList;
    placement.draft.check_items = {"drain", "fill"};
    placement.draft.target = PixelTarget{frame, {u, 120}};
    if (!ids.empty()) placement.edit_group = "both";
    expert.edits().Place(placement, [&ids](const absl::StatusOr<std::string>& placed) {
      ASSERT_TRUE(placed.ok()) << placed.status();
      ids.push_back(*placed);
    });
    if (u < 100) {
      ASSERT_TRUE(expert.Until([&] { return ids.size() == 1; }));
    }
  }
  ASSERT_TRUE(expert.Until([&] { return ids.size() == 3; }));
  other.edits().Tick(ids[1], 1, true, [](const auto& done) { ASSERT_TRUE(done.ok()); });
  ASSERT_TRUE(expert.Until([&] {
    const Annotation* mark = expert.state().annotations.Find(ids[1]);
    return mark != nullptr && mark->check_items && (*mark->check_items)[1].done;
  }));
  session::Pointing stroke(net::RandomUuid(), 0xff9a3dff);
  for (int i = 0; i < 20; ++i) stroke.Add(PixelTarget{frame, {100.0 + 4 * i, 120}});
  expert.edits().Point(*stroke.Due(MonotonicNow()), [&stroke](const auto& told) {
    ASSERT_TRUE(told.ok()) << told.status();
    stroke.Answered();
  });
  ASSERT_TRUE(other.Until([&] { return !other.state().pointers.List().empty(); }));
  EXPECT_TRUE(other.state().pointers.List()[0].sketch);
  EXPECT_GE(other.state().pointers.List()[0].points_in_world.size(), 2u);
  std::string said;
  const auto undo = [&] {
    said.clear();
    expert.edits().Undo([&said](const auto& done) { said = done.ok() ? *done : "refused"; });
    return expert.Until([&said] { return !said.empty(); });
  };
  ASSERT_TRUE(undo());
  EXPECT_THAT(said, ::testing::HasSubstr("1 of 2")) << "the other one ticked a line of one";
  EXPECT_THAT(said, ::testing::HasSubstr(ids[1].substr(0, 8))) << "which stays, and is named";
  ASSERT_TRUE(expert.Until([&] { return expert.state().annotations.Find(ids[2]) == nullptr; }));
  ASSERT_NE(expert.state().annotations.Find(ids[1]), nullptr);
  ASSERT_TRUE(undo());
  ASSERT_TRUE(expert.Until([&] { return expert.state().annotations.size() == 1; }));
  EXPECT_NE(expert.state().annotations.Find(ids[1]), nullptr);
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
}  // namespace saccade::client_session_test
