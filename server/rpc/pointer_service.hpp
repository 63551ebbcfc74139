#pragma once

#include "saccade/v1/pointer.grpc.pb.h"
#include "server/rpc/backend.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/pointer_board.hpp"

namespace saccade {

/// saccade.v1.PointerService: where somebody points, for everybody who watches. Nothing of it is
/// kept, and it stands in no log.
class PointerService final : public v1::PointerService::CallbackService {
 public:
  /// All outlive the service.
  PointerService(Backend& backend, PointerBoard& board, Gatekeeper& gate);

  grpc::ServerUnaryReactor* Point(grpc::CallbackServerContext* context,
                                  const v1::PointRequest* request,
                                  v1::PointResponse* response) override;

 private:
  absl::Status Say(const v1::PointRequest& request, const Session& session);

  Backend& backend_;
  PointerBoard& board_;
  Gatekeeper& gate_;
};

}  // namespace saccade
