#include "server/app/apply_limits.hpp"

#include <algorithm>

#include "server/pipeline/busy.hpp"
#include "server/pipeline/peer_address.hpp"
#include "server/rpc/status.hpp"

namespace saccade {
namespace {

constexpr double kBurst_s = 6;  // so many seconds' worth may come at once

RateLimit RateOf(const LimitSettings& limits, double per_s) {
  const double scaled = per_s * limits.scale;
  return {scaled, std::max(1.0, kBurst_s * scaled)};
}

TrafficLimits TrafficOf(const LimitSettings& limits) {
  return {.token_requests = RateOf(limits, limits.requests_per_s),
          .address_requests = RateOf(limits, limits.address_requests_per_s),
          .token_bytes = RateOf(limits, limits.bytes_per_s),
          .address_bytes = RateOf(limits, limits.address_bytes_per_s),
          .invite_requests = RateOf(limits, limits.invite_requests_per_s),
          .invite_bytes = RateOf(limits, limits.invite_bytes_per_s),
          .this_machine = limits.this_machine};
}

ConnectionLimits ConnectionsOf(const ServerConfig& config) {
  const LimitSettings& limits = config.limits;
  const bool counted = limits.scale > 0;
  return {.all = limits.connections,
          .of_address = counted ? limits.address_connections : 0,
          .of_network = counted ? limits.network_connections : 0,
          .unheard_of_address = counted ? limits.address_unheard : 0,
          .new_of_address = RateOf(limits, limits.address_connections_per_s),
          .this_machine = limits.this_machine,
          .trusted_proxy = PlainAddress(config.trusted_proxy)};
}

}  // namespace

void ApplyLimits(const ServerConfig& config, AnchorOptions& anchors) {
  anchors.max_annotations = static_cast<std::size_t>(config.limits.annotations);
  anchors.max_session_annotations = static_cast<std::size_t>(config.limits.session_annotations);
}

void ApplyLimits(const ServerConfig& config, RpcServerOptions& options) {
  options.limits = RpcLimits().Scaled(config.limits.scale);
  options.traffic = TrafficOf(config.limits);
  options.connections = ConnectionsOf(config);
  options.trusted_proxy = options.connections.trusted_proxy;
  options.sessions.max_sessions_of_token =
      config.limits.scale > 0 ? static_cast<std::size_t>(config.limits.sessions) : 0;
  options.sessions.max_sessions_of_invite =
      config.limits.scale > 0 ? static_cast<std::size_t>(config.limits.invite_sessions) : 0;
}

void ApplyLimits(const ServerConfig& config, RpcServer& rpc, GatewayOptions& options) {
  options.connections = ConnectionsOf(config);
  options.trusted_proxy = options.connections.trusted_proxy;
  options.admit = [&rpc](const std::string& address, absl::string_view authorization,
                         std::size_t bytes) -> std::optional<GatewayRefusal> {
    const absl::Status status = rpc.AdmitBrowser(address, authorization, bytes);
    if (status.ok()) return std::nullopt;
    const grpc::Status told = ToGrpc(status);
    return GatewayRefusal{static_cast<int>(told.error_code()), told.error_message(),
                          told.error_details(), std::chrono::nanoseconds(RetryAfterOf(status))};
  };
}

}  // namespace saccade
