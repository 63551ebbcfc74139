// The scene over real gRPC sockets, server in process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "saccade/v1/scene.grpc.pb.h"
#include "tests/integration/stream/in_process_server.hpp"
#include "tests/integration/stream/test_client.hpp"
#include "tests/unit/server/scene/glb_builder.hpp"

namespace saccade::scene_integration_test {
namespace {

using ::testing::HasSubstr;
using testing::InProcessServer;
using testing::TestClient;

class SceneCalls : public ::testing::Test {
 protected:
  void SetUp() override {
    server_ = std::make_unique<InProcessServer>();
    client_ = std::make_unique<TestClient>(server_->address());
    scene_ = v1::SceneService::NewStub(
        grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials()));
  }

  template <typename Request, typename Response>
  grpc::Status Call(grpc::Status (v1::SceneService::Stub::*method)(grpc::ClientContext*,
                                                                   const Request&, Response*),
                    Request request, Response& response) {
    grpc::ClientContext context;
    request.set_session_id(client_->session_id());
    return (scene_.get()->*method)(&context, request, &response);
  }
  static v1::SceneObject Box(const std::string& name, double x, double y, double z) {
    v1::SceneObject object;
    object.set_name(name);
    object.set_shape(v1::SCENE_SHAPE_BOX);
    object.set_material(v1::SCENE_MATERIAL_VIRTUAL);
    object.mutable_size_m()->set_x(x);
    object.mutable_size_m()->set_y(y);
    object.mutable_size_m()->set_z(z);
    return object;
  }
  grpc::Status Put(const v1::SceneObject& object, v1::PutSceneObjectResponse& response) {
    v1::PutSceneObjectRequest request;
    *request.mutable_object() = object;
    return Call(&v1::SceneService::Stub::PutObject, request, response);
  }
  void AddRoom() {
    v1::SceneObject room = Box("room", 4, 2.5, 4);
    room.set_shape(v1::SCENE_SHAPE_ROOM);
    room.set_material(v1::SCENE_MATERIAL_REAL);
    v1::PutSceneObjectResponse response;
    const grpc::Status put = Put(room, response);
    ASSERT_TRUE(put.ok()) << put.error_message();
    EXPECT_EQ(response.object().id().size(), 36u);
  }
  v1::ListSceneResponse List() {
    v1::ListSceneResponse response;
    EXPECT_TRUE(Call(&v1::SceneService::Stub::ListScene, v1::ListSceneRequest(), response).ok());
    return response;
  }

