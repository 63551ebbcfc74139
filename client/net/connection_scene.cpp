#include <absl/strings/str_cat.h>

#include "client/net/connection_impl.hpp"

namespace saccade::net {

absl::StatusOr<std::string> Connection::GetModel(const std::string& id, std::uint32_t bytes) {
  std::string file;
  while (file.size() < bytes) {
    v1::GetModelRequest request;
    request.set_model_id(id);
    request.set_offset_bytes(static_cast<std::uint32_t>(file.size()));
    const auto piece =
        impl_->CallInSession(*impl_->scene_, &v1::SceneService::Stub::GetModel, std::move(request));
    if (!piece.ok()) return piece.status();
    if (piece->data().empty() || piece->data().size() > bytes - file.size()) {
      return absl::DataLossError(absl::StrCat("model ", id, ": came torn"));
    }
    file += piece->data();
  }
  return file;
}

}  // namespace saccade::net
