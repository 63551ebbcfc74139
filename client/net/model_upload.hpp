#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "client/net/connection.hpp"
#include "client/net/scene_convert.hpp"
#include "saccade/v1/scene.pb.h"

namespace saccade::net {

/// Sends a GLB file in pieces: `ask` makes one call, `progress` is told the bytes that are there.
template <typename Ask, typename Progress>
absl::StatusOr<ModelFacts> UploadInPieces(const std::string& name, const std::string& glb,
                                          const Ask& ask, const Progress& progress) {
  constexpr std::size_t kPiece = 200 * 1024;
  if (glb.empty()) return absl::InvalidArgumentError("model: the file is empty");
  v1::UploadModelRequest request;
  request.set_upload_id(RandomUuid());
  request.set_name(name);
  request.set_total_bytes(static_cast<std::uint32_t>(glb.size()));
  for (std::size_t offset = 0; offset < glb.size(); offset += kPiece) {
    request.set_offset_bytes(static_cast<std::uint32_t>(offset));
    request.set_data(glb.substr(offset, kPiece));
    const absl::StatusOr<v1::UploadModelResponse> answer = ask(request);
    if (!answer.ok()) return answer.status();
    progress(answer->received_bytes());
    if (answer->has_model()) return FromProto(answer->model());
  }
  return absl::InternalError("the server did not say what it read");
}

}  // namespace saccade::net
