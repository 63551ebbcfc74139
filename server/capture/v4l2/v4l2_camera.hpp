#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/capture/v4l2/pixel_format.hpp"
#include "server/capture/v4l2/v4l2_request.hpp"
#include "shared/io/video_device.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade {

/// A picture as the driver gave it, copied so that the driver has its buffer back.
struct RawPicture {
  std::vector<std::uint8_t> bytes;
  Timestamp capture_ns = 0;   // mid-exposure, monotonic
  Timestamp received_ns = 0;  // when the driver had it
  std::uint64_t lost = 0;     // pictures that the driver left out before this one
  bool torn = false;          // not to be decoded: an error of the driver's, or bytes are missing
};

/// When a picture's middle line was in the middle of its exposure, by the driver's stamp.
/// `flags`: of its v4l2_buffer. Start-of-exposure stamps are of the first line, others of the end.
Timestamp MidExposure(Timestamp stamp_ns, std::uint32_t flags, Timestamp exposure_ns,
                      Timestamp readout_ns);

/// One opened camera that streams. One thread; ends with the device.
class V4l2Camera {
 public:
  /// Sets mode and controls, maps buffers and starts the stream.
  /// `readout_s`: of the rolling shutter, 0 if unknown.
  ///   InvalidArgument     no such mode: lists those it has
  ///   FailedPrecondition  not a camera, busy, or a control that it lacks: says what to do
  ///   Unavailable         gone
  static absl::StatusOr<std::unique_ptr<V4l2Camera>> Open(const V4l2Request& request,
                                                          double readout_s,
                                                          std::unique_ptr<CaptureDevice> device);
  ~V4l2Camera();

  const V4l2Layout& layout() const { return layout_; }
  double fps() const { return fps_; }  // 0: the driver does not say
  const std::string& name() const { return name_; }

  /// The oldest picture that waits.
  ///   DeadlineExceeded  none within `most_ms`
  ///   Unavailable       the device is gone
  absl::StatusOr<RawPicture> Next(int most_ms);

 private:
  V4l2Camera(const V4l2Request& request, double readout_s, std::unique_ptr<CaptureDevice> device);
  absl::Status SetMode(const VideoMode& mode);
  void SetRate();
  absl::Status StartStream();
  absl::Status Problem(int error, const char* what) const;
  Timestamp Exposure(Timestamp now_ns);

  const V4l2Request request_;
  const Timestamp readout_ns_;
  std::unique_ptr<CaptureDevice> device_;
  std::string name_;
  V4l2Layout layout_;
  double fps_ = 0;
  std::vector<std::span<const std::uint8_t>> buffers_;
  bool streams_ = false;
  std::optional<std::uint32_t> sequence_;  // of the last picture
  std::optional<Timestamp> exposure_ns_;
  Timestamp exposure_read_ns_ = 0;
  bool stamp_told_ = false;
};

}  // namespace saccade
