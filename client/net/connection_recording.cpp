// Recordings on the server's disk, and one that is played.
#include "client/net/connection.hpp"
#include "client/net/connection_impl.hpp"

namespace saccade::net {
namespace {

using RecordingStub = v1::RecordingService::Stub;

template <typename Response>
absl::StatusOr<Recording> RecordingOf(const absl::StatusOr<Response>& response) {
  if (!response.ok()) return response.status();
  const v1::Recording& from = response->recording();
  return Recording{from.on(),       from.file(),        from.since_unix_ns(), from.bytes(),
                   from.messages(), from.events_lost(), from.problem()};
}

template <typename Response>
absl::StatusOr<Replay> ReplayOf(const absl::StatusOr<Response>& response) {
  if (!response.ok()) return response.status();
  const v1::Replay& from = response->replay();
  return Replay{from.file(), from.playing(), from.position_s(), from.length_s(), from.speed()};
}

}  // namespace

absl::StatusOr<Replay> Connection::GetReplay() {
  return ReplayOf(
      impl_->Call(*impl_->replay_, &v1::ReplayService::Stub::GetReplay, v1::GetReplayRequest()));
}

absl::StatusOr<Replay> Connection::ChangeReplay(const ReplayChange& change) {
  v1::ChangeReplayRequest request;
  if (change.playing) request.set_playing(*change.playing);
  if (change.position_s) request.set_position_s(*change.position_s);
  if (change.speed) request.set_speed(*change.speed);
  return ReplayOf(impl_->Call(*impl_->replay_, &v1::ReplayService::Stub::ChangeReplay, request));
}

absl::StatusOr<Recording> Connection::GetRecording() {
  return RecordingOf(
      impl_->Call(*impl_->recording_, &RecordingStub::GetRecording, v1::GetRecordingRequest()));
}

absl::StatusOr<Recording> Connection::StartRecording() {
  return RecordingOf(
      impl_->Call(*impl_->recording_, &RecordingStub::StartRecording, v1::StartRecordingRequest()));
}

absl::StatusOr<Recording> Connection::StopRecording() {
  return RecordingOf(
      impl_->Call(*impl_->recording_, &RecordingStub::StopRecording, v1::StopRecordingRequest()));
}

}  // namespace saccade::net
