// Two servers of two wearers in one room, over gRPC.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <thread>

#include "saccade/v1/team.grpc.pb.h"
#include "server/app/engine.hpp"
#include "server/app/team_runner.hpp"
#include "server/rpc/rpc_server.hpp"
#include "server/rpc/stream_hub.hpp"
#include "server/rpc/team_link.hpp"
#include "tests/integration/stream/patch_room.hpp"

namespace saccade::testing::team_integration_test {
namespace {

using namespace std::chrono_literals;

template <typename T>
T Must(absl::StatusOr<T> value) {
  if (value.ok()) return *std::move(value);
  std::fprintf(stderr, "%s\n", value.status().ToString().c_str());
  std::abort();
}

/// One wearer's server, on a free port.
class Wearer {
 public:
  Wearer(std::shared_ptr<const PatchRoom> room, PatchWalk walk, Rigid3 map_from_room,
         std::string device_id, std::string name) {
    EngineOptions engine_options;
    engine_options.version = "test";
    engine_ = Must(Engine::Create(engine_options, MakePatchSource(room, walk),
                                  MakePatchTracker(room, walk, map_from_room), nullptr, hub_));
    hub_.Connect(engine_.get());
    TeamRunnerOptions team_options;
    team_options.device_id = std::move(device_id);
    team_options.display_name = std::move(name);
    team_options.from_the_start = true;
    team_ = std::make_unique<TeamRunner>(team_options, *engine_);
    engine_->SetFrameListener([this](const auto& frame, const TrackedEvent& tracked) {
      ++frames_;
      team_->OnFrame(frame, tracked);
    });
    RpcServerOptions rpc_options;
    rpc_options.port = 0;
    rpc_options.team = team_.get();
    rpc_ = Must(RpcServer::Start(rpc_options, *engine_, hub_));
    engine_->Start();
  }
  ~Wearer() {
    link_.reset();
    team_->Stop();
    hub_.CloseAll(absl::UnavailableError("the server is shutting down"));
    engine_->Stop();
    rpc_->Stop(500ms);
  }

  std::string address() const { return "127.0.0.1:" + std::to_string(rpc_->port()); }
  Engine& engine() { return *engine_; }
  int frames() const { return frames_; }
  void Join(const Wearer& other) {
    TeamLinkOptions options;
    options.address = other.address();
    link_ = std::make_unique<TeamLink>(std::move(options), *team_);
  }
  void Leave() { link_.reset(); }

  /// As everybody may ask.
  v1::GetTeamResponse Team() const {
    const auto stub = v1::TeamService::NewStub(
        grpc::CreateChannel(address(), grpc::InsecureChannelCredentials()));
    grpc::ClientContext context;
    v1::GetTeamResponse response;
    const grpc::Status status = stub->GetTeam(&context, {}, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }
  bool Merged() const {
    const v1::GetTeamResponse team = Team();
    return team.members_size() == 1 && team.members(0).merged();
  }
  std::string Note(const Eigen::Vector3d& point, const std::string& text) {
    CreateAnnotation create;
    create.editor = Editor("11111111-0000-4000-8000-000000000001");
    create.draft.shape = AnnotationShape::kNote;
    create.draft.text = text;
    create.draft.target = PointTarget{point};
    auto answer = std::make_shared<std::promise<absl::StatusOr<Annotation>>>();
    create.done = [answer](absl::StatusOr<Annotation> done) { answer->set_value(std::move(done)); };
    EXPECT_TRUE(engine_->Submit(std::move(create)).ok());
    return Must(answer->get_future().get()).id;
  }
  void Erase(const std::string& id) {
    auto answer = std::make_shared<std::promise<absl::Status>>();
    EXPECT_TRUE(engine_
                    ->Submit(DeleteAnnotation{
                        Editor("11111111-0000-4000-8000-000000000001"), id,
                        [answer](const absl::Status& done) { answer->set_value(done); }})
                    .ok());
    EXPECT_TRUE(answer->get_future().get().ok());
  }
  std::vector<Annotation> WithText(const std::string& text) const {
    std::vector<Annotation> found;
    for (const Annotation& each : *engine_->annotations()) {
      if (each.text == text) found.push_back(each);
    }
    return found;
  }

 private:
  StreamHub hub_;
  std::unique_ptr<Engine> engine_;
  std::unique_ptr<TeamRunner> team_;
  std::unique_ptr<RpcServer> rpc_;
  std::unique_ptr<TeamLink> link_;
  std::atomic<int> frames_ = 0;
};

bool Soon(const std::function<bool()>& holds, std::chrono::seconds limit = 40s) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(100ms);
  }
  return true;
}

TEST(Team, TwoWearersShareOneMapAndItsMarks) {
  const auto room = std::make_shared<const PatchRoom>(5);
  const Rigid3 map_from_room{ExpQuaternion({0.1, 0.6, -0.1}), {1.0, 0.2, -0.5}};
  Wearer ada(room, {0.0, -0.15}, Rigid3(), "aaaaaaaa-0000-4000-8000-000000000001", "Ada");
  Wearer bob(room, {2.0, 0.15}, map_from_room, "bbbbbbbb-0000-4000-8000-000000000002", "Bob");
  ASSERT_TRUE(Soon([&] { return ada.frames() > 2 && bob.frames() > 2; }));
  const std::string id = ada.Note({0.2, 0.1, 2.4}, "look here");
  bob.Join(ada);
  ASSERT_TRUE(Soon([&] { return ada.Merged() && bob.Merged(); }));

  const v1::TeamMember seen = bob.Team().members(0);
  EXPECT_EQ(seen.display_name(), "Ada");
  const auto& t = seen.own_from_member().translation_m();
  EXPECT_NEAR((Eigen::Vector3d(t.x(), t.y(), t.z()) - map_from_room.translation).norm(), 0, 0.02);
  const auto& q = seen.own_from_member().rotation();
  EXPECT_LT(Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).angularDistance(map_from_room.rotation),
            0.5 * M_PI / 180);
  EXPECT_EQ(seen.scale(), 1.0);

