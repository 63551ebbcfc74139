#include "server/rpc/replay_service.hpp"

#include "server/rpc/early_handler.hpp"

namespace saccade {
namespace {

void Fill(const ReplayState& state, v1::Replay& out) {
  out.set_file(state.file);
  out.set_playing(state.playing);
  out.set_position_s(state.position_s);
  out.set_length_s(state.length_s);
  out.set_speed(state.speed);
}

}  // namespace

ReplayService::ReplayService(ReplayPort* port, Gatekeeper& gate) : port_(port), gate_(gate) {
  // By their numbers in the proto.
  MarkMethodCallback(0, Early(gate, "ReplayService/GetReplay", this, &ReplayService::GetReplay));
  MarkMethodCallback(1,
                     Early(gate, "ReplayService/ChangeReplay", this, &ReplayService::ChangeReplay));
}

absl::Status ReplayService::Enter(UnaryCall& call, Toll toll) {
  if (const auto access = call.Enter(gate_, toll); !access.ok()) return access.status();
  if (port_ != nullptr) return absl::OkStatus();
  return absl::FailedPreconditionError(
      "replay: this server plays no recording: start one with --source replay:FILE");
}

grpc::ServerUnaryReactor* ReplayService::GetReplay(Context* context,
                                                   const v1::GetReplayRequest* /*request*/,
                                                   v1::GetReplayResponse* response) {
  UnaryCall call(*context, "ReplayService/GetReplay", UnaryCall::Log::kNothing);
  if (absl::Status entered = Enter(call, Toll::kRead); !entered.ok()) return call.Finish(entered);
  Fill(port_->replay(), *response->mutable_replay());
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* ReplayService::ChangeReplay(Context* context,
                                                      const v1::ChangeReplayRequest* request,
                                                      v1::ChangeReplayResponse* response) {
  UnaryCall call(*context, "ReplayService/ChangeReplay", UnaryCall::Log::kAll);
  if (absl::Status entered = Enter(call, Toll::kEdit); !entered.ok()) return call.Finish(entered);
  ReplayChange change;
  if (request->has_playing()) change.playing = request->playing();
  if (request->has_position_s()) change.position_s = request->position_s();
  if (request->has_speed()) change.speed = request->speed();
  port_->Change(change, call.Answer<ReplayState>([response](const ReplayState& state) {
    Fill(state, *response->mutable_replay());
  }));
  return call.reactor();
}

}  // namespace saccade
