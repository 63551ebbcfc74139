// Recordings on the server's disk.
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

}  // namespace

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
