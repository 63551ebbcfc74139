// Gaze over real gRPC sockets: server in process, a simulated head that moves by the clock.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "server/mount/drivers/sim_mount.hpp"
#include "tests/integration/stream/in_process_server.hpp"
#include "tests/integration/stream/test_client.hpp"

namespace saccade::gaze_integration_test {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;
using testing::InProcessOptions;
using testing::InProcessServer;
using testing::ReceivedEvent;
using testing::TestClient;

/// A client with the gaze service, and a thread for its heartbeats.
class Pilot {
 public:
  explicit Pilot(const std::string& address, v1::Role role = v1::ROLE_EXPERT)
      : client_(address, role),
        gaze_(v1::GazeService::NewStub(
            grpc::CreateChannel(address, grpc::InsecureChannelCredentials()))) {}
  ~Pilot() { Fall(); }

  TestClient& client() { return client_; }
  v1::GazeService::Stub& gaze() { return *gaze_; }

  v1::AcquireLeaseResponse Acquire(const std::string& lease_id = "") {
    grpc::ClientContext context;
    v1::AcquireLeaseRequest request;
    request.set_session_id(client_.session_id());
    request.set_lease_id(lease_id);
    v1::AcquireLeaseResponse response;
    status_ = gaze_->AcquireLease(&context, request, &response);
    return response;
  }
  const grpc::Status& status() const { return status_; }

  /// Acquires and renews every 100 ms until Fall().
  bool Rise() {
    const v1::AcquireLeaseResponse lease = Acquire();
    if (!lease.granted()) return false;
    heart_ = std::jthread([this, id = lease.lease_id()](std::stop_token stop) {
      while (!stop.stop_requested()) {
        grpc::ClientContext context;
        v1::AcquireLeaseRequest request;
        request.set_session_id(client_.session_id());
        request.set_lease_id(id);
        v1::AcquireLeaseResponse response;
        gaze_->AcquireLease(&context, request, &response);
        std::this_thread::sleep_for(milliseconds(100));
      }
    });
    return true;
  }
  /// Vanishes: no heartbeat, no goodbye.
  void Fall() {
    heart_.request_stop();
    if (heart_.joinable()) heart_.join();
  }

  grpc::Status Fixate(double x, double y, double z, bool fast = true) {
    v1::FixateRequest request;
    v1::Vector3& point = *request.mutable_target()->mutable_point_in_world_m();
    point.set_x(x);
    point.set_y(y);
    point.set_z(z);
    request.set_fast(fast);
    return Fixate(request);
  }
  grpc::Status Fixate(v1::FixateRequest request) {
    grpc::ClientContext context;
    request.set_session_id(client_.session_id());
    v1::FixateResponse response;
    return gaze_->Fixate(&context, request, &response);
  }
  template <typename Request, typename Response>
  grpc::Status Call(grpc::Status (v1::GazeService::Stub::*method)(grpc::ClientContext*,
                                                                  const Request&, Response*),
                    Request request = {}) {
    grpc::ClientContext context;
    request.set_session_id(client_.session_id());
    Response response;
    return ((*gaze_).*method)(&context, request, &response);
  }
  v1::GazeState State() {
    grpc::ClientContext context;
    v1::GetGazeStateResponse response;
    EXPECT_TRUE(gaze_->GetState(&context, {}, &response).ok());
    return response.state();
  }
  bool WaitForState(const std::function<bool(const v1::GazeState&)>& wanted,
                    milliseconds limit = std::chrono::seconds(5)) {
    const auto end = std::chrono::steady_clock::now() + limit;
    while (std::chrono::steady_clock::now() < end) {
      if (wanted(State())) return true;
      std::this_thread::sleep_for(milliseconds(10));
    }
    return false;
  }

