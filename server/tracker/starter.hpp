#pragma once

#include <absl/status/status.h>

#include <optional>

#include "server/capture/frame_source.hpp"
#include "server/filter/filter_state.hpp"
#include "server/map/landmark.hpp"
#include "server/tracker/births.hpp"
#include "server/tracker/front_end.hpp"
#include "server/tracker/tracker_options.hpp"

namespace saccade {

/// How a map began.
struct Start {
  bool metric = false;
  Births::DepthGuess depth;  // for the first features
};

/// Gives the world its frame and scale: by the target where the place has one and it comes into
/// view in time, else by the first picture itself (slam-spec 7).
class Starter {
 public:
  /// InvalidArgument: a target without points, or one that this camera cannot use.
  static absl::Status Check(const SourceInfo& source);

  Starter(const SourceInfo& source, const TrackerOptions& options)
      : source_(source), options_(options) {}
  void Reset() { waited_ = 0; }

  /// Puts the camera and the known points into an empty filter and map; nothing while it waits for
  /// the target.
  std::optional<Start> Try(FrontEnd& front_end, FilterState& filter, LandmarkMap& map);
  bool waits_for_target() const;
  /// True if the known points are to be dropped `frames_since_start` after the start.
  bool TargetExpired(std::int64_t frames_since_start) const;

 private:
  std::optional<Start> TryChessboard(FrontEnd& front_end, FilterState& filter, LandmarkMap& map);
  std::optional<Start> TryPatches(FrontEnd& front_end, FilterState& filter, LandmarkMap& map);
  std::optional<Start> Free(FilterState& filter) const;

  SourceInfo source_;
  TrackerOptions options_;
  int waited_ = 0;
};

}  // namespace saccade
