#include "server/rpc/recording_service.hpp"

#include "server/rpc/early_handler.hpp"

namespace saccade {
namespace {

void Fill(const RecordingState& state, v1::Recording& out) {
  out.set_on(state.on);
  out.set_file(state.file);
  out.set_since_unix_ns(state.since_unix_ns);
  out.set_bytes(state.bytes);
  out.set_messages(state.messages);
  out.set_events_lost(state.events_lost);
  out.set_problem(state.problem);
}

}  // namespace

RecordingService::RecordingService(RecordingPort* port, Gatekeeper& gate)
    : port_(port), gate_(gate) {
  // By their numbers in the proto.
  using Self = RecordingService;
  MarkMethodCallback(0, Early(gate, "RecordingService/GetRecording", this, &Self::GetRecording));
  MarkMethodCallback(1,
                     Early(gate, "RecordingService/StartRecording", this, &Self::StartRecording));
  MarkMethodCallback(2, Early(gate, "RecordingService/StopRecording", this, &Self::StopRecording));
}

absl::Status RecordingService::Enter(UnaryCall& call, Toll toll) {
  if (const auto access = call.Enter(gate_, toll); !access.ok()) return access.status();
  if (port_ != nullptr) return absl::OkStatus();
  return absl::FailedPreconditionError("recording: this server records nothing");
}

grpc::ServerUnaryReactor* RecordingService::GetRecording(Context* context,
                                                         const v1::GetRecordingRequest* /*request*/,
                                                         v1::GetRecordingResponse* response) {
  UnaryCall call(*context, "RecordingService/GetRecording", UnaryCall::Log::kNothing);
  if (absl::Status entered = Enter(call, Toll::kRead); !entered.ok()) return call.Finish(entered);
  Fill(port_->recording(), *response->mutable_recording());
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* RecordingService::StartRecording(
    Context* context, const v1::StartRecordingRequest* /*request*/,
    v1::StartRecordingResponse* response) {
  UnaryCall call(*context, "RecordingService/StartRecording", UnaryCall::Log::kAll);
  if (absl::Status entered = Enter(call, Toll::kReset); !entered.ok()) return call.Finish(entered);
  port_->StartRecording(call.Answer<RecordingState>(
      [response](const RecordingState& state) { Fill(state, *response->mutable_recording()); }));
  return call.reactor();
}

grpc::ServerUnaryReactor* RecordingService::StopRecording(
    Context* context, const v1::StopRecordingRequest* /*request*/,
    v1::StopRecordingResponse* response) {
  UnaryCall call(*context, "RecordingService/StopRecording", UnaryCall::Log::kAll);
  if (absl::Status entered = Enter(call, Toll::kReset); !entered.ok()) return call.Finish(entered);
  port_->StopRecording(call.Answer<RecordingState>(
      [response](const RecordingState& state) { Fill(state, *response->mutable_recording()); }));
  return call.reactor();
}

}  // namespace saccade