  std::unique_ptr<InProcessServer> server_;
  std::unique_ptr<TestClient> client_;
  std::unique_ptr<v1::SceneService::Stub> scene_;
};

TEST_F(SceneCalls, AThingIsPushedToTheWallAndStandsOnTheFloor) {
  AddRoom();
  v1::PlaceSceneObjectRequest request;
  *request.mutable_object() = Box("crate", 0.4, 0.3, 0.2);
  request.mutable_push_in_world()->set_x(1);
  v1::PlaceSceneObjectResponse placed;
  const grpc::Status status = Call(&v1::SceneService::Stub::PlaceObject, request, placed);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_NEAR(placed.object().parent_from_object().translation_m().x(), 1.8, 1e-3);
  EXPECT_NEAR(placed.object().parent_from_object().translation_m().y(), 0, 1e-3);
  EXPECT_EQ(placed.stop().object_name(), "room");
  EXPECT_NEAR(placed.support().normal_in_world().y(), -1, 1e-6);
  EXPECT_EQ(List().objects_size(), 2);
  ASSERT_TRUE(List().has_light());
  EXPECT_EQ(List().light().confidence(), 0.0);  // no square tells where it comes from

  // Moved again by its id: itself is nothing in its way.
  *request.mutable_object() = placed.object();
  request.mutable_push_in_world()->set_x(-1);
  ASSERT_TRUE(Call(&v1::SceneService::Stub::PlaceObject, request, placed).ok());
  EXPECT_NEAR(placed.object().parent_from_object().translation_m().x(), -1.8, 1e-3);
  EXPECT_EQ(List().objects_size(), 2);
}

TEST_F(SceneCalls, AslantItSlidesAsFarAsTheHandGoes) {
  AddRoom();
  v1::PlaceSceneObjectRequest request;
  *request.mutable_object() = Box("crate", 0.4, 0.3, 0.2);
  request.mutable_push_in_world()->set_x(1);
  request.mutable_push_in_world()->set_z(0.5);
  request.set_hand_m(2.5);
  v1::PlaceSceneObjectResponse placed;
  const grpc::Status status = Call(&v1::SceneService::Stub::PlaceObject, request, placed);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_NEAR(placed.object().parent_from_object().translation_m().x(), 1.8, 1e-3);
  EXPECT_NEAR(placed.object().parent_from_object().translation_m().z(), 2.5 / std::sqrt(5), 1e-3);
  EXPECT_GT(placed.slid_m(), 0.1);
  EXPECT_FALSE(placed.has_slide_stop());
  request.set_hand_m(12);
  *request.mutable_object() = placed.object();
  ASSERT_TRUE(Call(&v1::SceneService::Stub::PlaceObject, request, placed).ok());
  EXPECT_NEAR(placed.object().parent_from_object().translation_m().z(), 1.9, 1e-3);
  EXPECT_EQ(placed.slide_stop().object_name(), "room");
}

TEST_F(SceneCalls, AThingMayBeFixedToAMarkerThatCanBeFollowed) {
  v1::SceneObject drawer = Box("drawer", 0.4, 0.2, 0.4);
  drawer.mutable_marker()->set_family("apriltag36h11");
  drawer.mutable_marker()->set_id(3);
  drawer.mutable_marker()->set_side_m(0.08);
  v1::PutSceneObjectResponse put;
  grpc::Status status = Put(drawer, put);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_TRUE(List().objects(0).has_marker());
  EXPECT_EQ(List().objects(0).marker().id(), 3u);
  EXPECT_EQ(List().objects(0).marker().side_m(), 0.08);

  const auto refused = [&](const v1::SceneObject& object, const std::string& words) {
    const grpc::Status why = Put(object, put);
    EXPECT_EQ(why.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(why.error_message(), HasSubstr(words));
  };
  v1::SceneObject other = drawer;
  other.mutable_marker()->set_side_m(0.1);
  refused(other, "marker.side_m: 0.1, but 'drawer' has 0.08");
  other.mutable_marker()->set_side_m(0);
  refused(other, "marker.side_m: 0; give");
  other = drawer;
  other.mutable_marker()->set_family("koller");
  refused(other, "marker.family: 'koller' cannot be followed");
  other.mutable_marker()->set_family("apriltag36h11");
  other.mutable_marker()->set_id(100'000);
  refused(other, "marker.id: ");
  other = drawer;
  other.set_annotation_id("1b4e28ba-2fa1-41d2-883f-0016d3cca427");
  refused(other, "object: has both marker and annotation_id");
}

TEST_F(SceneCalls, RefusalsNameFieldAndReason) {
  AddRoom();
  v1::PlaceSceneObjectRequest request;
  *request.mutable_object() = Box("crate", 0.4, 0.3, 0.2);
  request.mutable_object()->mutable_parent_from_object()->mutable_translation_m()->set_x(1.9);
  request.mutable_object()->mutable_parent_from_object()->mutable_rotation()->set_w(1);
  v1::PlaceSceneObjectResponse placed;
  grpc::Status status = Call(&v1::SceneService::Stub::PlaceObject, request, placed);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), HasSubstr("inside of 'room'"));

  v1::PutSceneObjectResponse put;
  status = Put(Box("flat", 1, 0, 1), put);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("size_m.y"));
  v1::SceneObject model = Box("part", 1, 1, 1);
  model.set_shape(v1::SCENE_SHAPE_MODEL);
  model.set_model_id("none");
  EXPECT_EQ(Put(model, put).error_code(), grpc::StatusCode::NOT_FOUND);
  v1::RemoveSceneObjectRequest remove;
  remove.set_id("1b4e28ba-2fa1-41d2-883f-0016d3cca427");
  v1::RemoveSceneObjectResponse removed;
  EXPECT_EQ(Call(&v1::SceneService::Stub::RemoveObject, remove, removed).error_code(),
            grpc::StatusCode::NOT_FOUND);
}

