#include "client/net/connection_impl.hpp"
#include "shared/wire/surface.hpp"

namespace saccade::net {

absl::StatusOr<SurfacePiece> Connection::GetSurface(std::uint64_t edition, std::uint64_t version,
                                                    std::uint32_t max_bytes) {
  v1::GetSurfaceRequest request;
  request.set_edition(edition);
  request.set_version(version);
  request.set_max_bytes(max_bytes);
  const auto answer =
      impl_->CallInSession(*impl_->surface_, &v1::SurfaceService::Stub::Get, std::move(request));
  if (!answer.ok()) return answer.status();
  SurfacePiece piece;
  piece.edition = answer->edition();
  piece.version = answer->version();
  piece.more = answer->more();
  for (const v1::SurfaceChunk& coded : answer->chunks()) {
    absl::StatusOr<SurfaceChunk> chunk = wire::FromProto(coded);
    if (!chunk.ok()) return chunk.status();
    piece.chunks.push_back(std::make_shared<const SurfaceChunk>(*std::move(chunk)));
  }
  return piece;
}

}  // namespace saccade::net
