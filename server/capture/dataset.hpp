#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>

#include "server/capture/source.hpp"

namespace saccade {

/// Opens a recording: TUM RGB-D or EuRoC layout, or a folder of pictures (ReadDatasetLayout), and
/// where present target.yaml and start.yaml. A frame's id is its position in the list, also where
/// earlier ones are bad or left out; its capture time is its time stamp.
///
/// Without `realtime` every frame is delivered in order, decoded ahead on a thread of its own. With
/// it, frame k is due (its stamp - the first's) after the first Next(), pauses of more than five
/// seconds counted as five; a reader who comes late gets the newest frame that is due. Where two
/// stamps are more than a second apart, a line on stderr says so.
///
/// start.yaml and a chessboard's hint speak of frame 0 and are left out if `first_frame` is later.
///   NotFound         no folder, no list, no camera file, no template
///   InvalidArgument  a field or line that is wrong; first picture not of camera.yaml's size; empty
///                    frame range; a rate missing, or given beside time stamps
///   DataLoss         no picture in the range can be decoded
absl::StatusOr<std::unique_ptr<FrameSource>> OpenDataset(const std::filesystem::path& folder,
                                                         const SourceOptions& options);

/// The same of what follows "dataset:": DIR, or DIR?fps=N for pictures without time stamps.
absl::StatusOr<std::unique_ptr<FrameSource>> OpenDatasetUri(absl::string_view rest,
                                                            const SourceOptions& options);

}  // namespace saccade
