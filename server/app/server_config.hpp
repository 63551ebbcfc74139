#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "server/app/limit_settings.hpp"
#include "server/gl/gl_context.hpp"
#include "server/identity/access.hpp"
#include "server/identity/identity_provider.hpp"

namespace saccade {

/// HOST:PORT, HOST an IP literal (IPv6 in brackets) or localhost.
struct Address {
  std::string host = "127.0.0.1";  // without brackets
  int port = 0;                    // 0: any free one

  /// InvalidArgument names `flag`.
  static absl::StatusOr<Address> Parse(const std::string& text, const std::string& flag);
  bool loopback() const;
  std::string ToString(int actual_port) const;
};

/// What saccade-server was asked to do. The command line wins over --config FILE.toml.
struct ServerConfig {
  std::string source;
  std::string mount = "none";
  std::filesystem::path data_dir;
  std::filesystem::path camera_file;
  Address grpc{"127.0.0.1", 50051};
  Address http{"127.0.0.1", 8080};
  bool insecure = false;
  std::filesystem::path tls_certificate, tls_key;  // empty: of an authority of our own
  bool tls_required = false;                       // on loopback, too
  std::filesystem::path client_ca;                 // who vouches for machines; empty: nobody
  std::map<std::string, AccessRole> client_roles;  // [client_roles], by common name or URI
  std::optional<IdentityProviderOptions> oidc;     // [oidc]: with whom people sign in
  bool waiting_room = false;                       // who comes by an invite waits to be let in
  bool auth_required = false;  // calls need a token: asked for, or beyond loopback and not insecure
  std::string public_url;      // without a slash at its end; empty: found out
  std::string trusted_proxy;   // IP literal of whose X-Forwarded-For is believed; empty: nobody's
  GlBackend gl = GlBackend::kOsmesa;
  bool every_frame = false;  // --speed max
  std::optional<double> run_for_s;
  std::filesystem::path sim_truth;
  // [overlay]: in the augmented view, beside marks
  bool overlay_dots = false, overlay_axes = false, overlay_status = false;
  std::string map = "last";           // last, new, none, or an id
  std::optional<Address> team;        // another wearer's server, to join
  std::string team_name, team_token;  // [team]: how others see this one; what the other asks for
  std::string team_invite;            // "ID.SECRET"
  std::filesystem::path team_trust;   // PEM of the other's root; empty: plain
  std::string audio_in, audio_out;    // ALSA's names; empty: no voice of the wearer's here
  /// Recordings go here, one from the start if `record` is set; empty: DIR/recordings.
  std::filesystem::path record_dir;
  bool record = false;
  std::int64_t record_file_mb = 1024, record_file_s = 600, record_keep_free_mb = 1024;  // [record]
  double surface_cores = 0.5;  // of one processor at most; 0: no surfaces
  // Only in the file: reasons to change them are rare.
  int video_bit_rate_bit_s = 0;    // video.bit_rate_bit_s; 0: by picture size
  LimitSettings limits;            // [limits]
  std::filesystem::path web_root;  // web_root
  std::uint64_t seed = 1;          // seed
  /// Its [tracker], [gaze], [mount_model] and drivers' tables are theirs to read.
  std::filesystem::path config_file;

  /// Whether one of the addresses can be reached from other machines.
  bool beyond_loopback() const { return !grpc.loopback() || !http.loopback(); }
  /// Whether this one speaks TLS.
  bool WantsTls(const Address& address) const {
    return tls_required || !tls_certificate.empty() || (!insecure && !address.loopback());
  }

  /// Parses the command line. An error is bad usage (exit 2); `--help`, `--version` and
  /// `--print-config` print and give nothing.
  static absl::StatusOr<std::optional<ServerConfig>> FromCommandLine(int argc, char** argv);
};

}  // namespace saccade
