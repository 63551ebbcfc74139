#include "server/tracker/tracker_options.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <toml.hpp>

#include "shared/io/option_table.hpp"
#include "shared/io/toml_file.hpp"

namespace saccade {
namespace {

constexpr char kPrefix[] = "tracker option ";

const OptionTable<TrackerOptions>& Table() {
  using O = TrackerOptions;
  constexpr double kAny = 1.8e19;
  static const OptionTable<O> table = {
      {"seed", &O::seed, 0, kAny, "every random choice of the tracker starts here"},
      {"acceleration_sigma_m_s2", &O::acceleration_sigma_m_s2, 1e-3, 1e3,
       "of the camera, carried in the hand or on the head"},
      {"angular_acceleration_sigma_rad_s2", &O::angular_acceleration_sigma_rad_s2, 1e-3, 1e3,
       "of the camera"},
      {"encoders", &O::encoders, 0, 1, "use the joint angles of a mount"},
      {"suspend_rate_rad_s", &O::suspend_rate_rad_s, 0.1, 1e3,
       "joints faster than this: encoders carry the pose, pictures are blurred"},
      {"worn_acceleration_sigma_m_s2", &O::worn_acceleration_sigma_m_s2, 1e-3, 1e3,
       "of the wearer, where encoders tell what the head does"},
      {"worn_angular_acceleration_sigma_rad_s2", &O::worn_angular_acceleration_sigma_rad_s2, 1e-3,
       1e3, "of the wearer"},
      {"inertial", &O::inertial, 0, 1, "use an inertial unit where the source has one"},
      {"fej", &O::fej, 0, 1, "Jacobians at first estimates always ..."},
      {"fej_updates", &O::fej_updates, 0, 1e9, "... or for so many updates of a map"},
      {"start", &O::start, 0, 1,
       "wait until pictures hold the scale; false: until some depths are known"},
      {"start_scale_sigma", &O::start_scale_sigma, 1e-3, 10,
       "relative, of distances gone against distances seen"},
      {"learn_lens", &O::learn_lens, 0, 1,
       "of a camera without camera.yaml: learnt while it is tracked"},
      {"adjust", &O::adjust, 0, 1, "bundle adjustment on another core"},
      {"adjust_delay", &O::adjust_delay, 1, 1000,
       "frames from its start until its result is taken"},
      {"adjust_live", &O::adjust_live, 0, 1,
       "a late result is taken later; false: it is waited for"},
      {"classic", &O::classic, 0, 1,
       "new features wait until particles agree on their range (Davison 2003)"},
      {"range_only", &O::range_only, 0, 1, "bearings frozen at birth"},
      {"pixel_sigma_px", &O::pixel_sigma_px, 0.01, 20, "of a match at the picture's centre"},
      {"pixel_sigma_growth", &O::pixel_sigma_growth, 0, 10,
       "sigma (1 + growth d / d_max) towards the corners"},
      {"readout_sigma_s", &O::readout_sigma_s, 0, 0.1,
       "of the read-out time where camera.yaml is silent; 0: taken as global"},
      {"home_share", &O::home_share, 0, 1,
       "of matches, below which a younger clone counts errors; 0: never"},
      {"parallax_sigmas", &O::parallax_sigmas, 0, 100,
       "of a clone's matches, before they correct depth"},
      {"carry_scale_after", &O::carry_scale_after, 0, 1e9,
       "updates, before a change of scale is kept unobserved"},
      {"robust", &O::robust, 0, 1, "matches are weighted by the robust pose; false: gates only"},
      {"robust_cutoff", &O::robust_cutoff, 2, 20,
       "Mahalanobis distance from which a match is ignored"},
      {"first_stage", &O::first_stage, 4, 500, "features searched widely, for the robust pose"},
      {"measured_per_frame", &O::measured_per_frame, 8, 500,
       "features at most; 50 to 60 are enough"},
      {"gate_sigma", &O::gate_sigma, 1, 6, "half axis of the search ellipse"},
      {"max_nssd", &O::max_nssd, 0.01, 2, "of a match; 0.40 is a correlation of 0.80"},
      {"patch_px", &O::patch_px, 7, 15, "side of the compared patch, odd"},
      {"sub_pixel", &O::sub_pixel, 0, 2, "0: whole pixels, 1: parabola, 2: Lucas-Kanade"},
      {"warp", &O::warp, 0, 1, "patches are drawn as seen from here; false: as first seen"},
      {"features_in_view", &O::features_in_view, 8, 400, "new ones are started below"},
      {"max_features", &O::max_features, 10, 400,
       "in the filter; update time grows with the square"},
      {"rest_after", &O::rest_after, 0, 1e9,
       "frames out of sight, then what may rest does; 0: when the filter is full"},
      {"forget_after", &O::forget_after, 0, 1e9, "the same for what is too little known to rest"},
      {"wake", &O::wake, 0, 1, "what rests is taken back where it comes into view"},
      {"loops", &O::loops, 0, 1,
       "a recognised place moves the map; false: only what the search finds"},
      {"resume_patience_s", &O::resume_patience_s, 0, 3600,
       "a stored map is looked for, before a new one is begun"},
      {"wake_position_share", &O::wake_position_share, 1e-4, 1,
       "sigma of where it was seen from, of the distance ..."},
      {"wake_angle_sigma_rad", &O::wake_angle_sigma_rad, 1e-4, 1,
       "... and of that camera's direction"},
      {"births_per_clone", &O::births_per_clone, 1, 100, "features that share one pose clone"},
      {"corner_min_score", &O::corner_min_score, 1, 1e7,
       "of a corner; plain walls must still give some"},
      {"initial_depth_m", &O::initial_depth_m, 1e-3, 1e3,
       "of the first features without a target: sets the scale"},
      {"coasting_below", &O::coasting_below, 1, 100, "accepted matches a frame"},
      {"lost_after_bad", &O::lost_after_bad, 1, 1000, "frames in a row with bad quality"},
      {"lost_after_blind", &O::lost_after_blind, 1, 10000, "frames in a row without a match"},
      {"target_frames", &O::target_frames, 1, 1000,
       "a chessboard target is used, and any is waited for, so long"},
  };
  return table;
}

absl::Status UnknownKey(absl::string_view name) {
  return absl::InvalidArgumentError(
      absl::StrCat("tracker option '", name,
                   "' does not exist; known: ", absl::StrJoin(TrackerOptions::Keys(), ", ")));
}

}  // namespace

std::vector<std::string> TrackerOptions::Keys() { return Table().Names(); }

std::string TrackerOptions::Describe() {
  return absl::StrCat("[tracker]\n", Table().Describe(TrackerOptions()));
}

absl::Status TrackerOptions::Validate() const {
  if (absl::Status valid = Table().Validate(*this, kPrefix); !valid.ok()) return valid;
  if (patch_px % 2 == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(kPrefix, "patch_px: ", patch_px, "; give an odd number"));
  }
  return absl::OkStatus();
}