 private:
  TestClient client_;
  std::unique_ptr<v1::GazeService::Stub> gaze_;
  grpc::Status status_;
  std::jthread heart_;
};

InProcessOptions WithHead(std::shared_ptr<SimMount>* head = nullptr) {
  SimMountOptions options;
  options.wall_clock = true;
  auto mount = std::make_shared<SimMount>(options);
  if (head != nullptr) *head = mount;
  InProcessOptions server;
  server.mount = mount;
  return server;
}

TEST(Gaze, WithoutAMountEverythingSaysSo) {
  InProcessServer server;
  Pilot pilot(server.address());
  EXPECT_EQ(pilot.State().mode(), v1::GAZE_MODE_NO_MOUNT);
  pilot.Acquire();
  EXPECT_EQ(pilot.status().error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(pilot.status().error_message(), HasSubstr("no mount"));
  EXPECT_EQ(pilot.Call(&v1::GazeService::Stub::Home).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION);
}

TEST(Gaze, ThePilotTurnsTheHeadAndEverybodySeesIt) {
  std::shared_ptr<SimMount> head;
  InProcessServer server(WithHead(&head));
  Pilot pilot(server.address());
  TestClient other(server.address());
  other.Subscribe();
  ASSERT_TRUE(pilot.WaitForState([](const auto& state) { return state.has_pan_rad(); }));
  ASSERT_EQ(pilot.Fixate(1, 0, 1).error_code(), grpc::StatusCode::FAILED_PRECONDITION)
      << "without the lease";
  ASSERT_TRUE(pilot.Rise());
  std::this_thread::sleep_for(milliseconds(200));  // frames with joint angles
  ASSERT_TRUE(pilot.Fixate(1, 0, 1).ok());
  ASSERT_TRUE(pilot.WaitForState([](const auto& state) { return state.arrived(); }));
  EXPECT_NEAR(head->TrueAngles(MonotonicNow()).pan_rad, 0.785, 0.03);
  EXPECT_EQ(pilot.State().mode(), v1::GAZE_MODE_FIXATE);
  EXPECT_TRUE(other.WaitFor([&](const std::vector<ReceivedEvent>& events) {
    bool saccade = false, held = false;
    for (const ReceivedEvent& one : events) {
      const v1::GazeState& state = one.event.gaze();
      if (!one.event.has_gaze() ||
          state.pilot().participant_id() != pilot.client().participant_id())
        continue;
      saccade |= state.mode() == v1::GAZE_MODE_SACCADE;
      held |= saccade && state.arrived() && state.error_rad() < 0.035;
    }
    return held;
  }));
}

TEST(Gaze, CalibrationMovesTheHeadForItsPilotOnlyAndEndsWithAnyOtherCommand) {
  std::shared_ptr<SimMount> head;
  InProcessServer server(WithHead(&head));
  Pilot pilot(server.address());
  const auto calibration = [&](grpc::Status* status) {
    grpc::ClientContext context;
    v1::GetMountCalibrationResponse response;
    *status = pilot.gaze().GetMountCalibration(&context, {}, &response);
    return response.calibration();
  };
  grpc::Status status;
  calibration(&status);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  ASSERT_TRUE(pilot.WaitForState([](const auto& state) { return state.has_pan_rad(); }));
  EXPECT_EQ(pilot.Call(&v1::GazeService::Stub::CalibrateMount).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION)
      << "without the lease";
  ASSERT_TRUE(pilot.Rise());
  ASSERT_TRUE(pilot.Call(&v1::GazeService::Stub::CalibrateMount).ok());
  EXPECT_TRUE(pilot.WaitForState([](const auto& state) {
    return state.problem().find("being calibrated") != std::string::npos && state.pan_rad() > 0.05;
  }));
  EXPECT_TRUE(calibration(&status).running());
  EXPECT_GT(calibration(&status).share(), 0);
  ASSERT_TRUE(pilot.Call(&v1::GazeService::Stub::StopFixating).ok());
  const v1::MountCalibration ended = calibration(&status);
  EXPECT_FALSE(ended.running());
  EXPECT_THAT(ended.problem(), HasSubstr("start again"));
  EXPECT_EQ(ended.toml(), "");
}

TEST(Gaze, TheHeadMovesSoonAfterTheCommand) {
  std::shared_ptr<SimMount> head;
  InProcessServer server(WithHead(&head));
  Pilot pilot(server.address());
  ASSERT_TRUE(pilot.Rise());
  std::this_thread::sleep_for(milliseconds(200));
  std::vector<double> taken_ms;
  for (int k = 0; k < 15; ++k) {
    const double rest = head->TrueAngles(MonotonicNow()).pan_rad;
    const Timestamp begin = MonotonicNow();
    ASSERT_TRUE(pilot.Fixate(k % 2 == 0 ? 0.3 : -0.3, 0, 1).ok());
    // The simulated head's own step is 1 ms; 0.05 deg is half the encoders' noise.
    while (std::abs(head->TrueAngles(MonotonicNow()).pan_rad - rest) < 0.0009 &&
           MonotonicNow() - begin < 2'000'000'000) {
      head->AdvanceTo(MonotonicNow());
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
    taken_ms.push_back(1e3 * Seconds(MonotonicNow() - begin));
    ASSERT_TRUE(pilot.WaitForState([](const auto& state) { return state.arrived(); }));
    std::this_thread::sleep_for(milliseconds(100));
  }
  std::sort(taken_ms.begin(), taken_ms.end());
  std::printf("command to first motion: p50 %.0f ms, worst of 15 %.0f ms\n", taken_ms[7],
              taken_ms[14]);
  EXPECT_LT(taken_ms[7], 80.0) << "20 ms of it are the head's";
}

TEST(Gaze, TwoExpertsOneHead) {
  InProcessServer server(WithHead());
  Pilot ann(server.address()), bob(server.address());
  ASSERT_TRUE(ann.Rise());
  const v1::AcquireLeaseResponse waits = bob.Acquire();
  EXPECT_FALSE(waits.granted());
  EXPECT_EQ(waits.queue_position(), 1u);
  EXPECT_EQ(waits.pilot().participant_id(), ann.client().participant_id());
  const grpc::Status refused = bob.Fixate(1, 0, 1);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(refused.error_message(), HasSubstr("pilots"));
  ann.Fall();
  ASSERT_TRUE(ann.Call(&v1::GazeService::Stub::ReleaseLease).ok());
  EXPECT_EQ(bob.State().pilot().participant_id(), bob.client().participant_id());
  EXPECT_TRUE(bob.Acquire().granted());
}

TEST(Gaze, AVanishedPilotParksTheHeadWithinASecond) {
  InProcessServer server(WithHead());
  Pilot pilot(server.address()), other(server.address());
  ASSERT_TRUE(pilot.Rise());
  std::this_thread::sleep_for(milliseconds(200));
  ASSERT_TRUE(pilot.Fixate(1, 0, 0.2, /*fast=*/false).ok());
  std::this_thread::sleep_for(milliseconds(300));
  pilot.Fall();
  ASSERT_TRUE(other.WaitForState(
      [](const auto& state) { return state.mode() == v1::GAZE_MODE_PARKED; }, milliseconds(1000)));
  EXPECT_THAT(other.State().last_handover(), HasSubstr("vanished"));
  EXPECT_FALSE(other.State().has_pilot());
}

TEST(Gaze, TheWearerTakesOverStopsAndPauses) {
  InProcessServer server(WithHead());
  Pilot expert(server.address()), wearer(server.address(), v1::ROLE_WEARER);
  ASSERT_TRUE(expert.Rise());
  EXPECT_EQ(expert.Call(&v1::GazeService::Stub::Override).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  ASSERT_TRUE(wearer.Call(&v1::GazeService::Stub::StopFixating).ok()) << "without a lease";
  v1::OverrideRequest take;
  take.set_enabled(true);
  ASSERT_TRUE(wearer.Call(&v1::GazeService::Stub::Override, take).ok());
  EXPECT_EQ(wearer.State().pilot().participant_id(), wearer.client().participant_id());
  EXPECT_EQ(expert.Fixate(0, 0, 1).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  take.set_enabled(false);
  ASSERT_TRUE(wearer.Call(&v1::GazeService::Stub::Override, take).ok());
  EXPECT_EQ(wearer.State().pilot().participant_id(), expert.client().participant_id());
  v1::PauseRequest pause;
  pause.set_paused(true);
  ASSERT_TRUE(wearer.Call(&v1::GazeService::Stub::Pause, pause).ok());
  EXPECT_TRUE(expert.State().paused());
  const grpc::Status paused = expert.Fixate(0, 0, 1);
  EXPECT_EQ(paused.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(paused.error_message(), HasSubstr("paused"));
}

TEST(Gaze, BadRequestsNameTheField) {
  InProcessServer server(WithHead());
  Pilot pilot(server.address()), viewer(server.address(), v1::ROLE_VIEWER);
  ASSERT_TRUE(pilot.Rise());
  std::this_thread::sleep_for(milliseconds(200));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const grpc::Status not_a_number = pilot.Fixate(nan, 0, 1);
  EXPECT_EQ(not_a_number.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(not_a_number.error_message(), HasSubstr("target.point_in_world_m"));
  const grpc::Status far = pilot.Fixate(0, 0, 900);
  EXPECT_EQ(far.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(far.error_message(), HasSubstr("900"));
  v1::FixateRequest feature;
  feature.mutable_target()->set_feature_id(4711);
  EXPECT_EQ(pilot.Fixate(feature).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(pilot.Fixate(v1::FixateRequest()).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  viewer.Acquire();
  EXPECT_EQ(viewer.status().error_code(), grpc::StatusCode::PERMISSION_DENIED);
  pilot.Acquire("not-a-uuid");
  EXPECT_EQ(pilot.status().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(pilot.State().problem(), "");
}

TEST(Gaze, AnUnpluggedHeadIsToldAndComesBack) {
  std::shared_ptr<SimMount> head;
  InProcessServer server(WithHead(&head));
  Pilot pilot(server.address());
  ASSERT_TRUE(pilot.Rise());
  head->SetUnplugged(true);
  ASSERT_TRUE(pilot.WaitForState([](const auto& state) {
    return state.problem().find("disconnected") != std::string::npos && !state.has_pan_rad();
  }));
  head->SetUnplugged(false);
  ASSERT_TRUE(pilot.WaitForState(
      [](const auto& state) { return state.problem().empty() && state.has_pan_rad(); }));
}

}  // namespace
}  // namespace saccade::gaze_integration_test
