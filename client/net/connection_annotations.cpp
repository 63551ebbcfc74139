// Marks: made, changed, listed, taken back.
#include <absl/strings/str_cat.h>

#include <iterator>

#include "client/net/connection_impl.hpp"
#include "shared/wire/from_proto.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade::net {
namespace {

constexpr int kMaxPages = 10000;  // of a list

}  // namespace

absl::StatusOr<Annotation> Connection::CreateAnnotation(AnnotationDraft draft,
                                                        const std::string& edit_group) {
  v1::CreateAnnotationRequest request;
  request.set_request_id(draft.request_id.empty() ? RandomUuid() : draft.request_id);
  *request.mutable_draft() = ToProto(draft);
  request.set_edit_group(edit_group);
  auto response = impl_->CallInSession(*impl_->annotation_, &v1::AnnotationService::Stub::Create,
                                       std::move(request));
  if (!response.ok()) return response.status();
  return wire::FromProto(response->annotation(), "annotation");
}

absl::StatusOr<Annotation> Connection::UpdateAnnotation(const AnnotationPatch& patch,
                                                        const std::string& edit_group) {
  v1::UpdateAnnotationRequest request;
  request.set_edit_group(edit_group);
  request.set_id(patch.id);
  if (patch.text) request.set_text(*patch.text);
  if (patch.size_m) request.set_size_m(*patch.size_m);
  if (patch.color_rgba) request.set_color_rgba(*patch.color_rgba);
  if (patch.target) *request.mutable_target() = wire::ToProto(*patch.target);
  if (patch.end_target) *request.mutable_end_target() = wire::ToProto(*patch.end_target);
  if (patch.locked) request.set_locked(*patch.locked);
  if (patch.world_from_mark) {
    *request.mutable_world_from_mark() = wire::ToProto(*patch.world_from_mark);
  }
  if (patch.extent_m) *request.mutable_extent_m() = wire::ToProto(*patch.extent_m);
  auto response = impl_->CallInSession(*impl_->annotation_, &v1::AnnotationService::Stub::Update,
                                       std::move(request));
  if (!response.ok()) return response.status();
  return wire::FromProto(response->annotation(), "annotation");
}

absl::StatusOr<std::vector<Annotation>> Connection::ListAnnotations() {
  std::vector<Annotation> all;
  v1::ListAnnotationsRequest request;
  for (int page = 0; page < kMaxPages; ++page) {
    auto response = impl_->Call(*impl_->annotation_, &v1::AnnotationService::Stub::List, request);
    if (!response.ok()) return response.status();
    absl::StatusOr<std::vector<Annotation>> some = FromProto(response->annotations());
    if (!some.ok()) return some.status();
    std::move(some->begin(), some->end(), std::back_inserter(all));
    if (response->next_page_token().empty()) return all;
    if (response->next_page_token() == request.page_token()) break;
    request.set_page_token(response->next_page_token());
  }
  return absl::DataLossError(absl::StrCat("the list of annotations of ", impl_->options_.server,
                                          " does not end; is it another version?"));
}

absl::Status Connection::DeleteAnnotation(const std::string& id, const std::string& edit_group) {
  v1::DeleteAnnotationRequest request;
  request.set_edit_group(edit_group);
  request.set_id(id);
  return impl_
      ->CallInSession(*impl_->annotation_, &v1::AnnotationService::Stub::Delete, std::move(request))
      .status();
}

absl::StatusOr<Annotation> Connection::TickCheckItem(const std::string& id, std::uint32_t index,
                                                     bool done) {
  v1::TickCheckItemRequest request;
  request.set_id(id);
  request.set_index(index);
  request.set_done(done);
  auto response = impl_->CallInSession(
      *impl_->annotation_, &v1::AnnotationService::Stub::TickCheckItem, std::move(request));
  if (!response.ok()) return response.status();
  return wire::FromProto(response->annotation(), "annotation");
}

absl::StatusOr<Picture> Connection::GetPicture(const std::string& id) {
  v1::GetPictureRequest request;
  request.set_id(id);
  auto response = impl_->CallInSession(
      *impl_->annotation_, &v1::AnnotationService::Stub::GetPicture, std::move(request));
  if (!response.ok()) return response.status();
  return Picture{response->facts().sha256(), response->facts().media_type(),
                 static_cast<int>(response->facts().width()),
                 static_cast<int>(response->facts().height()),
                 std::move(*response->mutable_picture())};
}

absl::StatusOr<std::string> Connection::Undo() {
  auto response = impl_->CallInSession(*impl_->annotation_, &v1::AnnotationService::Stub::Undo,
                                       v1::UndoAnnotationRequest());
  if (!response.ok()) return response.status();
  return response->description();
}

absl::StatusOr<std::string> Connection::Redo() {
  auto response = impl_->CallInSession(*impl_->annotation_, &v1::AnnotationService::Stub::Redo,
                                       v1::RedoAnnotationRequest());
  if (!response.ok()) return response.status();
  return response->description();
}

}  // namespace saccade::net
