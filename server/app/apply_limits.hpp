#pragma once

#include "server/app/engine.hpp"
#include "server/app/server_config.hpp"
#include "server/gateway/gateway.hpp"
#include "server/rpc/rpc_server.hpp"

namespace saccade {

/// Puts what the file says of limits, and of the proxy in front, where it counts.
void ApplyLimits(const ServerConfig& config, AnchorOptions& anchors);
void ApplyLimits(const ServerConfig& config, RpcServerOptions& options);
/// Browsers are judged by the RPC server, which knows their passes; it outlives the gateway.
void ApplyLimits(const ServerConfig& config, RpcServer& rpc, GatewayOptions& options);

}  // namespace saccade
