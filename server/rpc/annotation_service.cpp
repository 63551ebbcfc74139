#include "server/rpc/annotation_service.hpp"

#include "server/rpc/annotation_pages.hpp"
#include "server/rpc/status.hpp"
#include "shared/wire/from_proto.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

grpc::ServerUnaryReactor* Refuse(grpc::ServerUnaryReactor* reactor, const char* method,
                                 const std::string& session_id, const absl::Status& status) {
  Audit(method, session_id, status);
  reactor->Finish(ToGrpc(status));
  return reactor;
}

wire::ImageSize ImageOf(const Backend& backend) {
  return {backend.facts().camera->width(), backend.facts().camera->height()};
}

absl::StatusOr<AnnotationPatch> PatchFromProto(const v1::UpdateAnnotationRequest& request,
                                               const wire::ImageSize& image) {
  AnnotationPatch patch;
  if (absl::Status id = wire::CheckUuid(request.id(), "id"); !id.ok()) return id;
  patch.id = request.id();
  if (request.has_text()) {
    absl::Status text = wire::CheckText(request.text(), kMaxTextBytes, "text");
    if (!text.ok()) return text;
    patch.text = request.text();
  }
  if (request.has_size_m()) {
    const absl::StatusOr<double> size_m = wire::CheckSize(request.size_m(), "size_m");
    if (!size_m.ok()) return size_m.status();
    patch.size_m = *size_m;
  }
  if (request.has_color_rgba()) patch.color_rgba = request.color_rgba();
  if (request.has_target()) {
    absl::StatusOr<AnnotationTarget> target = wire::FromProto(request.target(), image, "target");
    if (!target.ok()) return target.status();
    patch.target = *std::move(target);
  }
  return patch;
}

}  // namespace

void AnnotationService::Submit(grpc::ServerUnaryReactor* reactor, const char* method,
                               const std::string& session_id, Command command) {
  // Never blocks: the tracker thread resolves the anchor, the store commits, then `done` finishes.
  const absl::Status queued = backend_.Submit(std::move(command));
  if (!queued.ok()) Refuse(reactor, method, session_id, queued);
}

template <typename Response>
Done<Annotation> AnnotationService::Answer(grpc::ServerUnaryReactor* reactor, Response* response,
                                           const char* method, const std::string& session_id) {
  return [reactor, response, method, session_id](const absl::StatusOr<Annotation>& annotation) {
    if (annotation.ok()) *response->mutable_annotation() = wire::ToProto(*annotation);
    Audit(method, session_id, annotation.status());
    reactor->Finish(ToGrpc(annotation.status()));
  };
}

grpc::ServerUnaryReactor* AnnotationService::Create(grpc::CallbackServerContext* context,
                                                    const v1::CreateAnnotationRequest* request,
                                                    v1::CreateAnnotationResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const absl::StatusOr<Session> session =
      gate_.Editor(*context, Toll::kEdit, request->session_id());
  if (!session.ok()) return Refuse(reactor, "Create", "", session.status());
  if (!request->request_id().empty()) {
    absl::Status uuid = wire::CheckUuid(request->request_id(), "request_id");
    if (!uuid.ok()) return Refuse(reactor, "Create", session->participant_id, uuid);
  }
  absl::StatusOr<AnnotationDraft> draft = wire::FromProto(request->draft(), ImageOf(backend_));
  if (!draft.ok()) return Refuse(reactor, "Create", session->participant_id, draft.status());
  draft->request_id = request->request_id();
  draft->author = session->display_name;
  Submit(reactor, "Create", session->participant_id,
         CreateAnnotation{session->participant_id, *std::move(draft),
                          Answer(reactor, response, "Create", session->participant_id)});
  return reactor;
}

grpc::ServerUnaryReactor* AnnotationService::Update(grpc::CallbackServerContext* context,
                                                    const v1::UpdateAnnotationRequest* request,
                                                    v1::UpdateAnnotationResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const absl::StatusOr<Session> session =
      gate_.Editor(*context, Toll::kEdit, request->session_id());
  if (!session.ok()) return Refuse(reactor, "Update", "", session.status());
  absl::StatusOr<AnnotationPatch> patch = PatchFromProto(*request, ImageOf(backend_));
  if (!patch.ok()) return Refuse(reactor, "Update", session->participant_id, patch.status());
  Submit(reactor, "Update", session->participant_id,
         UpdateAnnotation{session->participant_id, *std::move(patch),
                          Answer(reactor, response, "Update", session->participant_id)});
  return reactor;
}

grpc::ServerUnaryReactor* AnnotationService::Delete(grpc::CallbackServerContext* context,
                                                    const v1::DeleteAnnotationRequest* request,
                                                    v1::DeleteAnnotationResponse* /*response*/) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const absl::StatusOr<Session> session =
      gate_.Editor(*context, Toll::kEdit, request->session_id());
  if (!session.ok()) return Refuse(reactor, "Delete", "", session.status());
  if (absl::Status uuid = wire::CheckUuid(request->id(), "id"); !uuid.ok()) {
    return Refuse(reactor, "Delete", session->participant_id, uuid);
  }
  Submit(reactor, "Delete", session->participant_id,
         DeleteAnnotation{session->participant_id, request->id(),
                          [reactor, id = session->participant_id](const absl::Status& status) {
                            Audit("Delete", id, status);
                            reactor->Finish(ToGrpc(status));
                          }});
  return reactor;
}

grpc::ServerUnaryReactor* AnnotationService::List(grpc::CallbackServerContext* context,
                                                  const v1::ListAnnotationsRequest* request,
                                                  v1::ListAnnotationsResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  if (absl::Status often = gate_.Anyone(*context, Toll::kRead); !often.ok()) {
    return Refuse(reactor, "List", "", often);
  }
  // Not those of the newest frame: an edit that was answered is here at once. Held: the list is
  // replaced by every frame and edit meanwhile.
  const std::shared_ptr<const AnnotationList> annotations = backend_.annotations();
  reactor->Finish(ToGrpc(ListPage(*annotations, *request, *response)));
  return reactor;
}

template <typename Response>
grpc::ServerUnaryReactor* AnnotationService::TakeBack(grpc::CallbackServerContext* context,
                                                      const std::string& session_id, bool redo,
                                                      Response* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const char* method = redo ? "Redo" : "Undo";
  const absl::StatusOr<Session> session = gate_.Editor(*context, Toll::kEdit, session_id);
  if (!session.ok()) return Refuse(reactor, method, "", session.status());
  Submit(reactor, method, session->participant_id,
         UndoChange{session->participant_id, redo,
                    [reactor, response, method,
                     id = session->participant_id](const absl::StatusOr<std::string>& description) {
                      if (description.ok()) response->set_description(*description);
                      Audit(method, id, description.status());
                      reactor->Finish(ToGrpc(description.status()));
                    }});
  return reactor;
}

grpc::ServerUnaryReactor* AnnotationService::Undo(grpc::CallbackServerContext* context,
                                                  const v1::UndoAnnotationRequest* request,
                                                  v1::UndoAnnotationResponse* response) {
  return TakeBack(context, request->session_id(), false, response);
}

grpc::ServerUnaryReactor* AnnotationService::Redo(grpc::CallbackServerContext* context,
                                                  const v1::RedoAnnotationRequest* request,
                                                  v1::RedoAnnotationResponse* response) {
  return TakeBack(context, request->session_id(), true, response);
}

}  // namespace saccade
