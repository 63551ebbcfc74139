// Persons, pointers and marks over real gRPC sockets, server in process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "saccade/v1/pointer.grpc.pb.h"
#include "tests/integration/stream/in_process_server.hpp"
#include "tests/integration/stream/test_client.hpp"
#include "tests/integration/support/process.hpp"

namespace saccade::marks_integration_test {
namespace {

using ::testing::HasSubstr;
using testing::InProcessOptions;
using testing::InProcessServer;
using testing::ReceivedEvent;
using ::testing::StartsWith;
using testing::TestClient;

using std::chrono::milliseconds;
using std::chrono::steady_clock;

const std::string kAnn(40, 'a');
const std::string kBob(40, 'b');

std::string Uuid(int n) {
  char text[40];
  std::snprintf(text, sizeof text, "00000000-0000-4000-8000-%012d", n);
  return text;
}

/// One who joins with a key and calls.
class Person {
 public:
  Person(const std::string& address, const std::string& key, const std::string& name = "Ann",
         v1::Role role = v1::ROLE_EXPERT)
      : channel_(grpc::CreateChannel(address, grpc::InsecureChannelCredentials())),
        session_(v1::SessionService::NewStub(channel_)),
        annotations_(v1::AnnotationService::NewStub(channel_)),
        pointers_(v1::PointerService::NewStub(channel_)) {
    v1::JoinRequest request;
    request.set_display_name(name);
    request.set_role(role);
    request.set_person_key(key);
    grpc::ClientContext context;
    status = session_->Join(&context, request, &joined);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }
  template <typename Service, typename Request, typename Response>
  grpc::Status Call(Service& service,
                    grpc::Status (Service::*method)(grpc::ClientContext*, const Request&,
                                                    Response*),
                    Request request, Response& response) {
    grpc::ClientContext context;
    request.set_session_id(joined.session_id());
    return (service.*method)(&context, request, &response);
  }
  grpc::Status Point(v1::PointRequest request) {
    v1::PointResponse response;
    return Call(*pointers_, &v1::PointerService::Stub::Point, std::move(request), response);
  }
  v1::Annotation Make(const v1::AnnotationDraft& draft, const std::string& group = "") {
    v1::CreateAnnotationRequest request;
    *request.mutable_draft() = draft;
    request.set_edit_group(group);
    v1::CreateAnnotationResponse response;
    status = Call(*annotations_, &v1::AnnotationService::Stub::Create, request, response);
    return response.annotation();
  }
  v1::Annotation Update(v1::UpdateAnnotationRequest request) {
    v1::UpdateAnnotationResponse response;
    status =
        Call(*annotations_, &v1::AnnotationService::Stub::Update, std::move(request), response);
    return response.annotation();
  }
  std::string Undo() {
    v1::UndoAnnotationResponse response;
    status = Call(*annotations_, &v1::AnnotationService::Stub::Undo, v1::UndoAnnotationRequest(),
                  response);
    return response.description();
  }
  std::vector<v1::Annotation> List() {
    v1::ListAnnotationsResponse response;
    grpc::ClientContext context;
    EXPECT_TRUE(annotations_->List(&context, {}, &response).ok());
    return {response.annotations().begin(), response.annotations().end()};
  }
  v1::AnnotationService::Stub& annotations() { return *annotations_; }

  v1::JoinResponse joined;
  grpc::Status status;  // of the last call