absl::Status TrackerOptions::Set(absl::string_view key, absl::string_view value) {
  if (!Table().Has(key)) return UnknownKey(key);
  return Table().Set(key, value, kPrefix, *this);
}

absl::Status TrackerOptions::SetPair(absl::string_view pair) {
  const std::size_t equals = pair.find('=');
  if (equals == absl::string_view::npos || equals == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("--set '", pair, "' is not key=value, for example --set seed=2"));
  }
  const absl::Status status = Set(pair.substr(0, equals), pair.substr(equals + 1));
  if (status.ok()) return status;
  return absl::Status(status.code(), absl::StrCat("--set ", pair, ": ", status.message()));
}

absl::Status TrackerOptions::LoadToml(const std::filesystem::path& file) {
  const absl::StatusOr<toml::value> root = ParseTomlFile(file);
  if (!root.ok()) return root.status();
  try {
    if (!root->contains("tracker")) return absl::OkStatus();
    for (const auto& [name, value] : toml::find(*root, "tracker").as_table()) {
      std::string text;
      if (value.is_boolean()) text = value.as_boolean() ? "true" : "false";
      if (value.is_integer()) text = absl::StrCat(value.as_integer());
      if (value.is_floating()) text = absl::StrCat(value.as_floating());
      const absl::Status status = Set(name, text);
      if (!status.ok()) {
        return absl::InvalidArgumentError(
            absl::StrCat(file.string(), ": [tracker]: ", status.message()));
      }
    }
  } catch (const std::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat(file.string(), ": ", error.what()));
  }
  return absl::OkStatus();
}

}  // namespace saccade
