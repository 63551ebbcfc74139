#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>

#include "server/capture/source.hpp"

namespace saccade {

/// Opens a recording in TUM RGB-D layout: rgb.txt, camera.yaml, and where present target.yaml and
/// start.yaml. A frame's id is its position in rgb.txt, also where earlier ones are bad or left
/// out; its capture time is its time stamp.
///
/// Without `realtime` every frame is delivered in order, decoded ahead on a thread of its own. With
/// it, frame k is due (its stamp - the first's) after the first Next(), pauses of more than five
/// seconds counted as five; a reader who comes late gets the newest frame that is due. Where two
/// stamps are more than a second apart, a line on stderr says so.
///
/// start.yaml and a chessboard's hint speak of frame 0 and are left out if `first_frame` is later.
///   NotFound         no folder, no rgb.txt, no camera.yaml, no template
///   InvalidArgument  a field or line that is wrong; first picture not of camera.yaml's size; empty
///                    frame range
///   DataLoss         no picture in the range can be decoded
///   Unimplemented    EuRoC layout
absl::StatusOr<std::unique_ptr<FrameSource>> OpenDataset(const std::filesystem::path& folder,
                                                         const SourceOptions& options);

}  // namespace saccade
