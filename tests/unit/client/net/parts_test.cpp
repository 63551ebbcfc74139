// A server answers in pages and tells states in parts; a caller sees the whole of either.
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>

#include "client/net/connection.hpp"
#include "client/net/convert.hpp"
#include "saccade/v1/annotation.grpc.pb.h"
#include "saccade/v1/session.grpc.pb.h"

namespace saccade::net::parts_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

v1::Annotation Named(const std::string& id) {
  v1::Annotation annotation;
  annotation.set_id(id);
  annotation.set_shape(v1::ANNOTATION_SHAPE_NOTE);
  annotation.mutable_anchor()->set_state(v1::ANCHOR_STATE_TRACKING);
  return annotation;
}

/// A page holds two of `count` annotations; `endless`: the last token comes again and again.
class PagingServer : public v1::AnnotationService::Service {
 public:
  grpc::Status List(grpc::ServerContext* /*context*/, const v1::ListAnnotationsRequest* request,
                    v1::ListAnnotationsResponse* response) override {
    ++calls;
    int at = 0;
    if (!request->page_token().empty() && !absl::SimpleAtoi(request->page_token(), &at)) {
      return {grpc::StatusCode::INVALID_ARGUMENT, "page_token: unknown"};
    }
    for (int i = at; i < std::min(at + 2, count); ++i) {
      *response->add_annotations() = Named(absl::StrCat(i));
    }
    if (at + 2 < count) response->set_next_page_token(absl::StrCat(at + 2));
    if (endless) response->set_next_page_token("4");
    return grpc::Status::OK;
  }
  int count = 0;
  bool endless = false;
  std::atomic<int> calls = 0;
};

class Paging : public ::testing::Test {
 protected:
  void SetUp() override {
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    ASSERT_GT(port, 0);
    ConnectionOptions options;
    options.server = absl::StrCat("127.0.0.1:", port);
    connection_ = *Connection::Create(options);
  }
  PagingServer service_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<Connection> connection_;
};

TEST_F(Paging, AListIsReadToItsLastPage) {
  for (const int count : {0, 1, 2, 3, 7}) {
    service_.count = count;
    service_.calls = 0;
    const absl::StatusOr<std::vector<Annotation>> all = connection_->ListAnnotations();
    ASSERT_TRUE(all.ok()) << all.status();
    ASSERT_THAT(*all, SizeIs(count));
    for (int i = 0; i < count; ++i) EXPECT_EQ((*all)[i].id, absl::StrCat(i));
    EXPECT_EQ(service_.calls, std::max(1, (count + 1) / 2));
  }
}

TEST_F(Paging, AListWithoutEndIsAnError) {
  service_.count = 9;
  service_.endless = true;
  const absl::StatusOr<std::vector<Annotation>> all = connection_->ListAnnotations();
  EXPECT_EQ(all.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(all.status().message(), HasSubstr("does not end"));
  EXPECT_LT(service_.calls, 5);
}

AnnotationChange Part(bool full, std::vector<std::string> ids, std::vector<std::string> removed) {
  v1::AnnotationEvent event;
  event.set_full(full);
  for (const std::string& id : ids) *event.add_upserted() = Named(id);
  for (const std::string& id : removed) event.add_removed_ids(id);
  v1::AnchorUpdate& update = *event.add_anchors();
  update.set_id("live");
  update.mutable_anchor()->set_state(v1::ANCHOR_STATE_PAUSED);
  update.mutable_anchor()->set_error_mm(12);
  absl::StatusOr<AnnotationChange> change = FromProto(event);
  EXPECT_TRUE(change.ok()) << change.status();
  return *std::move(change);
}

TEST(Parts, AChangeIsToldOnceItIsWhole) {
  AnnotationParts parts;
  EXPECT_FALSE(parts.Add(Part(true, {"a", "b"}, {}), true));
  EXPECT_FALSE(parts.Add(Part(false, {"c"}, {}), true));
  const std::optional<AnnotationChange> whole = parts.Add(Part(false, {}, {"z"}), false);
  ASSERT_TRUE(whole);
  EXPECT_TRUE(whole->full);
  ASSERT_THAT(whole->upserted, SizeIs(3));
  EXPECT_EQ(whole->upserted[2].id, "c");
  EXPECT_THAT(whole->removed_ids, ElementsAre("z"));
  ASSERT_THAT(whole->anchors, SizeIs(3));
  EXPECT_EQ(whole->anchors[0].id, "live");
  EXPECT_EQ(whole->anchors[0].anchor.state, AnchorState::kPaused);
  EXPECT_DOUBLE_EQ(whole->anchors[0].anchor.error_m, 0.012);
  EXPECT_FALSE(whole->anchors[0].anchor.place_known) << "no point: of another map";

  const std::optional<AnnotationChange> next = parts.Add(Part(false, {"d"}, {}), false);
  ASSERT_TRUE(next);
  EXPECT_FALSE(next->full);
  EXPECT_THAT(next->upserted, SizeIs(1));
}

TEST(Parts, AFullStateForgetsWhatWasBegunBeforeIt) {
  AnnotationParts parts;
  EXPECT_FALSE(parts.Add(Part(false, {"old"}, {}), true));
  const std::optional<AnnotationChange> whole = parts.Add(Part(true, {"new"}, {}), false);
  ASSERT_TRUE(whole);
  ASSERT_THAT(whole->upserted, SizeIs(1));
  EXPECT_EQ(whole->upserted[0].id, "new");
}

TEST(Parts, AMapThatCameInPartSaysSo) {
  v1::GetMapResponse response;
  EXPECT_TRUE(FromProto(response)->complete);
  response.mutable_map()->set_more(true);
  EXPECT_FALSE(FromProto(response)->complete);
}

}  // namespace
}  // namespace saccade::net::parts_test
