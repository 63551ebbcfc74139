#include "server/app/server_config.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/strip.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>
#include <set>
#include <type_traits>
#include <variant>
#include <vector>

#include "server/app/oidc_settings.hpp"
#include "server/encode/video_encoder.hpp"
#include "server/gaze/gaze_options.hpp"
#include "server/mount/drivers/drivers.hpp"
#include "server/pipeline/peer_address.hpp"
#include "server/tracker/landmark_options.hpp"
#include "server/tracker/tracker_options.hpp"
#include "shared/io/toml_file.hpp"
#include "shared/version/version.hpp"

namespace saccade {
namespace {

constexpr std::int64_t kMostRunFor_s = 1'000'000'000;  // 31 years

// What the flags and the file give as text, before it means anything.
struct Raw {
  std::string config, source, mount = "none", data_dir, camera, grpc = "127.0.0.1:50051",
                              http = "127.0.0.1:8080", gl = "osmesa", speed = "realtime", sim_truth,
                              web_root, public_url, trusted_proxy, tls_certificate, tls_key,
                              client_ca, audio_in, audio_out, map = "last", team, team_name,
                              team_token, team_invite, team_trust, record;
  std::map<std::string, AccessRole> client_roles;
  bool insecure = false, tls_required = false, auth_required = false, waiting_room = false;
  bool overlay_dots = false, overlay_axes = false, overlay_status = false;
  double run_for_s = -1.0, surface_cores = 0.5;
  std::int64_t bit_rate = 0;
  std::int64_t seed = 1;
  std::int64_t record_file_mb = 1024, record_file_s = 600, record_keep_free_mb = 1024;
};

/// One thing that can be said, once for the flag, the file, --help and --print-config.
struct Setting {
  const char* key;   // in the file ("tls.key": of its table); null: a flag only
  const char* flag;  // null: in the file only
  std::variant<std::string Raw::*, bool Raw::*, double Raw::*, std::int64_t Raw::*> field;
  std::string help;
};

const std::vector<Setting>& Settings() {
  static const std::vector<Setting> settings = {
      {"source", "--source", &Raw::source,
       "sim:desk[?...] | dataset:DIR[?fps=N] | v4l2:DEVICE[?...] | file:VIDEO[?...] | rtsp://... | "
       "phone:[?...] | replay:FILE.mcap"},
      {"mount", "--mount", &Raw::mount, MountDrivers().Usage()},
      {nullptr, "--config", &Raw::config, "TOML file; flags win over it"},
      {"data_dir", "--data-dir", &Raw::data_dir, "annotations are kept here"},
      {"camera", "--camera", &Raw::camera,
       "camera file instead of the source's own: camera.yaml, Kalibr's, ROS's..."},
      {"grpc", "--grpc", &Raw::grpc, "HOST:PORT, port 0: any (127.0.0.1:50051)"},
      {"http", "--http", &Raw::http, "HOST:PORT, port 0: any (127.0.0.1:8080)"},
      {"insecure", "--insecure", &Raw::insecure,
       "serve beyond this machine without TLS and invites: for laboratories"},
      {"public_url", "--public-url", &Raw::public_url,
       "https://HOST[:PORT] that invite links begin with, e.g. of a reverse proxy"},
      {"trusted_proxy", "--trusted-proxy", &Raw::trusted_proxy,
       "address of the reverse proxy, whose X-Forwarded-For says who calls"},
      {"waiting_room", "--waiting-room", &Raw::waiting_room,
       "who comes by an invite waits until the wearer, or `saccade admit`, lets them in"},
      {"gl", "--gl", &Raw::gl, "osmesa | egl"},
      {"speed", "--speed", &Raw::speed, "realtime | max (every frame, as fast as it can)"},
      {"map", "--map", &Raw::map,
       "what was mapped before: last: looked for first | new: kept, not looked for | ID of one | "
       "none: neither (saccade maps list)"},
      {nullptr, "--run-for", &Raw::run_for_s, "end after so many seconds"},
      {nullptr, "--sim-truth", &Raw::sim_truth, "JSON lines of the simulator's truth"},
      {nullptr, "--record", &Raw::record,
       "record from the start into this folder (MCAP): video, poses, map, marks"},
      {"web_root", nullptr, &Raw::web_root, "the page's files; empty: where they were built"},
      {"seed", nullptr, &Raw::seed, "of the tracker and of a simulated mount"},
      {"tls.certificate", "--tls-certificate", &Raw::tls_certificate,
       "PEM file, with those above it; empty: one of an authority of this server's own"},
      {"tls.key", "--tls-key", &Raw::tls_key, "PEM file of its private key"},
      {"tls.client_ca", "--client-ca", &Raw::client_ca,
       "PEM file: a client's certificate by it is an identity, its role in [client_roles]"},
      {"tls.required", nullptr, &Raw::tls_required, "TLS on loopback, too"},
      {"auth.required", nullptr, &Raw::auth_required, "invites on loopback, too"},
      {"audio.in", "--audio-in", &Raw::audio_in,
       "microphone of a wearable without a browser, by ALSA's name: default, plughw:1,0"},
      {"audio.out", "--audio-out", &Raw::audio_out, "its loudspeaker, likewise"},
      {"team.join", "--team", &Raw::team,
       "HOST:PORT of another wearer's server: maps find each other, marks are shown in both"},
      {"team.name", nullptr, &Raw::team_name, "how others see this one; empty: the machine's name"},
      {"team.trust", "--team-trust", &Raw::team_trust,
       "PEM file: the root of that server's certificate, as `saccade trust --from` fetches it"},
      {"team.invite", "--team-invite", &Raw::team_invite,
       "a link or ID.SECRET of its `saccade invite --role pilot`; redeemed once, the token is "
       "kept"},
      {"team.token", nullptr, &Raw::team_token, "what that invite was redeemed for, if it was"},
      {"record.file_mb", nullptr, &Raw::record_file_mb,
       "recordings begin another file after so many MB, 1 to 1048576"},
      {"record.file_s", nullptr, &Raw::record_file_s, "and after so many seconds, 1 to 86400"},
      {"record.keep_free_mb", nullptr, &Raw::record_keep_free_mb,
       "a recording stops where less than so many MB of the disk are free"},
      {"surfaces.cores", "--surface-cores", &Raw::surface_cores,
       "how much of one processor surfaces of the place may take, 0 (none are made) to 1"},
      {"overlay.dots", nullptr, &Raw::overlay_dots,
       "the tracker's features in the augmented view, which is the wearer's"},
      {"overlay.axes", nullptr, &Raw::overlay_axes, "the world's axes in it"},
      {"overlay.status", nullptr, &Raw::overlay_status,
       "how tracking goes, as a line in it; the wearer's page says it beside the picture"},
  };
  return settings;
}

/// Table and key; the table is empty at the top of the file.
std::pair<std::string, std::string> SplitKey(const std::string& key) {
  const std::size_t dot = key.find('.');
  if (dot == std::string::npos) return {"", key};
  return {key.substr(0, dot), key.substr(dot + 1)};
}

void AddFlags(CLI::App& app, Raw& raw) {
  app.set_version_flag("--version", std::string("saccade-server ") + Version());
  for (const Setting& setting : Settings()) {
    if (setting.flag == nullptr) continue;
    std::visit(
        [&](auto field) {
          if constexpr (std::is_same_v<decltype(field), bool Raw::*>) {
            app.add_flag(setting.flag, raw.*field, setting.help);
          } else {
            app.add_option(setting.flag, raw.*field, setting.help);
          }
        },
        setting.field);
  }
  app.add_flag_callback(
      "--print-config", [] { throw CLI::CallForAllHelp(); },
      "print a file with every key, its default, range and meaning");
}

std::string BitRateWords() {
  return absl::StrCat(kLeastBitRate_bit_s, " to ", kMostBitRate_bit_s,
                      ", or 0: by the size of the picture");
}

/// A file that says everything and changes nothing.
std::string DefaultFile() {
  std::string text;
  const Raw defaults;
  const auto add = [&text](const std::string& line, const std::string& help) {
    absl::StrAppend(&text, absl::StrFormat("%-44s # %s\n", line, help));
  };
  std::string last_table;
  for (const Setting& setting : Settings()) {
    if (setting.key == nullptr) continue;
    const std::string value = std::visit(
        [&](auto field) -> std::string {
          if constexpr (std::is_same_v<decltype(field), std::string Raw::*>) {
            return absl::StrCat("\"", defaults.*field, "\"");
          } else if constexpr (std::is_same_v<decltype(field), bool Raw::*>) {
            return defaults.*field ? "true" : "false";
          } else {
            return absl::StrCat(defaults.*field);
          }
        },
        setting.field);
    const auto [table, key] = SplitKey(setting.key);
    if (table != last_table) absl::StrAppend(&text, "\n[", table, "]\n");
    last_table = table;
    add(absl::StrCat(key, " = ", value), setting.help);
  }
  absl::StrAppend(&text, "\n[video]\n");
  add("bit_rate_bit_s = 0", BitRateWords());
  absl::StrAppend(&text, "\n", LimitSettings::Describe(), "\n", DescribeOidc(), "\n",
                  TrackerOptions::Describe(), "\n", LandmarkOptions::Describe(), "\n",
                  GazeOptions::Describe(), "\n", MountDrivers().Describe());
  return text;
}

absl::Status Bad(const std::string& what) { return absl::InvalidArgumentError(what); }

// Takes `key` from `table` unless the flag was given; removes it from `left`.
template <typename T>
void Take(const toml::value& table, const std::string& key, bool given, T& out,
          std::set<std::string>& left) {
  if (!table.contains(key)) return;
  left.erase(key);
  if (!given) out = toml::find<T>(table, key);
}

/// What Settings() name, at the top of the file and in their tables.
absl::Status TakeSettings(const CLI::App& app, const toml::value& root, Raw& raw,
                          std::set<std::string>& left) {
  std::map<std::string, std::set<std::string>> tables;  // and their keys
  for (const Setting& setting : Settings()) {
    if (setting.key == nullptr) continue;
    const bool flag_wins = setting.flag != nullptr && app.count(setting.flag) > 0;
    const auto [table, key] = SplitKey(setting.key);
    if (!table.empty() && !root.contains(table)) continue;
    const toml::value& from = table.empty() ? root : toml::find(root, table);
    std::set<std::string>& keys = table.empty() ? left : tables[table];
    if (left.erase(table) > 0) {
      for (const auto& [name, value] : from.as_table()) keys.insert(name);
    }
    std::visit([&, name = key](auto field) { Take(from, name, flag_wins, raw.*field, keys); },
               setting.field);
  }
  for (const auto& [table, keys] : tables) {
    if (!keys.empty()) return Bad(absl::StrCat("unknown key ", table, ".", *keys.begin()));
  }
  return absl::OkStatus();
}

absl::Status ReadFile(const CLI::App& app, Raw& raw) {
  if (raw.config.empty()) return absl::OkStatus();
  absl::StatusOr<toml::value> parsed = ParseTomlFile(raw.config);
  if (!parsed.ok()) return Bad(absl::StrCat("--config: ", parsed.status().message()));
  const toml::value& root = *parsed;
  try {
    std::set<std::string> left;
    for (const auto& [key, value] : root.as_table()) left.insert(key);
    if (absl::Status taken = TakeSettings(app, root, raw, left); !taken.ok()) return taken;
    if (root.contains("video")) {
      const toml::value& video = toml::find(root, "video");
      std::set<std::string> keys;
      for (const auto& [key, value] : video.as_table()) keys.insert(key);
      Take(video, "bit_rate_bit_s", false, raw.bit_rate, keys);
      if (!keys.empty())
        return Bad(absl::StrCat(raw.config, ": unknown key video.", *keys.begin()));
      left.erase("video");
    }
    if (root.contains("client_roles")) {
      for (const auto& [name, word] : toml::find(root, "client_roles").as_table()) {
        const AccessRole role = AccessRoleOf(word.as_string().str);
        if (role < AccessRole::kViewer || role > AccessRole::kWearer) {
          return Bad(absl::StrCat(raw.config, ": client_roles.", name, ": '", word.as_string().str,
                                  "'; give viewer, annotator, pilot or wearer"));
        }
        raw.client_roles[name] = role;
      }
      left.erase("client_roles");
    }
    // Read by TrackerOptions, LandmarkOptions, GazeOptions, LimitSettings, LoadOidc and the mounts.
    for (const char* table : {"tracker", "landmarks", "gaze", "limits", "oidc"}) left.erase(table);
    for (const std::string& table : MountDrivers().Tables()) left.erase(table);
    if (!left.empty()) return Bad(absl::StrCat(raw.config, ": unknown key ", *left.begin()));
  } catch (const std::exception& error) {
    return Bad(absl::StrCat("--config: ", raw.config, ": ", error.what()));
  }
  return absl::OkStatus();
}

/// Empty where nobody says where this user's files are.
std::filesystem::path DefaultDataDir() {
  if (const char* data = std::getenv("XDG_DATA_HOME"); data != nullptr && *data != 0) {
    return std::filesystem::path(data) / "saccade";
  }
  const char* home = std::getenv("HOME");
  if (home == nullptr || *home == 0) return {};  // not /tmp, which is everybody's
  return std::filesystem::path(home) / ".local/share/saccade";
}

absl::Status CheckAddresses(const Raw& raw, ServerConfig& config) {
  for (const auto& [text, flag, out] : {std::tuple(&raw.grpc, "--grpc", &config.grpc),
                                        std::tuple(&raw.http, "--http", &config.http)}) {
    absl::StatusOr<Address> address = Address::Parse(*text, flag);
    if (!address.ok()) return address.status();
    *out = *address;
  }
  return absl::OkStatus();
}

// "https://saccade.example.org", "https://10.0.0.7:8443": no path, and no user.
bool IsOrigin(absl::string_view url) {
  if (!absl::ConsumePrefix(&url, "https://") && !absl::ConsumePrefix(&url, "http://")) return false;
  return !url.empty() && url.find_first_of("/?#@ ") == absl::string_view::npos;
}

absl::Status CheckIdentity(const Raw& raw, ServerConfig& config) {
  config.tls_certificate = raw.tls_certificate;
  config.tls_key = raw.tls_key;
  if (raw.tls_certificate.empty() != raw.tls_key.empty()) {
    return Bad(raw.tls_key.empty() ? "--tls-key is missing: the key of --tls-certificate"
                                   : "--tls-certificate is missing: what --tls-key is the key of");
  }
  if (config.insecure && (raw.tls_required || !raw.tls_certificate.empty())) {
    return Bad("--insecure: says no TLS, and tls.* says TLS: leave one of them out");
  }
  config.tls_required = raw.tls_required;
  // Who names a public address has a proxy before loopback: whom that brings is not of this
  // machine.
  config.auth_required =
      raw.auth_required ||
      (!config.insecure && (config.beyond_loopback() || !raw.public_url.empty()));
  if (config.insecure && raw.auth_required && config.beyond_loopback()) {
    return Bad(
        "--insecure: invites would go over the network in plain text; leave auth.required "
        "out, or --insecure");
  }
  config.client_ca = raw.client_ca;
  config.client_roles = raw.client_roles;
  if (!raw.client_ca.empty() && !(config.WantsTls(config.grpc) && config.auth_required)) {
    return Bad(
        "--client-ca: machines show certificates where there is TLS, and need to where tokens "
        "are asked for: tls.required and auth.required on loopback, no --insecure");
  }
  if (!raw.client_roles.empty() && raw.client_ca.empty()) {
    return Bad("client_roles: no machine shows a certificate without tls.client_ca (--client-ca)");
  }
  config.waiting_room = raw.waiting_room;
  if (raw.waiting_room && !config.auth_required) {
    return Bad("--waiting-room: without invites everybody is in: set auth.required");
  }
  config.trusted_proxy = raw.trusted_proxy;
  if (!raw.trusted_proxy.empty() && ForwardedFor(raw.trusted_proxy) != raw.trusted_proxy) {
    return Bad(absl::StrCat("--trusted-proxy: '", raw.trusted_proxy,
                            "' is no address of one machine, like 127.0.0.1"));
  }
  config.public_url = raw.public_url;
  absl::string_view trimmed = config.public_url;
  absl::ConsumeSuffix(&trimmed, "/");
  config.public_url = std::string(trimmed);
  if (!config.public_url.empty() && !IsOrigin(config.public_url)) {
    return Bad(absl::StrCat("--public-url: '", raw.public_url,
                            "' is not like https://saccade.example.org"));
  }
  return absl::OkStatus();
}

absl::Status CheckTeam(const Raw& raw, ServerConfig& config) {
  config.team_name = raw.team_name;
  config.team_token = raw.team_token;
  if (raw.team_name.size() > 60) return Bad("team.name: at most 60 bytes");
  if (raw.team.empty()) return absl::OkStatus();
  absl::StatusOr<Address> address = Address::Parse(raw.team, "--team");
  if (!address.ok()) return address.status();
  if (address->port == 0) return Bad("--team: needs the other server's port");
  config.team_trust = raw.team_trust;
  const std::string::size_type behind = raw.team_invite.find("#invite=");
  config.team_invite =
      behind == std::string::npos ? raw.team_invite : raw.team_invite.substr(behind + 8);
  if (!config.team_trust.empty() && !std::filesystem::is_regular_file(config.team_trust)) {
    return Bad(absl::StrCat("--team-trust ", raw.team_trust,
                            ": no such file; fetch it with `saccade trust --from HOST:HTTP_PORT "
                            "--out root.pem`"));
  }
  if (!address->loopback() && config.team_trust.empty() && !config.insecure) {
    return Bad(
        "--team: another machine speaks TLS: give --team-trust root.pem (`saccade trust --from "
        "HOST:HTTP_PORT --out root.pem`), or --insecure for a plain one");
  }
  config.team = *address;
  return absl::OkStatus();
}

absl::Status CheckRecord(const Raw& raw, ServerConfig& config) {
  if (raw.record_file_mb < 1 || raw.record_file_mb > 1'048'576) {
    return Bad(absl::StrCat("record.file_mb: ", raw.record_file_mb, ": give 1 to 1048576"));
  }
  if (raw.record_file_s < 1 || raw.record_file_s > 86'400) {
    return Bad(absl::StrCat("record.file_s: ", raw.record_file_s, ": give 1 to 86400"));
  }
  if (raw.record_keep_free_mb < 0 || raw.record_keep_free_mb > std::int64_t{1} << 40) {
    return Bad(absl::StrCat("record.keep_free_mb: ", raw.record_keep_free_mb,
                            ": give a whole number from 0"));
  }
  config.record = !raw.record.empty();
  config.record_dir =
      config.record ? std::filesystem::path(raw.record) : config.data_dir / "recordings";
  config.record_file_mb = raw.record_file_mb;
  config.record_file_s = raw.record_file_s;
  config.record_keep_free_mb = raw.record_keep_free_mb;
  return absl::OkStatus();
}

absl::StatusOr<ServerConfig> Check(const Raw& raw) {
  ServerConfig config;
  if (raw.source.empty()) return Bad("--source is missing, e.g. --source sim:desk");
  config.source = raw.source;
  const MountFacts facts{raw.source, raw.speed == "max"};
  if (absl::Status mount = MountDrivers().Check(raw.mount, facts); !mount.ok()) return mount;
  config.mount = raw.mount;
  config.data_dir = raw.data_dir.empty() ? DefaultDataDir() : std::filesystem::path(raw.data_dir);
  if (config.data_dir.empty()) return Bad("--data-dir is missing, and HOME is not set");
  config.camera_file = raw.camera;
  if (absl::Status record = CheckRecord(raw, config); !record.ok()) return record;
  if (!(raw.surface_cores >= 0.0 && raw.surface_cores <= 1.0)) {
    return Bad(absl::StrCat("--surface-cores: ", raw.surface_cores, ": give 0 to 1"));
  }
  config.surface_cores = raw.surface_cores;
  config.insecure = raw.insecure;
  if (absl::Status addresses = CheckAddresses(raw, config); !addresses.ok()) return addresses;
  if (absl::Status identity = CheckIdentity(raw, config); !identity.ok()) return identity;
  if (absl::Status team = CheckTeam(raw, config); !team.ok()) return team;
  absl::StatusOr<GlBackend> gl = ParseGlBackend(raw.gl);
  if (!gl.ok()) return Bad(absl::StrCat("--gl: ", gl.status().ToString()));
  config.gl = *gl;
  if (raw.speed != "realtime" && raw.speed != "max") {
    return Bad(absl::StrCat("--speed: '", raw.speed, "' is neither realtime nor max"));
  }
  config.every_frame = raw.speed == "max";
  if (raw.run_for_s >= 0.0) config.run_for_s = raw.run_for_s;
  if (!raw.sim_truth.empty() && raw.source.rfind("sim:", 0) != 0) {
    return Bad("--sim-truth: only a sim: source knows the truth");
  }
  config.sim_truth = raw.sim_truth;
  if (raw.bit_rate != 0 &&
      (raw.bit_rate < kLeastBitRate_bit_s || raw.bit_rate > kMostBitRate_bit_s)) {
    return Bad(absl::StrCat("video.bit_rate_bit_s: ", raw.bit_rate, ": give ", BitRateWords()));
  }
  config.video_bit_rate_bit_s = static_cast<int>(raw.bit_rate);
  if (!raw.config.empty()) {
    if (absl::Status limits = config.limits.LoadToml(raw.config); !limits.ok()) return limits;
    auto oidc = LoadOidc(raw.config);
    if (!oidc.ok()) return oidc.status();
    if (oidc->has_value() && !config.auth_required) {
      return Bad("oidc: nobody needs to sign in where no invites are asked for: set auth.required");
    }
    config.oidc = *std::move(oidc);
  }
  config.web_root = raw.web_root;
  if (raw.seed < 0) return Bad(absl::StrCat("seed: ", raw.seed, ": give a whole number from 0"));
  config.map = raw.map;
  config.audio_in = raw.audio_in;
  config.audio_out = raw.audio_out;
  config.overlay_dots = raw.overlay_dots;
  config.overlay_axes = raw.overlay_axes;
  config.overlay_status = raw.overlay_status;
  config.seed = static_cast<std::uint64_t>(raw.seed);
  config.config_file = raw.config;
  return config;
}

}  // namespace

absl::StatusOr<std::optional<ServerConfig>> ServerConfig::FromCommandLine(int argc, char** argv) {
  CLI::App app("Camera in; tracks, maps, anchors and streams to experts.", "saccade-server");
  Raw raw;
  AddFlags(app, raw);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForAllHelp&) {  // --print-config
    std::cout << DefaultFile();
    return std::nullopt;
  } catch (const CLI::Success& done) {  // --help, --version
    app.exit(done, std::cout, std::cerr);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    return Bad(absl::StrCat(error.what(), " (see --help)"));
  } catch (const std::exception& error) {
    return Bad(absl::StrCat("the command line cannot be read: ", error.what()));
  }
  if (app.count("--run-for") > 0 && !(raw.run_for_s >= 0.0 && raw.run_for_s <= kMostRunFor_s)) {
    return Bad(absl::StrCat("--run-for: ", raw.run_for_s, ": seconds, 0 to ", kMostRunFor_s));
  }
  if (absl::Status file = ReadFile(app, raw); !file.ok()) return file;
  absl::StatusOr<ServerConfig> config = Check(raw);
  if (!config.ok()) return config.status();
  return *std::move(config);
}

}  // namespace saccade