TEST_F(SceneCalls, AModelComesInPiecesAndGoesOutAgain) {
  const std::string glb = GlbBuilder::Triangle().Bytes();
  v1::UploadModelRequest request;
  request.set_upload_id("1b4e28ba-2fa1-41d2-883f-0016d3cca427");
  request.set_name("part");
  request.set_total_bytes(static_cast<std::uint32_t>(glb.size()));
  v1::UploadModelResponse response;
  for (std::size_t offset = 0; offset < glb.size(); offset += 300) {
    request.set_offset_bytes(static_cast<std::uint32_t>(offset));
    request.set_data(glb.substr(offset, 300));
    const grpc::Status status = Call(&v1::SceneService::Stub::UploadModel, request, response);
    ASSERT_TRUE(status.ok()) << status.error_message();
  }
  ASSERT_TRUE(response.has_model());
  EXPECT_EQ(response.model().triangles(), 1u);
  EXPECT_EQ(response.model().id().size(), 64u);

  v1::GetModelRequest get;
  get.set_model_id(response.model().id());
  v1::GetModelResponse got;
  ASSERT_TRUE(Call(&v1::SceneService::Stub::GetModel, get, got).ok());
  EXPECT_EQ(got.data(), glb);

  // Out of order, and torn.
  request.set_offset_bytes(7);
  EXPECT_EQ(Call(&v1::SceneService::Stub::UploadModel, request, response).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION);
  request.set_offset_bytes(0);
  request.set_total_bytes(300);
  request.set_data(glb.substr(0, 300));
  const grpc::Status torn = Call(&v1::SceneService::Stub::UploadModel, request, response);
  EXPECT_EQ(torn.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(torn.error_message(), HasSubstr("torn"));
}

TEST_F(SceneCalls, ARegistrationTellsItsErrorBeforeItIsAccepted) {
  v1::PutSceneObjectResponse put;
  ASSERT_TRUE(Put(Box("machine", 1, 1, 1), put).ok());
  v1::RegisterSceneObjectRequest request;
  request.set_id(put.object().id());
  const auto add = [&request](double x, double y, double z) {
    v1::SceneCorrespondence* one = request.add_correspondences();
    one->mutable_point_in_object_m()->set_x(x);
    one->mutable_point_in_object_m()->set_y(y);
    one->mutable_point_in_object_m()->set_z(z);
    one->mutable_point_in_world_m()->set_x(x + 2);
    one->mutable_point_in_world_m()->set_y(y);
    one->mutable_point_in_world_m()->set_z(z);
  };
  v1::RegisterSceneObjectResponse found;
  add(0, 0, 0), add(1, 0, 0), add(0, 1, 0);
  const grpc::Status few = Call(&v1::SceneService::Stub::RegisterObject, request, found);
  EXPECT_EQ(few.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(few.error_message(), HasSubstr("at least 4"));
  add(0, 0, 1);
  request.mutable_correspondences(3)->mutable_point_in_world_m()->set_z(1.004);
  ASSERT_TRUE(Call(&v1::SceneService::Stub::RegisterObject, request, found).ok());
  EXPECT_GT(found.rms_mm(), 0.1);
  EXPECT_GT(found.left_out_rms_mm(), found.rms_mm());
  EXPECT_EQ(List().objects(0).parent_from_object().translation_m().x(), 0);
  request.set_accept(true);
  ASSERT_TRUE(Call(&v1::SceneService::Stub::RegisterObject, request, found).ok());
  EXPECT_NEAR(List().objects(0).parent_from_object().translation_m().x(), 2, 0.01);
}

// What one did the others are told; who comes later has all of it.
TEST_F(SceneCalls, ChangesComeOnTheStream) {
  v1::SubscribeRequest request;
  request.add_topics(v1::TOPIC_SCENE);
  client_->Subscribe(request);
  const auto told = [](const TestClient& client, bool full, const std::string& name) {
    return client.WaitFor([&](const std::vector<testing::ReceivedEvent>& events) {
      return std::any_of(events.begin(), events.end(), [&](const testing::ReceivedEvent& one) {
        const v1::SceneEvent& scene = one.event.scene();
        return scene.full() == full && scene.upserted_size() == 1 &&
               scene.upserted(0).name() == name;
      });
    });
  };
  ASSERT_TRUE(client_->WaitFor([](const auto& events) { return !events.empty(); }));
  EXPECT_TRUE(client_->events()[0].event.scene().full());
  AddRoom();
  EXPECT_TRUE(told(*client_, false, "room"));
  TestClient late(server_->address());
  late.Subscribe(request);
  EXPECT_TRUE(told(late, true, "room"));
  const std::string id = List().objects(0).id();
  v1::RemoveSceneObjectRequest remove;
  remove.set_id(id);
  v1::RemoveSceneObjectResponse removed;
  ASSERT_TRUE(Call(&v1::SceneService::Stub::RemoveObject, remove, removed).ok());
  EXPECT_TRUE(late.WaitFor([&id](const auto& events) {
    const v1::SceneEvent& scene = events.back().event.scene();
    return scene.removed_ids_size() == 1 && scene.removed_ids(0) == id;
  }));
}

}  // namespace
}  // namespace saccade::scene_integration_test
