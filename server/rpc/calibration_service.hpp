#pragma once

#include "saccade/v1/calibration.grpc.pb.h"
#include "server/pipeline/calibration.hpp"
#include "server/rpc/gatekeeper.hpp"

namespace saccade {

/// The camera's calibration. Handlers run on gRPC's threads and never block.
class CalibrationService final : public v1::CalibrationService::CallbackService {
 public:
  /// `port` null: every call answers FailedPrecondition. Else it outlives the service.
  CalibrationService(CalibrationPort* port, Gatekeeper& gate);

 private:
  using Context = grpc::CallbackServerContext;
  grpc::ServerUnaryReactor* GetCalibration(Context* context,
                                           const v1::GetCalibrationRequest* request,
                                           v1::GetCalibrationResponse* response) override;
  grpc::ServerUnaryReactor* StartCalibration(Context* context,
                                             const v1::StartCalibrationRequest* request,
                                             v1::StartCalibrationResponse* response) override;
  grpc::ServerUnaryReactor* FinishCalibration(Context* context,
                                              const v1::FinishCalibrationRequest* request,
                                              v1::FinishCalibrationResponse* response) override;
  grpc::ServerUnaryReactor* StopCalibration(Context* context,
                                            const v1::StopCalibrationRequest* request,
                                            v1::StopCalibrationResponse* response) override;
  grpc::ServerUnaryReactor* GetCalibrationFile(Context* context,
                                               const v1::GetCalibrationFileRequest* request,
                                               v1::GetCalibrationFileResponse* response) override;
  grpc::ServerUnaryReactor* SaveCalibration(Context* context,
                                            const v1::SaveCalibrationRequest* request,
                                            v1::SaveCalibrationResponse* response) override;

  CalibrationPort* port_;
  Gatekeeper& gate_;
};

}  // namespace saccade
