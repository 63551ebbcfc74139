#include "server/eval/team/team_settings.hpp"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include "shared/geometry/angle.hpp"
#include "shared/io/option_table.hpp"

namespace saccade {
namespace {

const OptionTable<TeamSettings>& RunTable() {
  static const OptionTable<TeamSettings> table = {
      {"landmarks", &TeamSettings::landmarks, 0, 1000,
       "only the first so many robots see landmarks; 0: all"},
      {"rate_hz", &TeamSettings::rate_hz, 0.1, 200, "poses written"},
      {"hold_ms", &TeamSettings::hold_ms, 0, 10'000, "reorder buffer: what is later is left out"},
      {"delay_ms", &TeamSettings::delay_ms, 0, 10'000, "events arrive up to so late, at random"},
      {"loss", &TeamSettings::loss, 0, 1, "share of sightings that never arrive"},
      {"seed", &TeamSettings::seed, 0, 1e9, "of delay_ms and loss"},
      {"tag_side_m", &TeamSettings::tag_side_m, 0, 100,
       "of a wand's tags; 0: as wand_tags.csv says"},
  };
  return table;
}

const OptionTable<PlanarOptions>& PlanarTable() {
  using P = PlanarOptions;
  static const OptionTable<PlanarOptions> table = {
      {"start_position_m", &P::start_position_m, 0, 10, "sigma of a start pose"},
      {"start_heading_deg", &P::start_heading_rad, 0, 180, "sigma of a start pose", kDegree},
      {"speed_scale", &P::speed_scale, 0, 1, "sigma of the part of the speed that is not reported"},
      {"turn_scale", &P::turn_scale, 0, 1, "the same of the turn rate"},
      {"turn_bias_rad_s", &P::turn_bias_rad_s, 0, 1, "sigma, while driving"},
      {"range_bias_m", &P::range_bias_m, 0, 1, "sigma"},
      {"bearing_bias_deg", &P::bearing_bias_rad, 0, 90, "sigma", kDegree},
      {"sight_delay_s", &P::sight_delay_s, 0, 1, "sigma of how late sightings are stamped"},
      {"along_m", &P::along_m, 0, 1, "motion noise ahead, per root of a second"},
      {"across_m", &P::across_m, 0, 1, "to the side"},
      {"turn_deg", &P::turn_rad, 0, 90, "of the heading", kDegree},
      {"range_m", &P::range_m, 1e-6, 10, "sigma of a range"},
      {"range_part", &P::range_part, 0, 1, "and this part of it"},
      {"bearing_deg", &P::bearing_rad, 1e-6, 90, "sigma of a bearing", kDegree},
      {"correlation_s", &P::correlation_s, 0, 100, "errors of a pair's sightings last so long"},
      {"student_dof", &P::student_dof, 0, 1000, "tails of sightings; 0: Gaussian"},
      {"placed_position_m", &P::placed_position_m, 1e-3, 10, "sigma, of who was placed by sights"},
      {"placed_heading_deg", &P::placed_heading_rad, 0.1, 180, "the same", kDegree},
  };
  return table;
}

absl::Status Bad(const std::string& key, const std::string& value, const char* remedy) {
  return absl::InvalidArgumentError(absl::StrCat("team.", key, ": '", value, "'; ", remedy));
}

absl::StatusOr<bool> Choice(const std::string& key, const std::string& value, const char* yes,
                            const char* no) {
  if (value == yes) return true;
  if (value == no) return false;
  return Bad(key, value, absl::StrCat("give ", yes, " or ", no).c_str());
}

absl::StatusOr<TeamAway> ParseAway(const std::string& value) {
  const std::vector<std::string> parts = absl::StrSplit(value, ':');
  TeamAway away;
  if (parts.size() != 3 || !absl::SimpleAtoi(parts[0], &away.robot) || away.robot < 1 ||
      !absl::SimpleAtod(parts[1], &away.from_s) || !absl::SimpleAtod(parts[2], &away.until_s) ||
      !(away.from_s >= 0 && away.until_s > away.from_s && away.until_s < 1e9)) {
    return Bad("away", value, "give ROBOT:FROM:UNTIL in seconds, for example 3:300:400");
  }
  return away;
}

absl::Status SetOne(const std::string& key, const std::string& value, TeamSettings& settings) {
  if (key == "mode" || key == "start") {
    const bool mode = key == "mode";
    const auto choice =
        mode ? Choice(key, value, "joint", "separate") : Choice(key, value, "truth", "sights");
    if (!choice.ok()) return choice.status();
    (mode ? settings.joint : settings.start_by_truth) = *choice;
    return absl::OkStatus();
  }
  if (key == "away") {
    const auto away = ParseAway(value);
    if (away.ok()) settings.away.push_back(*away);
    return away.status();
  }
  if (RunTable().Has(key)) return RunTable().Set(key, value, "team.", settings);
  if (PlanarTable().Has(key)) return PlanarTable().Set(key, value, "team.", settings.planar);
  return absl::InvalidArgumentError(
      absl::StrCat("team.", key, " is not known; saccade-eval team --help lists the keys"));
}

}  // namespace

absl::StatusOr<TeamSettings> ParseTeamSettings(const std::vector<std::string>& set) {
  TeamSettings settings;
  for (const std::string& each : set) {
    const std::vector<std::string> parts = absl::StrSplit(each, absl::MaxSplits('=', 1));
    if (parts.size() != 2 || !absl::StartsWith(parts[0], "team.")) {
      return absl::InvalidArgumentError(
          absl::StrCat("--set ", each, ": write team.KEY=VALUE, for example team.mode=joint"));
    }
    if (absl::Status done = SetOne(parts[0].substr(5), parts[1], settings); !done.ok()) return done;
  }
  return settings;
}

std::string TeamSettingsHelp() {
  const TeamSettings defaults;
  return absl::StrCat(
      "Keys of --set, each with team. in front:\n"
      "mode = joint                                 # or separate: nobody uses what he sees of the "
      "others\n"
      "start = truth                                # robots begin where they stood; or sights: "
      "placed by what they see\n"
      "away = ROBOT:FROM:UNTIL                      # seconds without that robot; it returns "
      "knowing nothing; may be repeated\n",
      RunTable().Describe(defaults), PlanarTable().Describe(defaults.planar));
}

}  // namespace saccade
