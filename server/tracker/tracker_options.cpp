#include "server/tracker/tracker_options.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <toml.hpp>
#include <variant>

#include "shared/io/toml_file.hpp"

namespace saccade {
namespace {

using Field = std::variant<std::uint64_t TrackerOptions::*, int TrackerOptions::*,
                           double TrackerOptions::*, bool TrackerOptions::*>;

struct Key {
  const char* name;
  Field field;
  double least;
  double most;
};

using O = TrackerOptions;
constexpr double kAny = 1.8e19;
const Key kKeys[] = {
    {"seed", &O::seed, 0, kAny},
    {"acceleration_sigma_m_s2", &O::acceleration_sigma_m_s2, 1e-3, 1e3},
    {"angular_acceleration_sigma_rad_s2", &O::angular_acceleration_sigma_rad_s2, 1e-3, 1e3},
    {"encoders", &O::encoders, 0, 1},
    {"suspend_rate_rad_s", &O::suspend_rate_rad_s, 0.1, 1e3},
    {"worn_acceleration_sigma_m_s2", &O::worn_acceleration_sigma_m_s2, 1e-3, 1e3},
    {"worn_angular_acceleration_sigma_rad_s2", &O::worn_angular_acceleration_sigma_rad_s2, 1e-3,
     1e3},
    {"fej", &O::fej, 0, 1},
    {"fej_updates", &O::fej_updates, 0, 1e9},
    {"start", &O::start, 0, 1},
    {"start_scale_sigma", &O::start_scale_sigma, 1e-3, 10},
    {"adjust", &O::adjust, 0, 1},
    {"adjust_delay", &O::adjust_delay, 1, 1000},
    {"adjust_live", &O::adjust_live, 0, 1},
    {"range_only", &O::range_only, 0, 1},
    {"pixel_sigma_px", &O::pixel_sigma_px, 0.01, 20},
    {"pixel_sigma_growth", &O::pixel_sigma_growth, 0, 10},
    {"readout_sigma_s", &O::readout_sigma_s, 0, 0.1},
    {"home_share", &O::home_share, 0, 1},
    {"parallax_sigmas", &O::parallax_sigmas, 0, 100},
    {"carry_scale_after", &O::carry_scale_after, 0, 1e9},
    {"robust", &O::robust, 0, 1},
    {"robust_cutoff", &O::robust_cutoff, 2, 20},
    {"first_stage", &O::first_stage, 4, 500},
    {"measured_per_frame", &O::measured_per_frame, 8, 500},
    {"gate_sigma", &O::gate_sigma, 1, 6},
    {"max_nssd", &O::max_nssd, 0.01, 2},
    {"patch_px", &O::patch_px, 7, 15},
    {"sub_pixel", &O::sub_pixel, 0, 2},
    {"warp", &O::warp, 0, 1},
    {"features_in_view", &O::features_in_view, 8, 400},
    {"max_features", &O::max_features, 10, 400},
    {"rest_after", &O::rest_after, 0, 1e9},
    {"forget_after", &O::forget_after, 0, 1e9},
    {"wake", &O::wake, 0, 1},
    {"loops", &O::loops, 0, 1},
    {"wake_position_share", &O::wake_position_share, 1e-4, 1},
    {"wake_angle_sigma_rad", &O::wake_angle_sigma_rad, 1e-4, 1},
    {"births_per_clone", &O::births_per_clone, 1, 100},
    {"corner_min_score", &O::corner_min_score, 1, 1e7},
    {"initial_depth_m", &O::initial_depth_m, 1e-3, 1e3},
    {"coasting_below", &O::coasting_below, 1, 100},
    {"lost_after_bad", &O::lost_after_bad, 1, 1000},
    {"lost_after_blind", &O::lost_after_blind, 1, 10000},
    {"target_frames", &O::target_frames, 1, 1000},
};

const Key* FindKey(absl::string_view name) {
  for (const Key& key : kKeys) {
    if (name == key.name) return &key;
  }
  return nullptr;
}

absl::Status UnknownKey(absl::string_view name) {
  return absl::InvalidArgumentError(
      absl::StrCat("tracker option '", name,
                   "' does not exist; known: ", absl::StrJoin(TrackerOptions::Keys(), ", ")));
}

double ValueOf(const TrackerOptions& options, const Key& key) {
  return std::visit([&](auto field) { return static_cast<double>(options.*field); }, key.field);
}

absl::Status CheckRange(const TrackerOptions& options, const Key& key) {
  const double value = ValueOf(options, key);
  if (value >= key.least && value <= key.most) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("tracker option ", key.name, ": ", value,
                                                 "; give a number from ", key.least, " to ",
                                                 key.most));
}

}  // namespace

std::vector<std::string> TrackerOptions::Keys() {
  std::vector<std::string> names;
  for (const Key& key : kKeys) names.emplace_back(key.name);
  return names;
}

absl::Status TrackerOptions::Validate() const {
  for (const Key& key : kKeys) {
    if (const absl::Status status = CheckRange(*this, key); !status.ok()) return status;
  }
  if (patch_px % 2 == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("tracker option patch_px: ", patch_px, "; give an odd number"));
  }
  return absl::OkStatus();
}

absl::Status TrackerOptions::Set(absl::string_view key_name, absl::string_view value) {
  const Key* key = FindKey(key_name);
  if (key == nullptr) return UnknownKey(key_name);
  TrackerOptions changed = *this;
  const bool read = std::visit(
      [&](auto field) {
        auto& target = changed.*field;
        using T = std::remove_reference_t<decltype(target)>;
        if constexpr (std::is_same_v<T, bool>) {
          return absl::SimpleAtob(value, &target);
        } else if constexpr (std::is_same_v<T, double>) {
          return absl::SimpleAtod(value, &target);
        } else {
          return absl::SimpleAtoi(value, &target);
        }
      },
      key->field);
  if (!read) {
    return absl::InvalidArgumentError(
        absl::StrCat("tracker option ", key_name, ": '", value, "' is not a value of its type"));
  }
  if (const absl::Status status = CheckRange(changed, *key); !status.ok()) return status;
  *this = changed;
  return absl::OkStatus();
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
