// More ink than fits into one message: whoever joins gets all of it, in parts, beside the rest.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/integration/stream/in_process_server.hpp"
#include "tests/integration/stream/test_client.hpp"

namespace saccade::large_state_test {
namespace {

using testing::InProcessServer;
using testing::ReceivedEvent;
using testing::TestClient;

constexpr int kStrokes = 90;
constexpr int kPoints = 2000;

v1::AnnotationDraft Stroke(const TestClient& client, std::uint64_t frame_id, int row) {
  v1::AnnotationDraft draft = client.CubeAt(160, 120, frame_id);
  draft.set_shape(v1::ANNOTATION_SHAPE_INK);
  for (int i = 0; i < kPoints; ++i) {
    v1::Pixel& pixel = *draft.add_ink_px();
    pixel.set_u(60.0 + 0.1 * i);
    pixel.set_v(60.0 + row);
  }
  return draft;
}

// Connects as anybody does: with gRPC's own limit of 4 MiB to a message.
struct PlainClient {
  explicit PlainClient(const std::string& address)
      : channel(grpc::CreateChannel(address, grpc::InsecureChannelCredentials())),
        session(v1::SessionService::NewStub(channel)),
        annotations(v1::AnnotationService::NewStub(channel)) {
    grpc::ClientContext context;
    v1::JoinResponse response;
    EXPECT_TRUE(session->Join(&context, {}, &response).ok());
    session_id = response.session_id();
  }
  void Acknowledge(std::uint64_t sequence) {
    grpc::ClientContext context;
    v1::AcknowledgeRequest request;
    request.set_session_id(session_id);
    request.set_sequence(sequence);
    v1::AcknowledgeResponse response;
    session->Acknowledge(&context, request, &response);
  }
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::SessionService::Stub> session;
  std::unique_ptr<v1::AnnotationService::Stub> annotations;
  std::string session_id;
};

class LargeState : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::uint64_t frame = WaitForFrame();
    for (int i = 0; i < kStrokes; ++i) {
      v1::CreateAnnotationResponse response;
      const grpc::Status status = artist_.Create(Stroke(artist_, frame, i), "", response);
      ASSERT_TRUE(status.ok()) << i << ": " << status.error_message();
    }
  }
  std::uint64_t WaitForFrame() {
    artist_.Subscribe();
    EXPECT_TRUE(artist_.WaitFor([](const std::vector<ReceivedEvent>& events) {
      return std::any_of(events.begin(), events.end(),
                         [](const auto& one) { return one.event.has_access_unit(); });
    }));
    return artist_.NewestFrame();
  }
  InProcessServer server_;
  TestClient artist_{server_.address()};
};

TEST_F(LargeState, WhoJoinsGetsAllStrokesInPartsAndOtherEventsBetweenThem) {
  PlainClient page(server_.address());
  grpc::ClientContext context;
  v1::SubscribeRequest request;
  request.set_session_id(page.session_id);
  const auto reader = page.session->Subscribe(&context, request);
  v1::Event event;
  std::set<std::string> known;
  int parts = 0, others_between = 0;
  std::size_t largest = 0;
  bool complete = false;
  while (!complete && parts < 200 && reader->Read(&event)) {
    page.Acknowledge(event.sequence());
    if (!event.has_annotation()) {
      others_between += parts > 0;
      continue;
    }
    const v1::AnnotationEvent& part = event.annotation();
    EXPECT_EQ(part.full(), parts == 0);
    largest = std::max(largest, event.ByteSizeLong());
    for (const v1::Annotation& one : part.upserted()) {
      EXPECT_EQ(one.ink_offset_m_size(), kPoints);
      known.insert(one.id());
    }
    ++parts;
    complete = !part.more();
  }
  EXPECT_TRUE(complete);
  EXPECT_EQ(known.size(), static_cast<std::size_t>(kStrokes));
  EXPECT_LE(largest, 257u << 10);
  EXPECT_GE(parts, 20);
  EXPECT_GE(others_between, 2) << "map and pose wait for no stroke";
  context.TryCancel();
}

TEST_F(LargeState, ListGivesAllInPagesOfAMebibyte) {
  PlainClient page(server_.address());
  v1::ListAnnotationsRequest request;
  std::set<std::string> known;
  int pages = 0;
  do {
    grpc::ClientContext context;
    v1::ListAnnotationsResponse response;
    const grpc::Status status = page.annotations->List(&context, request, &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_LE(response.ByteSizeLong(), 1u << 20);
    for (const v1::Annotation& one : response.annotations()) known.insert(one.id());
    request.set_page_token(response.next_page_token());
  } while (++pages < 100 && !request.page_token().empty());
  EXPECT_EQ(known.size(), static_cast<std::size_t>(kStrokes));
  EXPECT_EQ(pages, 6);
  request.set_page_token("somebody's");
  grpc::ClientContext context;
  v1::ListAnnotationsResponse response;
  const grpc::Status refused = page.annotations->List(&context, request, &response);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), ::testing::StartsWith("page_token: "));
}

TEST_F(LargeState, MoreInkThanTheQuotaIsRefusedInWords) {
  v1::CreateAnnotationResponse response;
  const grpc::Status status =
      artist_.Create(Stroke(artist_, artist_.NewestFrame(), 0), "", response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(),
              ::testing::HasSubstr("180000 of 180000 points of ink are taken and this needs 2000; "
                                   "delete some of your strokes"));
}

}  // namespace
}  // namespace saccade::large_state_test
