#pragma once

#include "saccade/v1/annotation.grpc.pb.h"
#include "server/rpc/backend.hpp"
#include "server/rpc/gatekeeper.hpp"

namespace saccade {

/// Placing, changing and removing annotations: check, submit to the tracker thread, answer after
/// the store's commit. Handlers run on gRPC's threads and never block.
class AnnotationService final : public v1::AnnotationService::CallbackService {
 public:
  AnnotationService(Backend& backend, Gatekeeper& gate);

 private:
  grpc::ServerUnaryReactor* Create(grpc::CallbackServerContext* context,
                                   const v1::CreateAnnotationRequest* request,
                                   v1::CreateAnnotationResponse* response) override;
  grpc::ServerUnaryReactor* Update(grpc::CallbackServerContext* context,
                                   const v1::UpdateAnnotationRequest* request,
                                   v1::UpdateAnnotationResponse* response) override;
  grpc::ServerUnaryReactor* Delete(grpc::CallbackServerContext* context,
                                   const v1::DeleteAnnotationRequest* request,
                                   v1::DeleteAnnotationResponse* response) override;
  grpc::ServerUnaryReactor* List(grpc::CallbackServerContext* context,
                                 const v1::ListAnnotationsRequest* request,
                                 v1::ListAnnotationsResponse* response) override;
  grpc::ServerUnaryReactor* Undo(grpc::CallbackServerContext* context,
                                 const v1::UndoAnnotationRequest* request,
                                 v1::UndoAnnotationResponse* response) override;
  grpc::ServerUnaryReactor* Redo(grpc::CallbackServerContext* context,
                                 const v1::RedoAnnotationRequest* request,
                                 v1::RedoAnnotationResponse* response) override;

  grpc::ServerUnaryReactor* TickCheckItem(grpc::CallbackServerContext* context,
                                          const v1::TickCheckItemRequest* request,
                                          v1::TickCheckItemResponse* response) override;
  grpc::ServerUnaryReactor* GetPicture(grpc::CallbackServerContext* context,
                                       const v1::GetPictureRequest* request,
                                       v1::GetPictureResponse* response) override;

  /// A call of an editor that is one command for the tracker thread: `make(call, session)` checks
  /// the request and makes it.
  template <typename Request, typename Make>
  grpc::ServerUnaryReactor* Edit(grpc::CallbackServerContext* context, const Request* request,
                                 const char* method, Make make);
  template <typename Request, typename Response>
  grpc::ServerUnaryReactor* TakeBack(grpc::CallbackServerContext* context, const Request* request,
                                     bool redo, Response* response);

  Backend& backend_;
  Gatekeeper& gate_;
};

}  // namespace saccade