 private:
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::SessionService::Stub> session_;
  std::unique_ptr<v1::AnnotationService::Stub> annotations_;
  std::unique_ptr<v1::PointerService::Stub> pointers_;
};

std::uint64_t FirstFrame(TestClient& client) {
  std::uint64_t frame = 0;
  for (int i = 0; i < 200 && frame == 0; ++i) {
    std::this_thread::sleep_for(milliseconds(20));
    frame = client.NewestFrame();
  }
  return frame;
}

v1::AnnotationDraft At(v1::AnnotationShape shape, double x = 0) {
  v1::AnnotationDraft draft;
  draft.set_shape(shape);
  v1::Vector3& point = *draft.mutable_target()->mutable_point_in_world_m();
  point.set_x(x);
  point.set_z(2);
  return draft;
}

v1::PointRequest Laser(int stroke, std::uint64_t frame, double u, double v) {
  v1::PointRequest request;
  request.set_kind(v1::POINTER_KIND_LASER);
  request.set_stroke_id(Uuid(stroke));
  v1::FramePixel& target = *request.add_points()->mutable_frame_pixel();
  target.set_frame_id(frame);
  target.mutable_pixel()->set_u(u);
  target.mutable_pixel()->set_v(v);
  return request;
}

/// The newest word of a stroke; nothing if there was none.
std::optional<v1::Pointer> Newest(const std::vector<ReceivedEvent>& events, int stroke) {
  std::optional<v1::Pointer> newest;
  for (const ReceivedEvent& one : events) {
    for (const v1::Pointer& pointer : one.event.pointer().pointers()) {
      if (pointer.stroke_id() == Uuid(stroke)) newest = pointer;
    }
  }
  return newest;
}

v1::SubscribeRequest OnlyPointers() {
  v1::SubscribeRequest request;
  request.add_topics(v1::TOPIC_POINTER);
  return request;
}

TEST(Marks, APersonIsTheSameInEverySessionWithOneKey) {
  InProcessServer server;
  TestClient watcher(server.address());
  FirstFrame(watcher);
  v1::Annotation made;
  std::string person_id;
  {
    Person desk(server.address(), kAnn);
    person_id = desk.joined.person_id();
    made = desk.Make(At(v1::ANNOTATION_SHAPE_NOTE));
    EXPECT_TRUE(desk.status.ok()) << desk.status.error_message();
    EXPECT_EQ(made.author_person_id(), person_id);
  }
  Person loaded_anew(server.address(), kAnn), other(server.address(), kBob, "Bob");
  EXPECT_EQ(loaded_anew.joined.person_id(), person_id);
  EXPECT_NE(loaded_anew.joined.color_rgba(), other.joined.color_rgba());
  other.Undo();
  EXPECT_EQ(other.status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(loaded_anew.Undo(), HasSubstr("created note"));
  EXPECT_TRUE(loaded_anew.List().empty());
  v1::JoinRequest bad;
  bad.set_person_key("too short");
  v1::JoinResponse response;
  grpc::ClientContext context;
  const grpc::Status refused = watcher.session().Join(&context, bad, &response);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), StartsWith("person_key: "));
}

TEST(Marks, APointerIsSeenByTheOthersAtOnceAndGoneAfterASecond) {
  InProcessServer server;
  TestClient watcher(server.address());
  FirstFrame(watcher);
  watcher.Subscribe(OnlyPointers());
  Person ann(server.address(), kAnn);
  std::vector<double> ms;
  for (int i = 0; i < 60; ++i) {
    const auto sent = steady_clock::now();
    const double u = 100 + i;
    const grpc::Status status = ann.Point(Laser(1, watcher.NewestFrame(), u, 120));
    ASSERT_TRUE(status.ok()) << status.error_message();
    ASSERT_TRUE(watcher.WaitFor(
        [&](const auto& events) {
          std::size_t words = 0;
          for (const ReceivedEvent& one : events) {
            words += static_cast<std::size_t>(one.event.pointer().pointers_size());
          }
          return words > static_cast<std::size_t>(i);
        },
        milliseconds(2000)));
    ms.push_back(std::chrono::duration<double, std::milli>(steady_clock::now() - sent).count());
    std::this_thread::sleep_for(milliseconds(16));
  }
  std::sort(ms.begin(), ms.end());
  std::printf("pointer, call to the other's stream: p50 %.1f ms, p95 %.1f ms\n", ms[30], ms[57]);
  EXPECT_LT(ms[57], 150.0);
  const v1::Pointer seen = *Newest(watcher.events(), 1);
  EXPECT_EQ(seen.display_name(), "Ann");
  EXPECT_EQ(seen.person_id(), ann.joined.person_id());
  EXPECT_EQ(seen.color_rgba(), ann.joined.color_rgba());
  ASSERT_EQ(seen.points_in_world_m_size(), 1);
  EXPECT_NEAR(seen.points_in_world_m(0).z(), 2.0, 0.05);

  const auto last = steady_clock::now();
  ASSERT_TRUE(watcher.WaitFor([](const auto& events) { return Newest(events, 1)->released(); },
                              milliseconds(3000)));
  const double gone_s = std::chrono::duration<double>(steady_clock::now() - last).count();
  std::printf("pointer, gone %.2f s after its last word\n", gone_s);
  EXPECT_GT(gone_s, 0.7);
  EXPECT_LT(gone_s, 1.6);
  EXPECT_TRUE(ann.List().empty()) << "nothing of it is kept";
}

TEST(Marks, AStrokeGrowsForEverybodyAndALateOneGetsAllOfIt) {
  InProcessServer server;
  TestClient early(server.address()), late(server.address());
  const std::uint64_t frame = FirstFrame(early);
  early.Subscribe(OnlyPointers());
  Person ann(server.address(), kAnn);
  for (int i = 0; i < 40; ++i) {
    v1::PointRequest request;
    request.set_kind(v1::POINTER_KIND_SKETCH);
    request.set_stroke_id(Uuid(2));
    request.set_color_rgba(0x123456ff);
    for (int k = 0; k < 5; ++k) {
      v1::FramePixel& target = *request.add_points()->mutable_frame_pixel();
      target.set_frame_id(frame);
      target.mutable_pixel()->set_u(100 + i + 0.2 * k);
      target.mutable_pixel()->set_v(120);
    }
    const grpc::Status status = ann.Point(request);
    ASSERT_TRUE(status.ok()) << status.error_message();
  }
  const auto points = [](const std::vector<ReceivedEvent>& events) {
    std::vector<double> x;
    for (const ReceivedEvent& one : events) {
      for (const v1::Pointer& pointer : one.event.pointer().pointers()) {
        EXPECT_EQ(pointer.first(), x.size());
        for (const v1::Vector3& point : pointer.points_in_world_m()) x.push_back(point.x());
      }
    }
    return x;
  };
  late.Subscribe(OnlyPointers());
  for (TestClient* client : {&early, &late}) {
    ASSERT_TRUE(client->WaitFor([&](const auto& events) { return points(events).size() == 200; }));
    const std::vector<double> x = points(client->events());
    EXPECT_TRUE(std::is_sorted(x.begin(), x.end()));
  }
  v1::PointRequest end;
  end.set_kind(v1::POINTER_KIND_SKETCH);
  end.set_stroke_id(Uuid(2));
  end.set_released(true);
  ASSERT_TRUE(ann.Point(end).ok());
  EXPECT_TRUE(early.WaitFor([](const auto& events) { return Newest(events, 2)->released(); }));
}

TEST(Marks, WhatPointsWronglyIsRefusedByName) {
  InProcessServer server;
  TestClient watcher(server.address());
  const std::uint64_t frame = FirstFrame(watcher);
  Person ann(server.address(), kAnn), viewer(server.address(), kBob, "Bob", v1::ROLE_VIEWER);
  const auto refused = [&](auto change) {
    v1::PointRequest request = Laser(1, frame, 100, 100);
    change(request);
    const grpc::Status status = ann.Point(request);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    return status.error_message();
  };
  EXPECT_THAT(refused([](auto& r) { r.set_kind(v1::POINTER_KIND_UNSPECIFIED); }),
              StartsWith("kind: "));
  EXPECT_THAT(refused([](auto& r) { r.set_stroke_id("x"); }), StartsWith("stroke_id: "));
  EXPECT_THAT(refused([](auto& r) { r.clear_points(); }), StartsWith("points: "));
  EXPECT_THAT(refused([](auto& r) { r.mutable_points(0)->set_feature_id(1); }),
              StartsWith("points[0].feature_id: "));
  EXPECT_THAT(refused([](auto& r) {
                r.mutable_points(0)->mutable_frame_pixel()->mutable_pixel()->set_u(9999);
              }),
              StartsWith("points[0].frame_pixel.pixel.u: "));
  EXPECT_THAT(refused([](auto& r) {
                for (int i = 0; i < 64; ++i) *r.add_points() = r.points(0);
              }),
              StartsWith("points: at most 64"));
  EXPECT_EQ(viewer.Point(Laser(1, frame, 100, 100)).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
}

TEST(Marks, SixtyWordsASecondAreAllowed) {
  InProcessServer server;
  TestClient watcher(server.address());
  const std::uint64_t frame = FirstFrame(watcher);
  Person ann(server.address(), kAnn);
  const auto begin = steady_clock::now();
  for (int i = 0; i < 180; ++i) {
    ASSERT_TRUE(ann.Point(Laser(1, frame, 100, 100)).ok()) << i;
    std::this_thread::sleep_until(begin + std::chrono::microseconds(16'667) * (i + 1));
  }
}

TEST(Marks, EveryShapeIsBackAfterARestart) {
  testing::TemporaryFolder folder;
  InProcessOptions options;
  options.data_dir = folder.path();
  std::string list_id, picture_id;
  std::vector<uchar> png;
  cv::imencode(".png", cv::Mat(30, 40, CV_8UC3, cv::Scalar(1, 2, 3)), png);
  const std::string bytes(png.begin(), png.end());
  {
    InProcessServer server(options);
    TestClient watcher(server.address());
    FirstFrame(watcher);
    Person ann(server.address(), kAnn), will(server.address(), kBob, "Will", v1::ROLE_WEARER);
    v1::AnnotationDraft measure = At(v1::ANNOTATION_SHAPE_MEASURE);
    measure.mutable_end_target()->mutable_point_in_world_m()->set_x(0.3);
    measure.mutable_end_target()->mutable_point_in_world_m()->set_z(2);
    EXPECT_NEAR(ann.Make(measure).length_m(), 0.3, 1e-6) << ann.status.error_message();
    EXPECT_EQ(ann.Make(At(v1::ANNOTATION_SHAPE_PIN)).number(), 1u);
    EXPECT_EQ(ann.Make(At(v1::ANNOTATION_SHAPE_PIN, 0.1)).number(), 2u);
    ann.Undo();
    v1::AnnotationDraft picture = At(v1::ANNOTATION_SHAPE_PICTURE);
    picture.set_picture(bytes);
    picture_id = ann.Make(picture).id();
    EXPECT_TRUE(ann.status.ok()) << ann.status.error_message();
    picture.set_picture("no picture");
    ann.Make(picture);
    EXPECT_EQ(ann.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(ann.status.error_message(), StartsWith("draft.picture: "));
    v1::AnnotationDraft tasks = At(v1::ANNOTATION_SHAPE_CHECK_LIST);
    tasks.add_check_items("oil");
    tasks.add_check_items("lid");
    list_id = ann.Make(tasks).id();
    v1::UpdateAnnotationRequest lock;
    lock.set_id(list_id);
    lock.set_locked(true);
    EXPECT_TRUE(ann.Update(lock).locked());
    v1::TickCheckItemRequest tick;
    tick.set_id(list_id);
    tick.set_index(1);
    tick.set_done(true);
    v1::TickCheckItemResponse ticked;
    const grpc::Status status =
        will.Call(will.annotations(), &v1::AnnotationService::Stub::TickCheckItem, tick, ticked);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(ticked.annotation().check_items(1).done_by(), "Will");
  }
  InProcessServer server(options);
  TestClient watcher(server.address());
  FirstFrame(watcher);
  Person ann(server.address(), kAnn), bob(server.address(), std::string(40, 'c'), "Bob");
  const std::vector<v1::Annotation> all = ann.List();
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(all[0].length_m() > 0, true);
  EXPECT_TRUE(all[3].check_items(1).done());
  EXPECT_EQ(all[3].author_person_id(), ann.joined.person_id());
  EXPECT_EQ(ann.Make(At(v1::ANNOTATION_SHAPE_PIN)).number(), 3u) << "2 was given already";
  v1::UpdateAnnotationRequest change;
  change.set_id(list_id);
  change.set_text("x");
  bob.Update(change);
  EXPECT_EQ(bob.status.error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(bob.status.error_message(), HasSubstr("locked by Ann"));
  EXPECT_EQ(ann.Update(change).text(), "x") << "over the restart it is still hers";
  v1::GetPictureRequest get;
  get.set_id(picture_id);
  v1::GetPictureResponse got;
  ASSERT_TRUE(bob.Call(bob.annotations(), &v1::AnnotationService::Stub::GetPicture, get, got).ok());
  EXPECT_EQ(got.picture(), bytes);
  EXPECT_EQ(got.facts().width(), 40u);
  get.set_id(list_id);
  EXPECT_EQ(
      bob.Call(bob.annotations(), &v1::AnnotationService::Stub::GetPicture, get, got).error_code(),
      grpc::StatusCode::NOT_FOUND);
}

TEST(Marks, ChangesOfEveryFieldReachTheOthers) {
  InProcessServer server;
  TestClient watcher(server.address());
  FirstFrame(watcher);
  v1::SubscribeRequest only;
  only.add_topics(v1::TOPIC_ANNOTATION);
  watcher.Subscribe(only);
  Person ann(server.address(), kAnn);
  v1::AnnotationDraft box = At(v1::ANNOTATION_SHAPE_BOX);
  box.mutable_extent_m()->set_x(0.1);
  box.mutable_extent_m()->set_y(0.2);
  box.mutable_extent_m()->set_z(0.3);
  const std::string id = ann.Make(box, "group").id();
  const auto newest = [&id](const std::vector<ReceivedEvent>& events) {
    v1::Annotation annotation;
    for (const ReceivedEvent& one : events) {
      for (const v1::Annotation& each : one.event.annotation().upserted()) {
        if (each.id() == id) annotation = each;
      }
    }
    return annotation;
  };
  EXPECT_TRUE(
      watcher.WaitFor([&](const auto& events) { return newest(events).extent_m().y() == 0.2; }));
  v1::UpdateAnnotationRequest change;
  change.set_id(id);
  change.set_locked(true);
  change.mutable_world_from_mark()->set_y(1);
  change.set_edit_group("group");
  ann.Update(change);
  ASSERT_TRUE(ann.status.ok()) << ann.status.error_message();
  EXPECT_TRUE(watcher.WaitFor([&](const auto& events) {
    return newest(events).locked() && newest(events).world_from_mark().y() == 1;
  }));
  ann.Undo();
  EXPECT_TRUE(ann.List().empty()) << "made and changed together";
}

}  // namespace
}  // namespace saccade::marks_integration_test
