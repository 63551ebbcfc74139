#include "client/tools/words.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>

#include <algorithm>
#include <cmath>
#include <ctime>

namespace saccade::tools {
namespace {

constexpr Timestamp kNoPictureNs = 2'000'000'000;

std::string Or(const std::string& text, const char* otherwise) {
  return text.empty() ? otherwise : text;
}

StatusWords Tracking(const std::optional<MapSnapshot>& pose) {
  if (!pose) return {"◌", "waiting for the first picture", "", false};
  switch (pose->status) {
    case TrackingStatus::kInitialising:
      return {"◌", "starting", Or(pose->advice, "move the camera sideways, slowly"), false};
    case TrackingStatus::kTracking:
      switch (pose->quality) {
        case TrackingQuality::kGood:
          return {"●", "tracking good", pose->advice, false};
        case TrackingQuality::kPoor:
          return {"◐", "tracking poor", pose->advice, true};
        case TrackingQuality::kBad:
          return {"◐", "tracking bad", pose->advice, true};
        case TrackingQuality::kUnknown:
          return {"◐", "tracking", pose->advice, false};
      }
      break;
    case TrackingStatus::kCoasting:
      return {"◐", "coasting",
              Or(pose->advice, "too little is recognised: the pose is a prediction"), true};
    case TrackingStatus::kLost:
      return {"○", "lost", Or(pose->advice, "show a place seen before"), true};
    case TrackingStatus::kRelocalising:
      return {"○", "searching its place", Or(pose->advice, "show a place seen before"), true};
  }
  return {"◌", "tracking", "", false};
}

std::string Counted(std::size_t count, const char* thing) {
  return absl::StrCat(count, " ", thing, count == 1 ? "" : "s");
}

/// The server's reason, without lengths where there is no scale.
std::string Reason(const std::string& reason, bool metric) {
  const bool length =
      reason.find("expected error") == 0 && reason.find(" mm ") != std::string::npos;
  return !metric && length ? "too uncertain; scale unknown" : reason;
}

}  // namespace

std::string SpanWords(Timestamp span_ns) {
  const double s = Seconds(span_ns);
  return s < 90 ? absl::StrFormat("%.0f s", s) : absl::StrFormat("%.0f min", s / 60);
}

std::string LengthWords(double metres) {
  if (metres < 0.00995) return absl::StrFormat("%.1f mm", 1000 * metres);
  if (metres < 0.1) return absl::StrFormat("%.0f mm", 1000 * metres);
  return metres < 0.995 ? absl::StrFormat("%.0f cm", 100 * metres)
                        : absl::StrFormat("%.1f m", metres);
}

StatusWords StatusOf(const session::State& state, Timestamp now_ns) {
  using Kind = session::Link::Kind;
  const session::Link& link = state.link;
  switch (link.kind) {
    case Kind::kConnecting:
      return {"◌", "connecting", "", false};
    case Kind::kWaiting:
      return {"◌", "waiting to be let in",
              "the wearer sees that you are here; this window goes on by itself", false};
    case Kind::kRefused:
      return {"■", "refused", link.reason, true};
    case Kind::kReconnecting:
      return {"◌", absl::StrCat("reconnecting, ", SpanWords(now_ns - link.since_ns)), link.reason,
              true};
    case Kind::kLive:
      break;
  }
  if (state.source_ended) return {"■", "recording ended", "the last picture and map stay", false};
  if (state.pause) return {"■", "picture paused", "the map stays live", false};
  if (state.pose && now_ns - state.pose_ns > kNoPictureNs) {
    return {"○", absl::StrCat("no picture for ", SpanWords(now_ns - state.pose_ns)),
            "the camera sends none: a phone may be away, or without network", true};
  }
  return Tracking(state.pose);
}

std::string LostWords(const session::State& state) {
  if (!state.pose || (state.pose->status != TrackingStatus::kLost &&
                      state.pose->status != TrackingStatus::kRelocalising)) {
    return "";
  }
  const StatusWords words = Tracking(state.pose);
  return absl::StrCat(words.text == "lost" ? "Lost" : "Searching its place", ": ", words.advice,
                      ". Marks come back with it");
}

std::string ClockWords(std::int64_t unix_ns) {
  const std::time_t seconds = unix_ns / 1'000'000'000;
  std::tm local{};
  localtime_r(&seconds, &local);
  return absl::StrFormat("%02d:%02d", local.tm_hour, local.tm_min);
}

std::string PauseWords(const net::PicturePause& pause) {
  return absl::StrCat(Or(pause.by, "The wearer"), " paused the picture at ",
                      ClockWords(pause.since_unix_ns), "; the map stays live");
}

std::string PresenceWords(const std::vector<net::Participant>& participants) {
  std::vector<std::string> parts;
  for (const auto& [role, word] :
       {std::pair(net::Role::kExpert, "expert"), std::pair(net::Role::kWearer, "wearer"),
        std::pair(net::Role::kViewer, "viewer")}) {
    const auto count = static_cast<std::size_t>(
        std::count_if(participants.begin(), participants.end(),
                      [&role = role](const net::Participant& one) { return one.role == role; }));
    if (count > 0) parts.push_back(Counted(count, word));
  }
  return absl::StrJoin(parts, ", ");
}

AnchorWords WordsOf(const Annotation& annotation, const Scale& scale) {
  const Anchor& anchor = annotation.anchor;
  const std::string why = Reason(anchor.reason, scale.metric);
  const auto with = [&why](const char* words) {
    return AnchorWords{why.empty() ? words : absl::StrCat(words, ": ", why), true};
  };
  if (anchor.state == AnchorState::kPaused) return with("do not trust");
  if (anchor.state == AnchorState::kStopped) return with("stopped");
  if (!anchor.place_known) return {"place not known", true};
  const std::string px =
      anchor.error_px ? absl::StrFormat("%.1f px", *anchor.error_px) : "out of view";
  if (!DoNotTrust(anchor, scale)) {
    return {absl::StrCat(px, " · ", scale.metric ? LengthWords(anchor.error_m) : "scale unknown"),
            false};
  }
  return {absl::StrCat("do not trust: expected error ",
                       ExcessOf(anchor, scale).mm ? LengthWords(anchor.error_m) : px),
          true};
}

}  // namespace saccade::tools
