#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>
#include <sys/types.h>

#include <memory>

#include "server/capture/source.hpp"

namespace saccade {

/// A video that another process decodes: whatever a damaged or hostile one does to the decoder, it
/// cannot do here.
class VideoSource : public FrameSource {
 public:
  /// Of the decoder at work; 0 while there is none. For tests, which kill it.
  virtual pid_t decoder_pid() const = 0;
  virtual std::uint64_t decoder_restarts() const = 0;
};

/// Opens what follows "file:": VIDEO[?start=SECONDS&rotate=0|90|180|270&mirror=1]. Frames have the
/// video's own times, counted from `start` (0). With `realtime` they are delivered when due, the
/// newest to a reader who is late; else all of them in order. A decoder that dies is started anew
/// behind the last frame; where it dies again and again, half a second is left out and counted as a
/// bad frame. Without a camera file a lens is assumed (info().remark).
///   NotFound         no such file, or no saccade-decode beside this program
///   InvalidArgument  not a regular file; no video; an option that is wrong; a camera file of
///                    another size
///   Unavailable      the decoder cannot be had, or died
absl::StatusOr<std::unique_ptr<VideoSource>> OpenVideoFile(absl::string_view rest,
                                                           const SourceOptions& options);

/// Opens what follows "rtsp:": //HOST[:PORT]/PATH. Live: the newest frame wins, times are brought
/// to the monotonic clock by the least delay seen, a broken stream is asked for again.
absl::StatusOr<std::unique_ptr<VideoSource>> OpenRtsp(absl::string_view rest,
                                                      const SourceOptions& options);

}  // namespace saccade
