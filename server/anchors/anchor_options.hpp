#pragma once

#include <absl/status/status.h>

#include <cstddef>
#include <string>

#include "server/capture/target.hpp"

namespace saccade {

/// Settings of the anchors (slam-spec section 9), defaults from there unless said otherwise.
struct AnchorOptions {
  int cluster_size = 6;                   // features that carry an anchor
  double cluster_softening_m = 0.1;       // in 1 / (sigma^2 (dist^2 + softening^2))
  double feature_radius_px = 20.0;        // a click this near to a feature may take its depth
  double plane_residual_m = 0.02;         // of a plane through neighbours, metric maps
  double plane_residual_relative = 0.01;  // the same, as a share of depth (any map)
  double median_depth_sigma = 0.3;        // share of depth
  double click_sigma_px = 0.3;            // of the clicked pixel's middle: half a pixel at most
  double tracking_sigma = 0.1;            // provisional until sigma / depth is below
  double pause_sigma_m = 0.05;            // "do not trust" above...
  double pause_sigma_relative = 0.02;     // ...unless below this share of the distance
  double pause_sigma_no_scale = 0.05;     // the same where there are no metres
  double pause_sigma_px = 10.0;
  double resume_share = 0.8;     // a paused anchor resumes below this share of the limit at once...
  double resume_time_s = 1.0;    // ...or after so long below the limit
  double far_depth_sigma = 1.0;  // share of depth, where nothing is near the ray: a mere guess
  double moved_m = 0.02;         // a jump above this is reported
  double refine_time_s = 0.5;    // a better depth is taken over this slowly: nothing jumps
  // Quotas: what stands at one time. A long day with several experts leaves some hundred marks and
  // strokes of some hundred points. Everything together is 7 MB on the wire: a page that joins has
  // it in 6 s at 10 Mbit/s, in parts, beside the video. (A stroke has at most 2000 points and a
  // text 500 bytes: edit_checks.)
  std::size_t max_annotations = 1000;
  std::size_t max_ink_points = 240'000;
  std::size_t max_bytes = 6'000'000;         // of texts, names and strokes (24 bytes a point)
  std::size_t max_picture_bytes = 64 << 20;  // of the files of pictures, which memory holds
  // What one person made and still stands: nobody alone shuts the others out.
  std::size_t max_session_annotations = 750;
  std::size_t max_session_ink_points = 180'000;
  std::size_t max_person_picture_bytes = 32 << 20;
  // What can be undone; the oldest step goes first. A recolouring takes 1 kB, a deleted stroke up
  // to 50 kB, a picture up to 1 MiB: 4 MiB are a hundred steps of anything but those, and the sum
  // keeps a thousand persons from holding gigabytes.
  std::size_t max_undo = 100;                 // steps of one person
  std::size_t max_undo_bytes = 4 << 20;       // of one person
  std::size_t max_undo_bytes_all = 64 << 20;  // of all persons together
  /// What makes world the same world after a restart: WorldKey(target). Empty: nothing does, and
  /// stored annotations stay paused.
  std::string world_key;
  /// Of the map itself: it names its coordinates where no target does.
  std::string map_key;

  absl::Status Validate() const;
};

/// A text that is equal for equal targets, e.g. "chessboard 9x6 0.04 m". Stored with annotations: a
/// metric map started from the same target has the same world frame.
std::string WorldKey(const Target& target);

}  // namespace saccade