  // Her mark is one of his map, and moves and goes with hers.
  ASSERT_TRUE(Soon([&] { return bob.WithText("look here").size() == 1; }));
  const Eigen::Vector3d there = map_from_room * Eigen::Vector3d(0.2, 0.1, 2.4);
  EXPECT_LT((bob.WithText("look here")[0].anchor.point_in_world - there).norm(), 0.03);
  bob.Note(map_from_room * Eigen::Vector3d(-0.3, 0.0, 2.2), "and here");
  ASSERT_TRUE(Soon([&] { return ada.WithText("and here").size() == 1; }));
  EXPECT_LT(
      (ada.WithText("and here")[0].anchor.point_in_world - Eigen::Vector3d(-0.3, 0.0, 2.2)).norm(),
      0.03);
  EXPECT_EQ(ada.engine().annotations()->size(), 2U);  // no copies of copies
  EXPECT_EQ(bob.engine().annotations()->size(), 2U);

  // The link goes: each goes on alone, and they meet again.
  bob.Leave();
  ASSERT_TRUE(Soon([&] { return !ada.Team().members(0).heard(); }));
  const int before = ada.frames();
  ASSERT_TRUE(Soon([&] { return ada.frames() > before + 5; }));
  ada.Erase(id);
  bob.Join(ada);
  EXPECT_TRUE(Soon([&] { return ada.Team().members(0).heard() && bob.Merged(); }));
  EXPECT_TRUE(Soon([&] { return bob.WithText("look here").empty(); }));
  EXPECT_EQ(ada.engine().annotations()->size(), 1U);
}

TEST(Team, SaysWhatIsWrongWithWhatItIsTold) {
  const auto room = std::make_shared<const PatchRoom>(5);
  Wearer ada(room, {}, Rigid3(), "aaaaaaaa-0000-4000-8000-000000000001", "Ada");
  const auto stub = v1::TeamService::NewStub(
      grpc::CreateChannel(ada.address(), grpc::InsecureChannelCredentials()));
  v1::TellTeamRequest request;
  request.mutable_news()->set_device_id("bbbbbbbb-0000-4000-8000-000000000002");
  v1::TeamKeyframe& keyframe = *request.mutable_news()->add_keyframes();
  keyframe.mutable_camera()->set_model(v1::CameraIntrinsics::MODEL_PINHOLE);
  keyframe.mutable_camera()->set_width_px(640);
  keyframe.mutable_camera()->set_height_px(480);
  keyframe.mutable_camera()->set_fx_px(480);
  keyframe.mutable_camera()->set_fy_px(480);
  keyframe.mutable_world_from_camera()->mutable_translation_m();
  keyframe.mutable_world_from_camera()->mutable_rotation()->set_w(1.0);
  keyframe.add_ranges(2.0f);  // and nothing else of the point
  grpc::ClientContext context;
  v1::TellTeamResponse response;
  const grpc::Status status = stub->Tell(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_NE(status.error_message().find("news.keyframes[0].pixels_px"), std::string::npos)
      << status.error_message();
  EXPECT_EQ(ada.Team().members_size(), 0);
}

}  // namespace
}  // namespace saccade::testing::team_integration_test
