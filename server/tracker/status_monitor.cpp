#include "server/tracker/status_monitor.hpp"

namespace saccade {
namespace {

constexpr int kWindow = 10;             // frames
constexpr double kGood = 0.3;           // of attempts that succeed [PT]
constexpr double kBad = 0.13;           // [PT]
constexpr int kConfirmations = 3;       // frames after a relocalisation
constexpr double kConfirmed = 0.6;      // of attempts there (slam-spec 6)
constexpr int kLongestSuspension = 60;  // frames

}  // namespace

void StatusMonitor::Reset() { *this = StatusMonitor(options_); }

double StatusMonitor::ratio() const {
  int attempted = 0, accepted = 0;
  for (const Counts& counts : window_) {
    attempted += counts.attempted;
    accepted += counts.accepted;
  }
  return attempted == 0 ? 1.0 : static_cast<double>(accepted) / attempted;
}

void StatusMonitor::Lose() {
  status_ = TrackingStatus::kLost;
  quality_ = TrackingQuality::kBad;
  bad_in_row_ = blind_in_row_ = 0;
  refused_ = false;
  window_.clear();
}

void StatusMonitor::BeginRelocalisation() {
  status_ = TrackingStatus::kRelocalising;
  confirming_ = kConfirmations;
  confirmed_ = 0;
  refused_ = false;
}

void StatusMonitor::Confirm(int attempted, int accepted) {
  const bool good = accepted >= options_.coasting_below && accepted >= kConfirmed * attempted;
  confirmed_ += good ? 1 : 0;
  --confirming_;
  const bool impossible = confirmed_ + confirming_ < kConfirmations - 1;  // one may fail
  if (impossible) {
    status_ = TrackingStatus::kLost;
    refused_ = true;
  } else if (confirming_ == 0) {
    status_ = TrackingStatus::kTracking;
    window_.clear();
    bad_in_row_ = blind_in_row_ = 0;
  }
}

void StatusMonitor::Suspend() {
  refused_ = false;
  if (++suspended_in_row_ > kLongestSuspension) {
    if (status_ != TrackingStatus::kLost) Count(0, 0, true);
  } else if (status_ == TrackingStatus::kTracking) {
    status_ = TrackingStatus::kCoasting;
  }
}

void StatusMonitor::Record(int attempted, int accepted, bool settled) {
  suspended_in_row_ = 0;
  refused_ = false;
  if (status_ == TrackingStatus::kLost) return;
  if (status_ == TrackingStatus::kRelocalising) {
    Confirm(attempted, accepted);
    return;
  }
  Count(attempted, accepted, settled);
}

void StatusMonitor::Count(int attempted, int accepted, bool settled) {
  window_.push_back({attempted, accepted});
  if (window_.size() > kWindow) window_.pop_front();
  const double share = ratio();
  quality_ = share > kGood  ? TrackingQuality::kGood
             : share < kBad ? TrackingQuality::kBad
                            : TrackingQuality::kPoor;
  bad_in_row_ = quality_ == TrackingQuality::kBad ? bad_in_row_ + 1 : 0;
  blind_in_row_ = accepted == 0 ? blind_in_row_ + 1 : 0;
  if (bad_in_row_ >= options_.lost_after_bad || blind_in_row_ >= options_.lost_after_blind) {
    Lose();
  } else if (accepted < options_.coasting_below) {
    status_ = TrackingStatus::kCoasting;
  } else {
    status_ = settled ? TrackingStatus::kTracking : TrackingStatus::kInitialising;
  }
}

std::string AdviceFor(const StatusMonitor& monitor, bool waits_for_target, double speed_rad_s,
                      int in_view) {
  constexpr double kFast_rad_s = 1.5;
  constexpr int kFew = 12;
  switch (monitor.status()) {
    case TrackingStatus::kInitialising:
      return waits_for_target ? "Point the camera at the printed target."
                              : "Move slowly sideways so that depth can be seen.";
    case TrackingStatus::kLost:
      return "Tracking is lost: look again at a place seen before.";
    case TrackingStatus::kRelocalising:
      return "Place recognised: hold still for a moment.";
    case TrackingStatus::kCoasting:
      if (monitor.suspended()) return "";
      return "The view is covered, blurred or empty: uncover the lens or look at something with "
             "texture.";
    case TrackingStatus::kTracking:
      break;
  }
  if (speed_rad_s > kFast_rad_s) return "Turn more slowly.";
  if (in_view < kFew) return "Few marks in view: look at something with texture.";
  return "";
}

}  // namespace saccade
