#pragma once

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <memory>

#include "client/net/connection.hpp"

namespace saccade::net {

/// To the server of `options`: over TLS or plain, as they say. Does not touch the network yet.
std::shared_ptr<grpc::Channel> MakeChannel(const ConnectionOptions& options);

/// Before each call: the deadline is the caller's.
void Authorise(const ConnectionOptions& options, grpc::ClientContext& context);

/// What went wrong, with what to do about it.
absl::Status Explain(const ConnectionOptions& options, const grpc::Status& status);

}  // namespace saccade::net
