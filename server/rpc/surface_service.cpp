#include "server/rpc/surface_service.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <vector>

#include "server/rpc/early_handler.hpp"
#include "shared/wire/surface.hpp"

namespace saccade {
namespace {

constexpr std::uint32_t kLeastBytes = 4'096, kUsualBytes = 131'072, kMostBytes = 524'288;

}  // namespace

SurfaceService::SurfaceService(Backend& backend, Gatekeeper& gate)
    : backend_(backend), gate_(gate) {
  MarkMethodCallback(0, Early(gate, "SurfaceService/Get", this, &SurfaceService::Get));
}

SurfaceService::Coded SurfaceService::Code(std::uint64_t edition, const SurfaceChunk& chunk) {
  const std::lock_guard lock(mutex_);
  if (edition != coded_edition_) coded_.clear();
  coded_edition_ = edition;
  auto& [version, coded] = coded_[chunk.index];
  if (coded == nullptr || version != chunk.version) {
    coded = std::make_shared<const v1::SurfaceChunk>(wire::ToProto(chunk));
    version = chunk.version;
  }
  return coded;
}

void SurfaceService::Fill(const SurfaceSnapshot& surface, std::uint64_t after,
                          std::size_t max_bytes, v1::GetSurfaceResponse& response) {
  std::vector<const SurfaceChunk*> newer;
  for (const auto& [index, chunk] : surface.chunks) {
    // Who has nothing need not hear of what is not there any more.
    if (chunk->version > after && !(after == 0 && chunk->triangles.empty())) {
      newer.push_back(chunk.get());
    }
  }
  std::sort(newer.begin(), newer.end(),
            [](const auto* a, const auto* b) { return a->version < b->version; });
  std::size_t bytes = 0;
  for (const SurfaceChunk* chunk : newer) {
    const Coded coded = Code(surface.edition, *chunk);
    bytes += coded->ByteSizeLong();
    if (bytes > max_bytes && response.chunks_size() > 0) {
      response.set_more(true);
      return;
    }
    *response.add_chunks() = *coded;
    response.set_version(chunk->version);
  }
  response.set_version(surface.version);
}

grpc::ServerUnaryReactor* SurfaceService::Get(grpc::CallbackServerContext* context,
                                              const v1::GetSurfaceRequest* request,
                                              v1::GetSurfaceResponse* response) {
  UnaryCall call(*context, "SurfaceService/Get", UnaryCall::Log::kNothing);
  const absl::StatusOr<Session> session = call.Member(gate_, Toll::kRead, request->session_id());
  if (!session.ok()) return call.Finish(session.status());
  const std::uint32_t max_bytes = request->max_bytes() == 0 ? kUsualBytes : request->max_bytes();
  if (max_bytes < kLeastBytes || max_bytes > kMostBytes) {
    return call.Finish(absl::InvalidArgumentError(absl::StrCat(
        "max_bytes: ", max_bytes, " is not ", kLeastBytes, " to ", kMostBytes, ", or 0")));
  }
  const std::shared_ptr<const SurfaceSnapshot> surface = backend_.surface();
  if (surface == nullptr) return call.Finish(absl::OkStatus());
  response->set_edition(surface->edition);
  // A version that this edition never had is of a server before: all anew.
  const bool goes_on =
      request->edition() == surface->edition && request->version() <= surface->version;
  Fill(*surface, goes_on ? request->version() : 0, max_bytes, *response);
  return call.Finish(absl::OkStatus());
}

}  // namespace saccade
