#include "server/rpc/calibration_service.hpp"

#include <utility>

#include "server/rpc/early_handler.hpp"
#include "server/rpc/unary_call.hpp"
#include "shared/wire/from_proto.hpp"

namespace saccade {
namespace {

constexpr std::size_t kLongestTarget = 200, kLongestName = 40;

absl::Status Nobody() {
  return absl::FailedPreconditionError("calibration: this server calibrates no camera");
}

v1::CalibrationPhase ToProto(CalibrationState::Phase phase) {
  switch (phase) {
    case CalibrationState::Phase::kIdle:
      return v1::CALIBRATION_PHASE_IDLE;
    case CalibrationState::Phase::kShowing:
      return v1::CALIBRATION_PHASE_SHOWING;
    case CalibrationState::Phase::kFitting:
      return v1::CALIBRATION_PHASE_FITTING;
    case CalibrationState::Phase::kDone:
      return v1::CALIBRATION_PHASE_DONE;
    case CalibrationState::Phase::kFailed:
      return v1::CALIBRATION_PHASE_FAILED;
  }
  return v1::CALIBRATION_PHASE_UNSPECIFIED;
}

void Fill(const CalibrationResult& result, v1::CalibrationFit& fit) {
  fit.set_model(result.model);
  fit.set_rms_px(result.rms_px);
  fit.set_held_out_rms_px(result.held_out_rms_px);
  for (const CalibrationResult::Parameter& parameter : result.parameters) {
    v1::CalibrationParameter& message = *fit.add_parameters();
    message.set_name(parameter.name);
    message.set_value(parameter.value);
    message.set_sigma(parameter.sigma);
  }
  for (const CalibrationResult::View& view : result.views) {
    v1::CalibrationViewFit& message = *fit.add_views();
    message.set_frame_id(view.frame);
    message.set_rms_px(view.rms_px);
    message.set_rejected(view.rejected);
    message.set_held_out(view.held_out);
  }
  fit.mutable_residuals_px()->Add(result.residuals_px.begin(), result.residuals_px.end());
  fit.set_doubt(result.doubt);
}

void Fill(const CalibrationPicture& picture, v1::CalibrationPicture& message) {
  message.set_frame_id(picture.frame);
  message.set_width_px(picture.width);
  message.set_height_px(picture.height);
  message.set_jpeg(picture.jpeg);
  message.mutable_corners_px()->Add(picture.corners_px.begin(), picture.corners_px.end());
  message.set_taken(picture.taken);
}

void Fill(const CalibrationState& state, const v1::GetCalibrationRequest& request,
          v1::Calibration& message) {
  message.set_phase(ToProto(state.phase));
  message.set_target(state.target);
  message.set_target_words(state.target_words);
  message.set_views(state.views);
  message.set_enough_views(state.enough_views);
  message.set_covered(state.covered);
  message.set_columns(state.columns);
  message.set_rows(state.rows);
  message.mutable_counts()->Add(state.counts.begin(), state.counts.end());
  message.set_advice(state.advice);
  message.set_fit_revision(state.result_revision);
  if (state.result && request.known_fit_revision() != state.result_revision) {
    Fill(*state.result, *message.mutable_fit());
  }
  message.set_problem(state.problem);
  const bool known = state.picture && request.known_frame_id() != 0 &&
                     request.known_frame_id() == state.picture->frame;
  if (state.picture && !known) Fill(*state.picture, *message.mutable_picture());
  message.set_saved_as(state.saved_as);
}

}  // namespace

CalibrationService::CalibrationService(CalibrationPort* port, Gatekeeper& gate)
    : port_(port), gate_(gate) {
  // By their numbers in the proto.
  using Self = CalibrationService;
  MarkMethodCallback(0,
                     Early(gate, "CalibrationService/GetCalibration", this, &Self::GetCalibration));
  MarkMethodCallback(
      1, Early(gate, "CalibrationService/StartCalibration", this, &Self::StartCalibration));
  MarkMethodCallback(
      2, Early(gate, "CalibrationService/FinishCalibration", this, &Self::FinishCalibration));
  MarkMethodCallback(
      3, Early(gate, "CalibrationService/StopCalibration", this, &Self::StopCalibration));
  MarkMethodCallback(
      4, Early(gate, "CalibrationService/GetCalibrationFile", this, &Self::GetCalibrationFile));
  MarkMethodCallback(
      5, Early(gate, "CalibrationService/SaveCalibration", this, &Self::SaveCalibration));
}

grpc::ServerUnaryReactor* CalibrationService::GetCalibration(
    Context* context, const v1::GetCalibrationRequest* request,
    v1::GetCalibrationResponse* response) {
  UnaryCall call(*context, "CalibrationService/GetCalibration", UnaryCall::Log::kRefusals);
  const absl::StatusOr<Session> session = call.Member(gate_, std::nullopt, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  if (port_ == nullptr) return call.Finish(Nobody());
  Fill(*port_->state(), *request, *response->mutable_calibration());
  call.set_log(UnaryCall::Log::kNothing);
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* CalibrationService::StartCalibration(
    Context* context, const v1::StartCalibrationRequest* request,
    v1::StartCalibrationResponse* /*response*/) {
  UnaryCall call(*context, "CalibrationService/StartCalibration", UnaryCall::Log::kAll);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kStill, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  if (port_ == nullptr) return call.Finish(Nobody());
  absl::Status valid = wire::CheckText(request->target(), kLongestTarget, "target");
  if (valid.ok()) valid = wire::CheckText(request->lens(), kLongestName, "lens");
  if (!valid.ok()) return call.Finish(valid);
  port_->StartCalibration(request->target(), request->lens(), call.Answer());
  return call.reactor();
}

grpc::ServerUnaryReactor* CalibrationService::FinishCalibration(
    Context* context, const v1::FinishCalibrationRequest* request,
    v1::FinishCalibrationResponse* /*response*/) {
  UnaryCall call(*context, "CalibrationService/FinishCalibration", UnaryCall::Log::kAll);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kStill, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  if (port_ == nullptr) return call.Finish(Nobody());
  port_->FinishCalibration(call.Answer());
  return call.reactor();
}

grpc::ServerUnaryReactor* CalibrationService::StopCalibration(
    Context* context, const v1::StopCalibrationRequest* request,
    v1::StopCalibrationResponse* /*response*/) {
  UnaryCall call(*context, "CalibrationService/StopCalibration", UnaryCall::Log::kAll);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kStill, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  if (port_ == nullptr) return call.Finish(Nobody());
  port_->StopCalibration(call.Answer());
  return call.reactor();
}

grpc::ServerUnaryReactor* CalibrationService::GetCalibrationFile(
    Context* context, const v1::GetCalibrationFileRequest* request,
    v1::GetCalibrationFileResponse* response) {
  UnaryCall call(*context, "CalibrationService/GetCalibrationFile", UnaryCall::Log::kRefusals);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kRead, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  if (port_ == nullptr) return call.Finish(Nobody());
  absl::StatusOr<CalibrationFile> file = port_->File(request->form());
  if (!file.ok()) return call.Finish(file.status());
  response->set_file_name(file->name);
  response->set_text(file->text);
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* CalibrationService::SaveCalibration(
    Context* context, const v1::SaveCalibrationRequest* request,
    v1::SaveCalibrationResponse* response) {
  UnaryCall call(*context, "CalibrationService/SaveCalibration", UnaryCall::Log::kAll);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kEdit, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  if (port_ == nullptr) return call.Finish(Nobody());
  port_->SaveCalibration(
      call.Answer<std::string>([response](const std::string& file) { response->set_file(file); }));
  return call.reactor();
}

}  // namespace saccade
