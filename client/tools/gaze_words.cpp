#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <array>
#include <cmath>
#include <numbers>

#include "client/tools/words.hpp"
#include "shared/geometry/angle.hpp"

namespace saccade::tools {
namespace {

constexpr double kHomeRad = 0.5 * kDegree;
constexpr std::array<const char*, 8> kSides = {"right", "right and down", "down", "left and down",
                                               "left",  "left and up",    "up",   "right and up"};

std::string Degrees(double rad) { return absl::StrFormat("%.1f deg", rad / kDegree); }

/// Which way an angle of the picture points: from straight right, clockwise.
const char* SideOf(double angle_rad) {
  const int eighth = static_cast<int>(std::lround(angle_rad / (std::numbers::pi / 4)));
  return kSides[static_cast<std::size_t>(((eighth % 8) + 8) % 8)];
}

std::string TargetWords(const session::State& state) {
  const GazeSnapshot& gaze = *state.gaze;
  if (!gaze.target) return "nothing";
  if (const auto* feature = std::get_if<GazeFeature>(&*gaze.target)) {
    return absl::StrCat("feature ", feature->id);
  }
  const auto* mark = std::get_if<GazeAnnotation>(&*gaze.target);
  if (mark == nullptr) return "a point";
  const Annotation* annotation = state.annotations.Find(mark->id);
  if (annotation == nullptr) return "a mark";
  if (annotation->text.empty()) return absl::StrCat("a ", ShapeWord(annotation->shape));
  return absl::StrCat("“", annotation->text, "”");
}

/// On its way to a target, or holding it.
StatusWords Towards(const session::State& state) {
  const GazeSnapshot& gaze = *state.gaze;
  const std::string target = TargetWords(state);
  const std::string off = gaze.error_rad ? absl::StrCat(", ", Degrees(*gaze.error_rad)) : "";
  std::string advice = gaze.problem;
  if (!gaze.reachable) {
    absl::StrAppend(&advice, advice.empty() ? "" : " ", "The head misses it by ",
                    Degrees(gaze.miss_rad), ": this is as near as it can look.");
    if (gaze.guidance_rad) {
      absl::StrAppend(&advice, " Ask the wearer to turn ", SideOf(*gaze.guidance_rad), ".");
    }
  }
  if (gaze.target_lost) {
    absl::StrAppend(&advice, advice.empty() ? "" : " ",
                    "Target lost: it is no longer in the map. Its last place is held.");
  }
  const bool warn = !advice.empty();
  if (!gaze.reachable) return {"◐", absl::StrCat("out of reach: ", target, off), advice, warn};
  if (gaze.arrived) return {"●", absl::StrCat("holding ", target, off), advice, warn};
  const char* verb = gaze.mode == GazeMode::kSaccade ? "turning to " : "following ";
  return {"◐", absl::StrCat(verb, target, off), advice, warn};
}

}  // namespace

bool HasHead(const session::State& state) {
  return state.gaze && state.gaze->mode != GazeMode::kNoMount;
}

std::string DirectionWords(const Eigen::Vector3d& joints_rad) {
  std::vector<std::string> parts;
  const auto add = [&parts](double rad, const char* more, const char* less) {
    const long whole = std::lround(rad / kDegree);
    if (whole != 0)
      parts.push_back(absl::StrCat(std::abs(whole), " deg ", whole > 0 ? more : less));
  };
  add(joints_rad.x(), "right", "left");
  add(joints_rad.y(), "up", "down");
  return parts.empty() ? "straight ahead" : absl::StrJoin(parts, ", ");
}

StatusWords GazeWords(const session::State& state) {
  if (!state.gaze || !state.link.live()) return {"○", "not known now", "", false};
  const GazeSnapshot& gaze = *state.gaze;
  const auto plain = [&gaze](const char* mark, const char* text) {
    return StatusWords{mark, text, gaze.problem, !gaze.problem.empty()};
  };
  switch (gaze.mode) {
    case GazeMode::kNoMount:
      return plain("○", "fixed to the wearer: no head to turn");
    case GazeMode::kIdle:
      return plain("○", "at rest");
    case GazeMode::kSaccade:
    case GazeMode::kFixate:
      return Towards(state);
    case GazeMode::kHorizon:
      return plain("●", "keeping the picture level");
    case GazeMode::kHome: {
      const bool there = gaze.joints_rad && gaze.joints_rad->head<2>().norm() < kHomeRad;
      return there ? plain("●", "looking straight ahead") : plain("◐", "turning straight ahead");
    }
    case GazeMode::kStopped:
      return plain("■", "stopped");
    case GazeMode::kExplore:
      return plain("◐", "looking round where the map is least certain");
    case GazeMode::kParked:
      return plain("◐", gaze.pilot ? "slowly straight ahead" : "pilot gone: slowly straight ahead");
  }
  return plain("○", "not known now");
}

std::string TargetLabel(const GazeSnapshot& gaze) {
  if (gaze.target_lost) return "target lost";
  if (!gaze.reachable && gaze.guidance_rad) {
    return absl::StrCat("out of reach: wearer, turn ", SideOf(*gaze.guidance_rad));
  }
  const std::string off = gaze.error_rad ? absl::StrCat(", ", Degrees(*gaze.error_rad)) : "";
  if (!gaze.reachable) return absl::StrCat("out of reach", off);
  if (gaze.arrived) return absl::StrCat("holding", off);
  return absl::StrCat(gaze.mode == GazeMode::kSaccade ? "turning" : "following", off);
}

std::string SteerWords(const session::State& state, const session::GazePilot& pilot) {
  if (!HasHead(state)) return "";
  const GazeSnapshot& gaze = *state.gaze;
  const std::string& me = state.joined.participant_id;
  std::vector<std::string> parts, others;
  if (gaze.paused) parts.push_back("paused by the wearer");
  const bool wearer =
      gaze.pilot && std::any_of(state.participants.begin(), state.participants.end(),
                                [&](const net::Participant& one) {
                                  return one.participant_id == gaze.pilot->participant_id &&
                                         one.role == net::Role::kWearer;
                                });
  if (!gaze.pilot) {
    parts.push_back("nobody pilots");
  } else if (gaze.pilot->participant_id == me) {
    parts.push_back("you pilot");
  } else {
    parts.push_back(wearer ? "the wearer has taken over"
                           : absl::StrCat(gaze.pilot->display_name, " pilots"));
  }
  if (pilot.kind() == session::GazePilot::Kind::kWaiting) {
    parts.push_back(absl::StrCat("you are number ", pilot.position(), " in the queue"));
  }
  for (const GazePilot& one : gaze.queue) {
    if (one.participant_id != me) others.push_back(one.display_name);
  }
  if (!others.empty()) {
    parts.push_back(
        absl::StrCat(absl::StrJoin(others, ", "), others.size() == 1 ? " waits" : " wait"));
  }
  return absl::StrJoin(parts, " · ");
}

}  // namespace saccade::tools
