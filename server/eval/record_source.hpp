#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <optional>

#include "server/capture/frame_source.hpp"

namespace saccade {

/// When a recording ends, if its source does not before.
struct RecordLimits {
  std::optional<std::uint64_t> frames;  // so many
  std::optional<double> seconds;        // by the frames' own times
};

struct Recorded {
  std::uint64_t frames = 0, bad = 0, dropped = 0;
};

/// Writes what `source` gives as a recording in TUM layout: rgb/TIME.png, rgb.txt, camera.yaml. The
/// list grows behind the pictures, so that what an interrupted run leaves can be opened too. A
/// folder that holds a recording already is refused. An assumed lens is called so in camera.yaml.
///   AlreadyExists  `out` holds an rgb.txt
///   others         of the source; a file that cannot be written: names it and the remedy
absl::StatusOr<Recorded> RecordSource(FrameSource& source, const std::filesystem::path& out,
                                      const RecordLimits& limits);

}  // namespace saccade
