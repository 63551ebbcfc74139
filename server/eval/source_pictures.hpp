#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>

#include "server/calibrate/picture_set.hpp"
#include "server/capture/frame_source.hpp"

namespace saccade {

/// Opens whatever a calibration may look at: files, cameras, recordings (whose own camera file may
/// be missing), the simulator. `frames`: A:B, or empty. A phone is refused, with the remedy.
absl::StatusOr<std::unique_ptr<FrameSource>> OpenToCalibrate(const std::string& uri,
                                                             const std::string& frames);

/// Some hundred pictures of a source, evenly spread; a live one ends with `seconds` (0: never) or a
/// signal. `fps` is the source's. DataLoss: there are none.
absl::StatusOr<PictureSet> PicturesOfSource(const std::string& uri, const std::string& frames,
                                            double seconds, double& fps);

}  // namespace saccade
