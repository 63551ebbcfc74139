#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "server/capture/frame_source.hpp"

namespace saccade {

/// How to open a source. A source refuses what it cannot do.
struct SourceOptions {
  std::uint64_t first_frame = 0;           // `--frames A:B`: from A ...
  std::optional<std::uint64_t> end_frame;  // ... to before B; beyond the end means the end
  bool realtime = false;              // pace by time stamps, drop frames when the reader is late
  std::filesystem::path camera_file;  // `--camera`: instead of the source's own camera.yaml
  std::optional<double> fps = {};     // of pictures or a video that have no time stamps
  /// A recording's lens is taken to see so wide [deg], whatever its camera.yaml says.
  std::optional<double> view_deg = {};
  bool lens_may_be_missing = false;  // of a recording: then it is assumed
};

/// Opens sources by the scheme of their URI ("dataset:DIR"). Programs add the schemes they link.
class SourceRegistry {
 public:
  /// Receives what follows the colon.
  using Factory = std::function<absl::StatusOr<std::unique_ptr<FrameSource>>(
      absl::string_view rest, const SourceOptions& options)>;

  void Add(std::string scheme, Factory factory);
  ///   InvalidArgument  no scheme in the URI
  ///   Unimplemented    unknown scheme; the message lists those that exist
  absl::StatusOr<std::unique_ptr<FrameSource>> Open(absl::string_view uri,
                                                    const SourceOptions& options) const;

 private:
  std::map<std::string, Factory, std::less<>> factories_;
};

/// The schemes that this folder implements: dataset.
SourceRegistry CaptureSources();

/// CaptureSources().Open(uri, options).
absl::StatusOr<std::unique_ptr<FrameSource>> OpenSource(absl::string_view uri,
                                                        const SourceOptions& options);

}  // namespace saccade
