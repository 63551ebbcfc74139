// What the desktop client changes of the scene, against a server in this process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "client/decode/player.hpp"
#include "client/session/marker_fixing.hpp"
#include "client/session/session.hpp"
#include "client/session/thing_edits.hpp"
#include "tests/integration/stream/in_process_server.hpp"

namespace saccade::client_things_test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using Told = absl::StatusOr<session::ThingEdits::Told>;
using Done = session::ThingEdits::Done;

class ClientThings : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(Until([&] { return session_.state().link.live(); }));
    SceneObject crate;
    crate.name = "crate";
    crate.size_m = {0.4, 0.2, 0.3};
    crate.parent_from_object = place_;
    ASSERT_EQ(Says([&](const Done& done) {
                things_.Put(
                    crate, [](const SceneObject& put) { return put.name; }, done);
              }),
              "crate");
  }

  bool Until(const std::function<bool()>& condition) {
    for (const auto end = std::chrono::steady_clock::now() + 10s;
         std::chrono::steady_clock::now() < end; std::this_thread::sleep_for(2ms)) {
      session_.Poll();
      if (condition()) return true;
    }
    return false;
  }
  /// What is said of one change, once the stream has told of it too.
  std::string Says(const std::function<void(Done)>& change) {
    std::optional<std::string> words;
    const std::uint64_t before = session_.state().scene.version();
    bool changes = true;
    change([&](const Told& told) {
      changes = told.ok();
      words = told.ok() ? told->words : std::string(told.status().message());
    });
    EXPECT_TRUE(
        Until([&] { return words && (!changes || session_.state().scene.version() > before); }));
    return words.value_or("");
  }
  const SceneObject& Crate() { return session_.state().scene.scene().objects.at(0); }
  bool IsAt(const Rigid3& pose) {
    return (Crate().parent_from_object.translation - pose.translation).norm() < 1e-6;
  }
  /// `late`: the marker's time is over.
  std::string Fix(bool late, std::span<const MarkerPose> markers) {
    return Says([&](const Done& done) {
      markers_.Fix(Crate(), {"apriltag36h11", 3, 0.08}, place_, done);
      ASSERT_TRUE(Until([&] { return markers_.waiting(); }));
      const Timestamp now_ns = MonotonicNow() + (late ? 60'000'000'000 : 0);
      markers_.Check(now_ns, {});
      EXPECT_EQ(markers_.waiting(), !late);
      markers_.Check(now_ns, markers);
    });
  }

  testing::InProcessServer server_;
  decode::Player player_{[] {}};
  session::Session session_{[this] {
                              session::SessionOptions options;
                              options.connection.server = server_.address();
                              options.connection.display_name = "Tess";
                              return options;
                            }(),
                            player_, [] {}};
  session::ThingEdits things_{session_};
  session::MarkerFixing markers_{things_};
  const Rigid3 place_{Eigen::Quaterniond::Identity(), {0, 0, 2}};
};

TEST_F(ClientThings, AreRegisteredByPairsWithTheErrorToldBeforeTheyAreMoved) {
  const Rigid3 truth{Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY())),
                     {0.3, 0.1, 2.5}};
  std::vector<net::PointPair> pairs;
  for (const Eigen::Vector3d& corner :
       {Eigen::Vector3d(0.2, 0, 0.15), Eigen::Vector3d(-0.2, 0, 0.15),
        Eigen::Vector3d(0.2, -0.2, -0.15), Eigen::Vector3d(-0.2, -0.2, 0.15)}) {
    pairs.push_back({corner, truth * corner});
  }
  std::optional<absl::StatusOr<net::RegisteredThing>> found;
  things_.TryRegister(Crate().id, pairs, false, [&](const auto& told) { found = told; });
  ASSERT_TRUE(Until([&] { return found.has_value(); }));
  ASSERT_TRUE(found->ok()) << found->status();
  EXPECT_LT((*found)->rms_mm, 0.01);
  EXPECT_EQ((*found)->errors_mm.size(), 4u);
  EXPECT_TRUE(IsAt(place_)) << "not accepted yet";
  EXPECT_EQ(Says([&](const Done& done) { things_.Register(Crate().id, pairs, false, done); }),
            "crate registered: 0.0 mm");
  EXPECT_TRUE(IsAt(truth));
  Says([&](const Done& done) { things_.Undo(done); });
  EXPECT_TRUE(IsAt(place_));
}

TEST_F(ClientThings, AreFixedToAMarkerWhereTheyAreAndThatIsOneStepOfUndo) {
  const MarkerPose seen{"apriltag36h11", 3, {Eigen::Quaterniond::Identity(), {1, 0, 2}}, 1};
  EXPECT_EQ(Fix(false, {&seen, 1}), "crate moves with apriltag36h11 3");
  const Rigid3 on_marker{Eigen::Quaterniond::Identity(), {-1, 0, 0}};
  ASSERT_TRUE(Until([&] { return IsAt(on_marker); }));
  EXPECT_EQ(Crate().parent, SceneParent::kMarker);
  EXPECT_EQ(Says([&](const Done& done) { markers_.LetGo(Crate(), place_, done); }),
            "crate stands by itself");
  EXPECT_EQ(Crate().parent, SceneParent::kWorld);
  Says([&](const Done& done) { things_.Undo(done); });
  EXPECT_EQ(Crate().parent, SceneParent::kMarker);
  Says([&](const Done& done) { things_.Undo(done); });
  EXPECT_EQ(Crate().parent, SceneParent::kWorld);
  EXPECT_TRUE(IsAt(place_));
}

TEST_F(ClientThings, StayByThemselvesWhereNoMarkerIsSeen) {
  EXPECT_THAT(Fix(true, {}), HasSubstr("apriltag36h11 3 was not seen within 6 s; show it"));
  ASSERT_TRUE(Until([&] { return Crate().parent == SceneParent::kWorld; }));
  EXPECT_TRUE(IsAt(place_));
  EXPECT_THAT(Says([&](const Done& done) {
                markers_.Fix(Crate(), {"apriltag36h11", 3, 0}, place_, done);
              }),
              HasSubstr("side of its black border"));
}

}  // namespace
}  // namespace saccade::client_things_test
