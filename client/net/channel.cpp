#include "client/net/channel.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

namespace saccade::net {
namespace {

constexpr int kMaxAnswerBytes = 64 << 20;  // a lossless picture of a large camera

grpc::ChannelArguments ChannelArguments() {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxAnswerBytes);
  // Small windows bound what piles up in the transport while a reader is slow.
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 65536);
  // A proxy of the environment has no business between an expert and a wearable.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return arguments;
}

// Nobody there, or somebody whom one cannot talk to: gRPC has one code for both.
std::string WhyUnavailable(const ConnectionOptions& options, const std::string& message) {
  const std::string words = absl::AsciiStrToLower(message);
  const bool handshake =
      absl::StrContains(words, "handshake") || absl::StrContains(words, "certificate");
  if (options.tls && handshake) {
    return absl::StrCat("the certificate of ", options.server,
                        " is not trusted here: fetch its root with `saccade trust --from "
                        "HOST:HTTP_PORT --out root.pem`, compare the fingerprint, and give --trust "
                        "root.pem (a server without TLS: --plain)");
  }
  return absl::StrCat("no server answers at ", options.server,
                      "; start saccade-server, or name another with --server HOST:PORT",
                      options.tls ? "" : " (one that speaks TLS: --trust FILE)");
}

}  // namespace

std::shared_ptr<grpc::Channel> MakeChannel(const ConnectionOptions& options) {
  if (!options.tls) {
    return grpc::CreateCustomChannel(options.server, grpc::InsecureChannelCredentials(),
                                     ChannelArguments());
  }
  grpc::SslCredentialsOptions tls;
  tls.pem_root_certs = options.root_pem;  // empty: the system's store
  grpc::ChannelArguments arguments = ChannelArguments();
  if (!options.tls_name.empty()) arguments.SetSslTargetNameOverride(options.tls_name);
  return grpc::CreateCustomChannel(options.server, grpc::SslCredentials(tls), arguments);
}

void Authorise(const ConnectionOptions& options, grpc::ClientContext& context) {
  if (options.token.empty()) return;
  context.AddMetadata("authorization", absl::StrCat("Bearer ", options.token));
}

absl::Status Explain(const ConnectionOptions& options, const grpc::Status& status) {
  const auto code = static_cast<absl::StatusCode>(status.error_code());
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      return absl::Status(code, WhyUnavailable(options, status.error_message()));
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return absl::Status(
          code, absl::StrFormat("%s did not answer within %.1f s; is it busy, or is that port "
                                "not Saccade's gRPC port? (--timeout waits longer)",
                                options.server, 1e-3 * options.deadline.count()));
    case grpc::StatusCode::UNIMPLEMENTED:
      return absl::Status(code,
                          absl::StrCat("the server at ", options.server, " does not offer this (",
                                       status.error_message(), "); is it another version?"));
    case grpc::StatusCode::CANCELLED:  // gRPC's own word for it is no sentence
      return absl::Status(code, "the server ended the connection");
    default:
      return absl::Status(code, status.error_message());
  }
}

}  // namespace saccade::net
