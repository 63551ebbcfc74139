#include "server/app/server_config.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <set>

#include "shared/io/toml_file.hpp"

namespace saccade {
namespace {

// What the flags and the file give as text, before it means anything.
struct Raw {
  std::string config, source, mount = "none", data_dir, camera, grpc = "127.0.0.1:50051",
                              http = "127.0.0.1:8080", gl = "osmesa", speed = "realtime", sim_truth,
                              web_root;
  bool insecure = false;
  double run_for_s = -1.0;
  double limits_scale = 1.0;
  std::int64_t bit_rate = 0;
  std::int64_t seed = 1;
};

void AddFlags(CLI::App& app, Raw& raw) {
  app.set_version_flag("--version", std::string("saccade-server ") + kVersion);
  app.add_option("--source", raw.source, "sim:desk[?...] | dataset:DIR");
  app.add_option(
      "--mount", raw.mount,
      "none | sim[?crooked=SEED] | dynamixel:DEVICE[?baud=N] | v4l2:DEVICE | crop:[WxH]");
  app.add_option("--config", raw.config, "TOML file; flags win over it");
  app.add_option("--data-dir", raw.data_dir, "annotations are kept here");
  app.add_option("--camera", raw.camera, "camera.yaml instead of the source's own");
  app.add_option("--grpc", raw.grpc, "HOST:PORT, port 0: any (127.0.0.1:50051)");
  app.add_option("--http", raw.http, "HOST:PORT, port 0: any (127.0.0.1:8080)");
  app.add_flag("--insecure", raw.insecure, "serve beyond this machine without TLS or roles");
  app.add_option("--gl", raw.gl, "osmesa | egl");
  app.add_option("--speed", raw.speed, "realtime | max (every frame, as fast as it can)");
  app.add_option("--run-for", raw.run_for_s, "end after so many seconds");
  app.add_option("--sim-truth", raw.sim_truth, "JSON lines of the simulator's truth");
}

constexpr std::int64_t kMostRunFor_s = 1'000'000'000;  // 31 years

absl::Status Bad(const std::string& what) { return absl::InvalidArgumentError(what); }

// Takes `key` from `table` unless the flag was given; removes it from `left`.
template <typename T>
void Take(const toml::value& table, const std::string& key, bool given, T& out,
          std::set<std::string>& left) {
  if (!table.contains(key)) return;
  left.erase(key);
  if (!given) out = toml::find<T>(table, key);
}

absl::Status ReadFile(const CLI::App& app, Raw& raw) {
  if (raw.config.empty()) return absl::OkStatus();
  absl::StatusOr<toml::value> parsed = ParseTomlFile(raw.config);
  if (!parsed.ok()) return Bad(absl::StrCat("--config: ", parsed.status().message()));
  const toml::value& root = *parsed;
  try {
    std::set<std::string> left;
    for (const auto& [key, value] : root.as_table()) left.insert(key);
    const auto given = [&app](const char* flag) { return app.count(flag) > 0; };
    Take(root, "source", given("--source"), raw.source, left);
    Take(root, "mount", given("--mount"), raw.mount, left);
    Take(root, "data_dir", given("--data-dir"), raw.data_dir, left);
    Take(root, "camera", given("--camera"), raw.camera, left);
    Take(root, "grpc", given("--grpc"), raw.grpc, left);
    Take(root, "http", given("--http"), raw.http, left);
    Take(root, "insecure", given("--insecure"), raw.insecure, left);
    Take(root, "gl", given("--gl"), raw.gl, left);
    Take(root, "speed", given("--speed"), raw.speed, left);
    Take(root, "web_root", false, raw.web_root, left);
    Take(root, "seed", false, raw.seed, left);
    if (root.contains("video")) {
      const toml::value& video = toml::find(root, "video");
      std::set<std::string> keys;
      for (const auto& [key, value] : video.as_table()) keys.insert(key);
      Take(video, "bit_rate_bit_s", false, raw.bit_rate, keys);
      if (!keys.empty())
        return Bad(absl::StrCat(raw.config, ": unknown key video.", *keys.begin()));
      left.erase("video");
    }
    if (root.contains("limits")) {
      const toml::value& limits = toml::find(root, "limits");
      std::set<std::string> keys;
      for (const auto& [key, value] : limits.as_table()) keys.insert(key);
      if (keys.erase("scale") > 0) {
        const toml::value& scale = toml::find(limits, "scale");
        raw.limits_scale =
            scale.is_integer() ? static_cast<double>(scale.as_integer()) : scale.as_floating();
      }
      if (!keys.empty()) {
        return Bad(absl::StrCat(raw.config, ": unknown key limits.", *keys.begin()));
      }
      left.erase("limits");
    }
    // Read by TrackerOptions, GazeOptions and the mounts.
    for (const char* table : {"tracker", "gaze", "mount_model", "dynamixel", "v4l2"}) {
      left.erase(table);
    }
    if (!left.empty()) return Bad(absl::StrCat(raw.config, ": unknown key ", *left.begin()));
  } catch (const std::exception& error) {
    return Bad(absl::StrCat("--config: ", raw.config, ": ", error.what()));
  }
  return absl::OkStatus();
}

std::filesystem::path DefaultDataDir() {
  if (const char* data = std::getenv("XDG_DATA_HOME"); data != nullptr && *data != 0) {
    return std::filesystem::path(data) / "saccade";
  }
  const char* home = std::getenv("HOME");
  return std::filesystem::path(home != nullptr ? home : "/tmp") / ".local/share/saccade";
}

absl::Status CheckAddresses(const Raw& raw, ServerConfig& config) {
  for (const auto& [text, flag, out] : {std::tuple(&raw.grpc, "--grpc", &config.grpc),
                                        std::tuple(&raw.http, "--http", &config.http)}) {
    absl::StatusOr<Address> address = Address::Parse(*text, flag);
    if (!address.ok()) return address.status();
    *out = *address;
    if (!config.insecure && !address->loopback()) {
      return Bad(absl::StrCat(flag, ": ", *text,
                              " is reachable from other machines, without TLS or roles: add "
                              "--insecure if that network is trusted"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckMount(const Raw& raw) {
  const auto [scheme, rest] =
      std::pair<std::string, std::string>(absl::StrSplit(raw.mount, absl::MaxSplits(':', 1)));
  const bool sim = raw.mount == "sim" || raw.mount.rfind("sim?", 0) == 0;
  const bool has_rest = raw.mount.find(':') != std::string::npos;
  if (raw.mount == "none" || (scheme == "crop" && has_rest)) return absl::OkStatus();
  if (!sim && (!has_rest || (scheme != "dynamixel" && scheme != "v4l2"))) {
    return Bad(absl::StrCat("--mount: '", raw.mount,
                            "' is not known: use none, sim, dynamixel:/dev/ttyUSB0, "
                            "v4l2:/dev/video0 or crop:"));
  }
  if (sim && raw.source.rfind("sim:", 0) != 0) {
    return Bad("--mount: sim turns the camera of a sim: source only");
  }
  if (!sim && rest.empty()) {
    return Bad(absl::StrCat("--mount: ", scheme, ": names no device: write for example ",
                            scheme == "v4l2" ? "v4l2:/dev/video0" : "dynamixel:/dev/ttyUSB0"));
  }
  if (raw.speed == "max") {
    return Bad("--mount: a head moves by the clock: leave --speed max out");
  }
  return absl::OkStatus();
}

absl::StatusOr<ServerConfig> Check(const Raw& raw) {
  ServerConfig config;
  if (raw.source.empty()) return Bad("--source is missing, e.g. --source sim:desk");
  config.source = raw.source;
  if (absl::Status mount = CheckMount(raw); !mount.ok()) return mount;
  config.mount = raw.mount;
  config.data_dir = raw.data_dir.empty() ? DefaultDataDir() : std::filesystem::path(raw.data_dir);
  config.camera_file = raw.camera;
  config.insecure = raw.insecure;
  if (absl::Status addresses = CheckAddresses(raw, config); !addresses.ok()) return addresses;
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
  // As VideoEncoderOptions has it: less is no picture.
  if (raw.bit_rate != 0 && (raw.bit_rate < 50'000 || raw.bit_rate > 100'000'000)) {
    return Bad(absl::StrCat("video.bit_rate_bit_s: ", raw.bit_rate,
                            ": give 50000 to 100000000, or 0: by the size of the picture"));
  }
  config.video_bit_rate_bit_s = static_cast<int>(raw.bit_rate);
  if (!(raw.limits_scale >= 0 && raw.limits_scale <= 1000)) {
    return Bad(absl::StrCat("limits.scale: ", raw.limits_scale, ": 0 (no limits) to 1000"));
  }
  config.limits_scale = raw.limits_scale;
  config.web_root = raw.web_root;
  if (raw.seed < 0) return Bad(absl::StrCat("seed: ", raw.seed, ": give a whole number from 0"));
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
