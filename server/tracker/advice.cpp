#include "server/tracker/advice.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>

#include "server/tracker/lens_evidence.hpp"

namespace saccade {
namespace {

constexpr double kFast_rad_s = 1.5;
constexpr int kFew = 12;

/// "5 pictures a second are too few for this motion."
std::string RateWords(double rate_hz) {
  const long rounded = std::lround(rate_hz);
  const std::string count = rate_hz < 0.95 ? absl::StrFormat("%.1f pictures a second are", rate_hz)
                            : rounded == 1 ? std::string("1 picture a second is")
                                           : absl::StrCat(rounded, " pictures a second are");
  return absl::StrCat(count, " too few for this motion: move more slowly, or give more.");
}

std::string WordsForStart(const Difficulties& seen) {
  if (seen.too_few_hz) return RateWords(*seen.too_few_hz);
  if (seen.waits_for_target) return "Point the camera at the printed target.";
  return seen.turns_followed
             ? "For now orientation only: move slowly sideways so that depth can be seen."
             : "Move slowly sideways so that depth can be seen.";
}

}  // namespace

std::string AdviceFor(const StatusMonitor& monitor, const Difficulties& seen) {
  // Nothing else that the wearer may do helps as long as this is so.
  if (seen.lens_growth) return LensWords(*seen.lens_growth);
  switch (monitor.status()) {
    case TrackingStatus::kInitialising:
      return WordsForStart(seen);
    case TrackingStatus::kLost: {
      const std::string lost = seen.resumes
                                   ? "Looking for the place mapped before: show what was seen then."
                                   : "Look again at a place seen before.";
      return seen.too_few_hz ? absl::StrCat(lost, " ", RateWords(*seen.too_few_hz)) : lost;
    }
    case TrackingStatus::kRelocalising:
      return "Place recognised: hold still for a moment.";
    case TrackingStatus::kCoasting:
      if (monitor.suspended()) return "";
      if (seen.too_few_hz) return RateWords(*seen.too_few_hz);
      return "The view is covered, blurred or empty: uncover the lens or look at something with "
             "texture.";
    case TrackingStatus::kTracking:
      break;
  }
  if (seen.speed_rad_s > kFast_rad_s) return "Turn more slowly.";
  if (seen.in_view < kFew) return "Few marks in view: look at something with texture.";
  return "";
}

}  // namespace saccade
