#include "server/rpc/annotation_service.hpp"

#include "server/rpc/annotation_pages.hpp"
#include "server/rpc/early_handler.hpp"
#include "server/rpc/unary_call.hpp"
#include "shared/wire/from_proto.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

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

template <typename Response>
Done<Annotation> AnswerWithAnnotation(const UnaryCall& call, Response* response) {
  return call.Answer<Annotation>([response](const Annotation& annotation) {
    *response->mutable_annotation() = wire::ToProto(annotation);
  });
}

}  // namespace

AnnotationService::AnnotationService(Backend& backend, Gatekeeper& gate)
    : backend_(backend), gate_(gate) {
  // By their numbers in the proto; limits_test calls every one.
  MarkMethodCallback(0, Early(gate, "AnnotationService/Create", this, &AnnotationService::Create));
  MarkMethodCallback(1, Early(gate, "AnnotationService/Update", this, &AnnotationService::Update));
  MarkMethodCallback(2, Early(gate, "AnnotationService/Delete", this, &AnnotationService::Delete));
  MarkMethodCallback(3, Early(gate, "AnnotationService/List", this, &AnnotationService::List));
  MarkMethodCallback(4, Early(gate, "AnnotationService/Undo", this, &AnnotationService::Undo));
  MarkMethodCallback(5, Early(gate, "AnnotationService/Redo", this, &AnnotationService::Redo));
}

template <typename Request, typename Make>
grpc::ServerUnaryReactor* AnnotationService::Edit(grpc::CallbackServerContext* context,
                                                  const Request* request, const char* method,
                                                  Make make) {
  UnaryCall call(*context, method, UnaryCall::Log::kAll);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kEdit, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  absl::StatusOr<Command> command = make(call, *session);
  if (!command.ok()) return call.Finish(command.status());
  // Never blocks: the tracker thread resolves the anchor, the store commits, then `done` finishes.
  return call.Submitted(backend_.Submit(*std::move(command)));
}

grpc::ServerUnaryReactor* AnnotationService::Create(grpc::CallbackServerContext* context,
                                                    const v1::CreateAnnotationRequest* request,
                                                    v1::CreateAnnotationResponse* response) {
  return Edit(context, request, "AnnotationService/Create",
              [&](UnaryCall& call, const Session& session) -> absl::StatusOr<Command> {
                if (!request->request_id().empty()) {
                  absl::Status uuid = wire::CheckUuid(request->request_id(), "request_id");
                  if (!uuid.ok()) return uuid;
                }
                absl::StatusOr<AnnotationDraft> draft =
                    wire::FromProto(request->draft(), ImageOf(backend_));
                if (!draft.ok()) return draft.status();
                draft->request_id = request->request_id();
                draft->author = session.display_name;
                return CreateAnnotation{session.participant_id, *std::move(draft),
                                        AnswerWithAnnotation(call, response)};
              });
}

grpc::ServerUnaryReactor* AnnotationService::Update(grpc::CallbackServerContext* context,
                                                    const v1::UpdateAnnotationRequest* request,
                                                    v1::UpdateAnnotationResponse* response) {
  return Edit(context, request, "AnnotationService/Update",
              [&](UnaryCall& call, const Session& session) -> absl::StatusOr<Command> {
                absl::StatusOr<AnnotationPatch> patch = PatchFromProto(*request, ImageOf(backend_));
                if (!patch.ok()) return patch.status();
                return UpdateAnnotation{session.participant_id, *std::move(patch),
                                        AnswerWithAnnotation(call, response)};
              });
}

grpc::ServerUnaryReactor* AnnotationService::Delete(grpc::CallbackServerContext* context,
                                                    const v1::DeleteAnnotationRequest* request,
                                                    v1::DeleteAnnotationResponse* /*response*/) {
  return Edit(context, request, "AnnotationService/Delete",
              [&](UnaryCall& call, const Session& session) -> absl::StatusOr<Command> {
                absl::Status uuid = wire::CheckUuid(request->id(), "id");
                if (!uuid.ok()) return uuid;
                return DeleteAnnotation{session.participant_id, request->id(), call.Answer()};
              });
}

grpc::ServerUnaryReactor* AnnotationService::List(grpc::CallbackServerContext* context,
                                                  const v1::ListAnnotationsRequest* request,
                                                  v1::ListAnnotationsResponse* response) {
  UnaryCall call(*context, "AnnotationService/List", UnaryCall::Log::kRefusals);
  if (const auto access = call.Enter(gate_, Toll::kRead); !access.ok()) {
    return call.Finish(access.status());
  }
  call.set_log(UnaryCall::Log::kNothing);
  // Not those of the newest frame: an edit that was answered is here at once. Held: the list is
  // replaced by every frame and edit meanwhile.
  const std::shared_ptr<const AnnotationList> annotations = backend_.annotations();
  return call.Finish(ListPage(*annotations, *request, *response));
}

template <typename Request, typename Response>
grpc::ServerUnaryReactor* AnnotationService::TakeBack(grpc::CallbackServerContext* context,
                                                      const Request* request, bool redo,
                                                      Response* response) {
  return Edit(context, request, redo ? "AnnotationService/Redo" : "AnnotationService/Undo",
              [&](UnaryCall& call, const Session& session) -> absl::StatusOr<Command> {
                const auto fill = [response](const std::string& description) {
                  response->set_description(description);
                };
                return UndoChange{session.participant_id, redo, call.Answer<std::string>(fill)};
              });
}

grpc::ServerUnaryReactor* AnnotationService::Undo(grpc::CallbackServerContext* context,
                                                  const v1::UndoAnnotationRequest* request,
                                                  v1::UndoAnnotationResponse* response) {
  return TakeBack(context, request, false, response);
}

grpc::ServerUnaryReactor* AnnotationService::Redo(grpc::CallbackServerContext* context,
                                                  const v1::RedoAnnotationRequest* request,
                                                  v1::RedoAnnotationResponse* response) {
  return TakeBack(context, request, true, response);
}

}  // namespace saccade
