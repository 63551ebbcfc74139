#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace saccade {

/// Everything that can be set about tracking; each field with its unit and the reason for its
/// default. One set of values serves every camera and recording: what differs between cameras
/// (lens, size, rate) comes from the frames themselves.
struct TrackerOptions {
  // Chance.
  std::uint64_t seed = 1;  // every random choice of the tracker starts here

  // Motion model M1 (slam-spec 3), profile `handheld` of SceneLib2.
  double acceleration_sigma_m_s2 = 4.0;
  double angular_acceleration_sigma_rad_s2 = 6.0;
  // The same where encoders tell what the head does: only the wearer is left to be guessed.
  bool encoders = true;  // use them
  /// While the joints turn faster, pictures are too blurred to search: encoders carry the pose.
  double suspend_rate_rad_s = 2.0;
  double worn_acceleration_sigma_m_s2 = 2.0;
  double worn_angular_acceleration_sigma_rad_s2 = 2.0;  // a walking trunk

  // Filter.
  /// Use a source's inertial unit: metres, gravity, and motion where nothing is seen. Off: on
  /// `hall_imu` the metre is 5 % wrong (docs/measurements/2026-11-30-inertial.md).
  bool inertial = false;
  bool fej = false;                 // Jacobians at first estimates (slam-spec 1) always...
  int fej_updates = 60;             // ...or for so many updates of a map
  bool range_only = false;          // ESID: bearings frozen at birth; false: SID
  double pixel_sigma_px = 0.5;      // of a match at the picture's centre, lens and warp included
  double pixel_sigma_growth = 1.0;  // sigma (1 + growth d / d_max): lens models fit worse outside
  /// Of the rolling shutter's read-out time where camera.yaml is silent; 0: taken as global.
  double readout_sigma_s = 0.015;
  double parallax_sigmas = 3.0;  // of a clone's matches, before they correct depth (T13)
  int carry_scale_after = 60;    // updates, before a change of scale is kept unobserved
  /// Of the matches, that the clone which errors are counted from (or older ones) must have given
  /// birth to; below, a younger clone takes its place. 0: errors are counted from the start.
  double home_share = 0.5;
  bool robust = true;          // matches are weighted by the robust pose; false: gates only
  double robust_cutoff = 4.5;  // Mahalanobis distance from which a match is ignored

  // Search (slam-spec 5.1).
  int first_stage = 20;          // features searched widely, for the robust pose
  int measured_per_frame = 100;  // 50 to 60 are enough, 100 safe (findings)
  double gate_sigma = 3.0;       // half axis of the search ellipse: p = 0.989
  double max_nssd = 0.40;        // NCC 0.80
  int patch_px = 11;             // side of the compared patch
  int sub_pixel = 1;             // 0: integer pixels, 1: parabola, 2: Lucas-Kanade
  bool warp = true;              // patches are drawn as seen from here; false: as first seen

  // Map.
  int features_in_view = 80;  // new ones are started below
  int max_features = 250;     // in the filter; update time grows with the square
  int rest_after = 30;  // frames out of sight, then what may rest does; 0: when the filter is full
  /// The same, then what is too little known to rest is forgotten, where the camera has moved on;
  /// 0: when the filter is full. They made up 95 of 250 features of a walk, never seen again.
  int forget_after = 30;
  bool wake = true;  // what left well measured is taken back where it comes into view again
  double resume_patience_s = 6.0;      // a stored map is looked for, before a new one is begun
  double wake_position_share = 0.01;   // sigma of where it was seen from, of the distance...
  double wake_angle_sigma_rad = 0.01;  // ...and of that camera's direction
  int births_per_clone = 15;           // features that share one pose clone (slam-spec 5.4)
  double corner_min_score = 2000.0;    // see CornerOptions; plain walls must still give some
  /// New features wait outside the updates until their range is known (DelayedDepths); false: used
  /// at once with what is known of it. Without a target, once the map's scale is held.
  bool classic = false;
  double initial_depth_m = 1.0;  // of the first features without a target: sets the scale

  // Start without a target.
  bool start = true;  // wait until pictures hold the scale; false: as soon as some depths are known
  /// A lens that nobody measured is learnt while it is tracked; false: it stays as it is assumed.
  bool learn_lens = true;
  double start_scale_sigma = 0.05;  // relative, of distances gone against distances seen

  // Bundle adjustment on another core.
  bool adjust = true;
  int adjust_delay = 2;      // frames from its start until its result is taken
  bool adjust_live = false;  // a result that is late is taken later; false: it is waited for

  /// A place that is recognised while tracking, and further off than the search reaches, moves the
  /// map; false: only what the search finds closes a loop. Off: measured on one corridor, it brings
  /// the camera closer (56 to 23 cm), but not the marks (docs/derivations/loops.md).
  bool loops = false;

  // State machine (slam-spec 2).
  int coasting_below = 5;     // accepted matches a frame
  int lost_after_bad = 3;     // frames in a row with bad quality
  int lost_after_blind = 15;  // frames in a row without a match
  int target_frames = 30;     // a chessboard target is used this long, and any is waited for

  /// InvalidArgument names the field, its value and its range.
  absl::Status Validate() const;
  /// `--set key=value`. InvalidArgument: unknown key (all known ones are listed) or not a value.
  absl::Status Set(absl::string_view key, absl::string_view value);
  /// The same from "key=value"; the error says which pair.
  absl::Status SetPair(absl::string_view pair);
  /// Reads the [tracker] table of a TOML file over the present values.
  ///   NotFound         no such file
  ///   InvalidArgument  not TOML, unknown key, wrong type: names file and key
  absl::Status LoadToml(const std::filesystem::path& file);
  /// Names of all keys.
  static std::vector<std::string> Keys();
  /// The [tracker] table with all defaults, each key with its range and meaning.
  static std::string Describe();
};

}  // namespace saccade
