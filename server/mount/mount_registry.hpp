#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/mount/mount.hpp"
#include "server/mount/mount_options.hpp"
#include "server/mount/simulated_head.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade {

/// What is known of the rest of the server before anything is opened.
struct MountFacts {
  std::string source;        // its URI
  bool every_frame = false;  // `--speed max`: frames do not keep the clock
};

/// What a driver may use to open its mount.
struct MountContext {
  std::filesystem::path config_file;  // the server's TOML file; empty: none
  std::uint64_t seed = 1;             // of a simulated mount's noise
  CameraIntrinsics camera = {};       // of the source
};

struct OpenedMount {
  std::shared_ptr<Mount> mount;          // null: the camera is fixed to the wearer
  std::shared_ptr<SimulatedHead> head;   // what turns a simulated camera; null: a real one
  std::optional<CameraIntrinsics> crop;  // digital gaze: what the mount turns
};

/// One kind of mount: a file in drivers/ fills this in.
struct MountDriver {
  /// "dynamixel:", the rest of the URI is the driver's; or a bare word ("sim"), after which only
  /// what follows a '?' is.
  std::string scheme;
  std::string usage;    // for --help: "dynamixel:DEVICE[?baud=N]"
  std::string example;  // for errors: "dynamixel:/dev/ttyUSB0"
  /// Its own table of the server's file; empty: none.
  std::string table;
  /// That table as TOML, each key with its default, range and meaning; null: no table.
  std::function<std::string()> describe;
  /// Whether `rest` may be asked for here. Touches no device.
  std::function<absl::Status(const std::string& rest, const MountFacts& facts)> check;
  std::function<absl::StatusOr<OpenedMount>(const std::string& rest, const MountOptions& model,
                                            const MountContext& context)>
      open;
};

/// Opens mounts by the scheme of their URI. Programs add the drivers they link.
class MountRegistry {
 public:
  void Add(MountDriver driver) { drivers_.push_back(std::move(driver)); }

  /// "none | sim[?crooked=SEED] | ...", in the order in which they were added.
  std::string Usage() const;
  /// Of the server's file: [mount_model] and the drivers' own.
  std::vector<std::string> Tables() const;
  /// Those tables as TOML, each key with its default, range and meaning.
  std::string Describe() const;

  /// InvalidArgument: unknown (the message lists examples of those that exist), or refused by its
  /// driver. Touches no device.
  absl::Status Check(const std::string& uri, const MountFacts& facts) const;
  /// Nothing for "none". Errors as Check, as the driver's, and of the file's tables.
  absl::StatusOr<OpenedMount> Open(const std::string& uri, const MountContext& context) const;

 private:
  /// Null: none. `rest`: what is the driver's.
  const MountDriver* Find(absl::string_view uri, std::string& rest) const;
  absl::Status Unknown(const std::string& uri) const;

  std::vector<MountDriver> drivers_;
};

}  // namespace saccade
