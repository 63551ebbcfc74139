// The head of the wearable.
#include "client/net/connection_impl.hpp"
#include "shared/wire/gaze.hpp"

namespace saccade::net {

absl::StatusOr<GazeSnapshot> Connection::GetGaze() {
  auto response =
      impl_->Call(*impl_->gaze_, &v1::GazeService::Stub::GetState, v1::GetGazeStateRequest());
  if (!response.ok()) return response.status();
  return wire::FromProto(response->state(), "state");
}

absl::StatusOr<Lease> Connection::AcquireLease(const std::string& lease_id) {
  v1::AcquireLeaseRequest request;
  request.set_lease_id(lease_id);
  auto response =
      impl_->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::AcquireLease, std::move(request));
  if (!response.ok()) return response.status();
  return Lease{response->granted(),
               response->lease_id(),
               response->queue_position(),
               {response->pilot().participant_id(), response->pilot().display_name()}};
}

absl::Status Connection::ReleaseLease() {
  return impl_
      ->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::ReleaseLease,
                      v1::ReleaseLeaseRequest())
      .status();
}

absl::StatusOr<GazeSnapshot> Connection::Fixate(const GazeTarget& target, bool fast) {
  v1::FixateRequest request;
  *request.mutable_target() = wire::ToProto(target);
  request.set_fast(fast);
  auto response =
      impl_->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::Fixate, std::move(request));
  if (!response.ok()) return response.status();
  return wire::FromProto(response->state(), "state");
}

absl::StatusOr<GazeSnapshot> Connection::StopFixating() {
  auto response = impl_->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::StopFixating,
                                       v1::StopFixatingRequest());
  if (!response.ok()) return response.status();
  return wire::FromProto(response->state(), "state");
}

absl::StatusOr<GazeSnapshot> Connection::Home() {
  auto response =
      impl_->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::Home, v1::HomeRequest());
  if (!response.ok()) return response.status();
  return wire::FromProto(response->state(), "state");
}

absl::StatusOr<GazeSnapshot> Connection::KeepHorizon() {
  auto response = impl_->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::KeepHorizon,
                                       v1::KeepHorizonRequest());
  if (!response.ok()) return response.status();
  return wire::FromProto(response->state(), "state");
}

absl::StatusOr<GazeSnapshot> Connection::Explore() {
  auto response =
      impl_->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::Explore, v1::ExploreRequest());
  if (!response.ok()) return response.status();
  return wire::FromProto(response->state(), "state");
}

absl::StatusOr<GazeSnapshot> Connection::CalibrateMount() {
  auto response = impl_->CallInSession(*impl_->gaze_, &v1::GazeService::Stub::CalibrateMount,
                                       v1::CalibrateMountRequest());
  if (!response.ok()) return response.status();
  return wire::FromProto(response->state(), "state");
}

absl::StatusOr<MountCalibrationReport> Connection::GetMountCalibration() {
  auto response = impl_->Call(*impl_->gaze_, &v1::GazeService::Stub::GetMountCalibration,
                              v1::GetMountCalibrationRequest());
  if (!response.ok()) return response.status();
  return wire::FromProto(response->calibration(), "calibration");
}

}  // namespace saccade::net
