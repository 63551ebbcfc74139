#pragma once

#include <optional>
#include <random>
#include <vector>

#include "server/capture/frame.hpp"
#include "server/filter/filter_state.hpp"
#include "server/map/landmark.hpp"
#include "server/tracker/frame_matcher.hpp"
#include "server/tracker/tracker_options.hpp"

namespace saccade {

/// Starts features where they are needed (slam-spec 5.6, docs/derivations/birth.md).
class Births {
 public:
  explicit Births(const TrackerOptions& options) : options_(options) {}
  void Reset();

  /// What features near the camera are taken to be at, before anything is known of them.
  struct DepthGuess {
    double inverse_range = 1.0;        // [1/m]
    double inverse_range_sigma = 0.5;  // [1/m]
  };
  /// From the ranges of features in view; nothing if there are too few to tell.
  static std::optional<DepthGuess> GuessDepth(const FilterState& filter,
                                              const FrameMatches& matches);

  /// How many more features the map wants in view.
  int Missing(const FrameMatches& matches) const;
  /// Starts features in a new pose clone, where the picture has corners and the map has none.
  /// `everywhere`: as many as the map wants in view (the first frame). Returns how many.
  int Grow(const Frame& frame, const FrameMatches& matches, const DepthGuess& depth,
           bool everywhere, const FrameMatcher& matcher, FrontEnd& front_end, FilterState& filter,
           LandmarkMap& map, std::mt19937_64& random);
  /// Starts one feature at a pixel, seen by a camera of these velocities; nothing if there is no
  /// texture or no room for a patch.
  std::optional<FeatureId> Plant(const Frame& frame, const Eigen::Vector2d& pixel,
                                 const DepthGuess& depth, CloneId clone, const CameraMotion& motion,
                                 const FrameMatcher& matcher, FrontEnd& front_end,
                                 FilterState& filter, LandmarkMap& map);
  /// True if Grow() would start features now.
  bool Wants(const FrameMatches& matches) const;

 private:
  TrackerOptions options_;
  int frames_since_growth_ = 1000;
  Timestamp grown_ns_ = 0, now_ns_ = 0;  // the newest growth, and the newest frame
};

}  // namespace saccade
