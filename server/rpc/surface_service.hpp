#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "saccade/v1/surface.grpc.pb.h"
#include "server/rpc/backend.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/unary_call.hpp"

namespace saccade {

/// Hands out surfaces, to each as fast as it asks. A chunk is coded once, for all.
class SurfaceService final : public v1::SurfaceService::CallbackService {
 public:
  SurfaceService(Backend& backend, Gatekeeper& gate);

 private:
  using Coded = std::shared_ptr<const v1::SurfaceChunk>;

  grpc::ServerUnaryReactor* Get(grpc::CallbackServerContext* context,
                                const v1::GetSurfaceRequest* request,
                                v1::GetSurfaceResponse* response) override;
  void Fill(const SurfaceSnapshot& surface, std::uint64_t after, std::size_t max_bytes,
            v1::GetSurfaceResponse& response);
  Coded Code(std::uint64_t edition, const SurfaceChunk& chunk);

  Backend& backend_;
  Gatekeeper& gate_;
  std::mutex mutex_;
  std::uint64_t coded_edition_ = 0;
  std::map<SurfaceChunk::Index, std::pair<std::uint64_t, Coded>> coded_;  // with their versions
};

}  // namespace saccade
