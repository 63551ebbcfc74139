#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "saccade/v1/session.pb.h"
#include "saccade/v1/surface.pb.h"
#include "server/record/mcap_writer.hpp"

namespace saccade {

/// What a file says of itself.
struct RecordedFrom {
  std::string version, source;
  Timestamp unix_minus_monotonic_ns = 0;
};

/// Events as messages of one file: what they are, on channels of their own, and what other people's
/// viewers draw of them (docs/design/recordings.md). One thread.
class EventWriter {
 public:
  /// Makes the file. Errors as McapWriter's.
  static absl::StatusOr<std::unique_ptr<EventWriter>> Create(const std::filesystem::path& file,
                                                             const RecordedFrom& from);
  ~EventWriter();

  /// `came_ns`: for events that name no time of their own [ns, monotonic].
  absl::Status Write(const v1::Event& event, Timestamp came_ns);
  absl::Status Write(const v1::GetSurfaceResponse& surface, Timestamp now_ns);
  McapWriter& mcap() { return *mcap_; }

 private:
  class Channels;
  EventWriter(std::unique_ptr<McapWriter> mcap, const RecordedFrom& from);
  absl::Status WritePicture(const v1::AccessUnit& unit);
  absl::Status WriteLens(const v1::CameraIntrinsics& lens, Timestamp time_ns);
  absl::Status WritePose(const v1::PoseEvent& pose);
  absl::Status WriteMap(const v1::MapDelta& map, Timestamp time_ns);

  const std::unique_ptr<McapWriter> mcap_;
  const Timestamp unix_minus_monotonic_ns_;
  std::unique_ptr<Channels> channels_;
  std::string lens_;                             // that was written last
  Timestamp lens_ns_ = 0, points_ns_ = 0;        // when
  std::map<std::uint64_t, v1::Vector3> points_;  // of the map, by feature
};

}  // namespace saccade
