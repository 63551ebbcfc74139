#include "server/rpc/annotation_service.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>
#include <utility>

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

Editor EditorOf(const Session& session, const std::string& edit_group = "") {
  Editor editor;
  editor.person_id = session.person_id;
  editor.participant_id = session.participant_id;
  editor.name = session.display_name;
  editor.wearer = session.role == v1::ROLE_WEARER;
  editor.edit_group = edit_group;
  return editor;
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
  MarkMethodCallback(
      6, Early(gate, "AnnotationService/TickCheckItem", this, &AnnotationService::TickCheckItem));
  MarkMethodCallback(
      7, Early(gate, "AnnotationService/GetPicture", this, &AnnotationService::GetPicture));
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
  UnaryCall call(*context, "AnnotationService/Create", UnaryCall::Log::kAll);
  const bool picture = !request->draft().picture().empty();
  const absl::StatusOr<Session> session =
      call.Member(gate_, picture ? Toll::kPicture : Toll::kEdit, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  if (!request->request_id().empty()) {
    absl::Status uuid = wire::CheckUuid(request->request_id(), "request_id");
    if (!uuid.ok()) return call.Finish(uuid);
  }
  if (absl::Status group = wire::CheckEditGroup(request->edit_group()); !group.ok()) {
    return call.Finish(group);
  }
  absl::StatusOr<AnnotationDraft> draft = wire::FromProto(request->draft(), ImageOf(backend_));
  if (!draft.ok()) return call.Finish(draft.status());
  draft->request_id = request->request_id();
  draft->author = session->display_name;
  CreateAnnotation command{EditorOf(*session, request->edit_group()), *std::move(draft),
                           AnswerWithAnnotation(call, response)};
  if (!picture) return call.Submitted(backend_.Submit(std::move(command)));
  // Decoded first, on another thread.
  backend_.ReadPicture(
      request->draft().picture(),
      [this, call, command = std::move(command)](const absl::StatusOr<PicturePtr>& read) mutable {
        if (!read.ok()) {
          call.Finish(read.status());
          return;
        }
        command.draft.picture = *read;
        call.Submitted(backend_.Submit(std::move(command)));
      });
  return call.reactor();
}

grpc::ServerUnaryReactor* AnnotationService::Update(grpc::CallbackServerContext* context,
                                                    const v1::UpdateAnnotationRequest* request,
                                                    v1::UpdateAnnotationResponse* response) {
  return Edit(context, request, "AnnotationService/Update",
              [&](UnaryCall& call, const Session& session) -> absl::StatusOr<Command> {
                absl::Status group = wire::CheckEditGroup(request->edit_group());
                if (!group.ok()) return group;
                absl::StatusOr<AnnotationPatch> patch =
                    wire::FromProto(*request, ImageOf(backend_));
                if (!patch.ok()) return patch.status();
                return UpdateAnnotation{EditorOf(session, request->edit_group()), *std::move(patch),
                                        AnswerWithAnnotation(call, response)};
              });
}

grpc::ServerUnaryReactor* AnnotationService::Delete(grpc::CallbackServerContext* context,
                                                    const v1::DeleteAnnotationRequest* request,
                                                    v1::DeleteAnnotationResponse* /*response*/) {
  return Edit(context, request, "AnnotationService/Delete",
              [&](UnaryCall& call, const Session& session) -> absl::StatusOr<Command> {
                absl::Status group = wire::CheckEditGroup(request->edit_group());
                if (!group.ok()) return group;
                absl::Status uuid = wire::CheckUuid(request->id(), "id");
                if (!uuid.ok()) return uuid;
                return DeleteAnnotation{EditorOf(session, request->edit_group()), request->id(),
                                        call.Answer()};
              });
}

grpc::ServerUnaryReactor* AnnotationService::TickCheckItem(grpc::CallbackServerContext* context,
                                                           const v1::TickCheckItemRequest* request,
                                                           v1::TickCheckItemResponse* response) {
  return Edit(context, request, "AnnotationService/TickCheckItem",
              [&](UnaryCall& call, const Session& session) -> absl::StatusOr<Command> {
                absl::Status uuid = wire::CheckUuid(request->id(), "id");
                if (!uuid.ok()) return uuid;
                return TickItem{EditorOf(session), request->id(), request->index(), request->done(),
                                AnswerWithAnnotation(call, response)};
              });
}

grpc::ServerUnaryReactor* AnnotationService::GetPicture(grpc::CallbackServerContext* context,
                                                        const v1::GetPictureRequest* request,
                                                        v1::GetPictureResponse* response) {
  UnaryCall call(*context, "AnnotationService/GetPicture", UnaryCall::Log::kRefusals);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kRead, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  call.set_log(UnaryCall::Log::kNothing);
  if (absl::Status uuid = wire::CheckUuid(request->id(), "id"); !uuid.ok()) {
    return call.Finish(uuid);
  }
  const std::shared_ptr<const AnnotationList> annotations = backend_.annotations();
  const auto found = std::find_if(annotations->begin(), annotations->end(),
                                  [&](const Annotation& one) { return one.id == request->id(); });
  if (found == annotations->end() || found->picture == nullptr) {
    return call.Finish(absl::NotFoundError(absl::StrCat(
        "id '", request->id(), "' is no picture; list annotations to see which there are")));
  }
  *response->mutable_facts() = wire::ToProto(*found->picture);
  response->set_picture(found->picture->bytes);
  return call.Finish(absl::OkStatus());
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
                return UndoChange{EditorOf(session), redo, call.Answer<std::string>(fill)};
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
