// Calls by the thousand.
#include <memory>

#include "client/net/connection.hpp"
#include "saccade/v1/annotation.pb.h"
#include "saccade/v1/gaze.pb.h"
#include "saccade/v1/map.pb.h"
#include "saccade/v1/session.pb.h"
#include "tests/integration/attack/attacks.hpp"

namespace saccade::testing {
namespace {

struct OneCall {
  grpc::ClientContext context;
  grpc::ByteBuffer request, response;
  RawReply reply;
  std::unique_ptr<grpc::GenericClientAsyncResponseReader> reader;
};

void Count(const Battle& battle, const RawReply& reply) {
  battle.tally.Add(reply.status);
  if (reply.RefusedWithRetry()) battle.tally.Add("refused with a retry time");
}

}  // namespace

void Flood(const Battle& battle, const std::vector<FloodCall>& calls, double per_second) {
  constexpr int kUnderWay = 100;
  const auto channel = battle.target.NewChannel();
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  int under_way = 0;
  const auto take = [&](milliseconds wait) {
    void* tag = nullptr;
    bool ok = false;
    const auto until = std::chrono::system_clock::now() + wait;
    if (queue.AsyncNext(&tag, &ok, until) != grpc::CompletionQueue::GOT_EVENT) return false;
    const std::unique_ptr<OneCall> call(static_cast<OneCall*>(tag));
    Count(battle, call->reply);
    --under_way;
    return true;
  };
  const auto from = Clock::now();
  for (std::size_t sent = 0; !battle.over();) {
    const std::chrono::duration<double> elapsed = Clock::now() - from;
    if (static_cast<double>(sent) > elapsed.count() * per_second || under_way >= kUnderWay) {
      take(milliseconds(2));
      continue;
    }
    const FloodCall& what = calls[sent++ % calls.size()];
    auto* call = new OneCall;
    call->context.set_deadline(std::chrono::system_clock::now() + seconds(5));
    const grpc::Slice slice(what.request);
    call->request = grpc::ByteBuffer(&slice, 1);
    call->reader = stub.PrepareUnaryCall(&call->context, what.method, call->request, &queue);
    call->reader->StartCall();
    call->reader->Finish(&call->response, &call->reply.status, call);
    ++under_way;
  }
  for (const auto end = Clock::now() + seconds(8); under_way > 0 && Clock::now() < end;) {
    take(milliseconds(100));
  }
  queue.Shutdown();
}

FloodCall JoinCall() {
  v1::JoinRequest request;
  request.set_display_name("flood");
  request.set_role(v1::ROLE_EXPERT);
  return {"/saccade.v1.SessionService/Join", request.SerializeAsString()};
}

std::vector<FloodCall> CostlyCalls(const std::string& session_id) {
  v1::ResetMapRequest reset;
  reset.set_session_id(session_id);
  v1::GetFrameRequest frame;
  frame.set_view(v1::VIDEO_VIEW_AUGMENTED);
  v1::CreateAnnotationRequest create;
  create.set_session_id(session_id);
  create.mutable_draft()->set_text("flood");
  create.mutable_draft()->mutable_target()->mutable_point_in_world_m()->set_z(1);
  v1::AcquireLeaseRequest lease;
  lease.set_session_id(session_id);
  v1::UndoAnnotationRequest undo;
  undo.set_session_id(session_id);
  v1::AcknowledgeRequest key_frame;
  key_frame.set_session_id(session_id);
  key_frame.set_request_key_frame(true);
  return {{"/saccade.v1.MapService/Reset", reset.SerializeAsString()},
          {"/saccade.v1.SessionService/GetFrame", frame.SerializeAsString()},
          {"/saccade.v1.AnnotationService/Create", create.SerializeAsString()},
          {"/saccade.v1.GazeService/AcquireLease", lease.SerializeAsString()},
          {"/saccade.v1.AnnotationService/Undo", undo.SerializeAsString()},
          {"/saccade.v1.SessionService/Acknowledge", key_frame.SerializeAsString()},
          {"/saccade.v1.MapService/Export", ""},
          {"/saccade.v1.MapService/Get", ""}};
}

void QueueForLease(const Battle& battle, int sessions) {
  const auto channel = battle.target.NewChannel();
  const auto joined_by = Clock::now() + (battle.end - Clock::now()) / 3;
  std::vector<FloodCall> waiting;
  while (static_cast<int>(waiting.size()) < sessions && Clock::now() < joined_by) {
    v1::AcquireLeaseRequest request;
    request.set_session_id(JoinSession(channel, v1::ROLE_EXPERT, milliseconds(500),
                                       "waits in the queue " + std::string(40, 'q')));
    if (request.session_id().empty()) continue;
    waiting.push_back({"/saccade.v1.GazeService/AcquireLease", request.SerializeAsString()});
  }
  battle.tally.Add("sessions in the queue", static_cast<long>(waiting.size()));
  if (waiting.empty()) return;
  // Each twice a second: a place in the queue is kept by asking.
  Flood(battle, waiting, 2.0 * static_cast<double>(waiting.size()));
}

}  // namespace saccade::testing
