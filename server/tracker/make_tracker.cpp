#include "server/tracker/make_tracker.hpp"

#include "server/tracker/landmark_tracker.hpp"

namespace saccade {

absl::StatusOr<std::unique_ptr<Tracker>> MakeTracker(const SourceInfo& source,
                                                     const TrackerOptions& options,
                                                     const LandmarkOptions& landmarks) {
  if (const absl::Status valid = landmarks.Validate(); !valid.ok()) return valid;
  if (landmarks.mode == "koller") {
    return absl::InvalidArgumentError(
        "landmarks.mode koller has no natural features; use fused here");
  }
  if (!landmarks.wanted()) return Tracker::Create(source, options);
  absl::StatusOr<std::unique_ptr<SquareLandmarks>> squares = SquareLandmarks::Create(landmarks);
  if (!squares.ok()) return squares.status();
  return Tracker::Create(source, options, nullptr, *std::move(squares));
}

absl::StatusOr<std::unique_ptr<FrameTracker>> MakeFrameTracker(const SourceInfo& source,
                                                               const TrackerOptions& options,
                                                               const LandmarkOptions& landmarks) {
  if (landmarks.mode == "koller") return LandmarkTracker::Create(source, landmarks);
  return MakeTracker(source, options, landmarks);
}

}  // namespace saccade
