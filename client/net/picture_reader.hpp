#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>

#include "client/net/stream.hpp"
#include "saccade/v1/video.pb.h"

namespace saccade::net {

/// Access units to coded pictures with the facts of their frame. One thread.
class PictureReader {
 public:
  /// InvalidArgument names the field. `arrived_ns`: this machine's clock.
  absl::StatusOr<CodedPicture> Read(const v1::AccessUnit& unit, Timestamp arrived_ns);

 private:
  std::string lens_;  // serialised, of `camera_`
  std::shared_ptr<const CameraModel> camera_;
};

}  // namespace saccade::net
