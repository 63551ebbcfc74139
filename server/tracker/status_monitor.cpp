#include "server/tracker/status_monitor.hpp"

namespace saccade {
namespace {

constexpr int kWindow = 10;             // frames
constexpr double kGood = 0.3;           // of attempts that succeed [PT]
constexpr double kBad = 0.13;           // [PT]
constexpr int kConfirmations = 3;       // frames after a relocalisation
constexpr double kConfirmed = 0.6;      // of attempts there (slam-spec 6)
constexpr int kLongestSuspension = 60;  // frames
// A view that jumps is found again by a few false matches that agree by chance: 5 of 20 did.
constexpr double kDoubtful = 0.3;    // of attempts: below, the pose is not believed at once...
constexpr double kConvincing = 0.4;  // ...until so many succeed...
constexpr int kConvincingInRow = 2;  // ...in so many frames in a row
constexpr int kFew = 8;              // matches: fewer need kFewShare of the attempts
constexpr double kFewShare = 0.6;
constexpr int kLongestDoubt = 15;  // frames

bool Agree(int attempted, int accepted, double share) {
  return accepted >= share * attempted && (accepted >= kFew || accepted >= kFewShare * attempted);
}

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
  bad_in_row_ = blind_in_row_ = doubtful_in_row_ = unconvinced_ = 0;
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
    bad_in_row_ = blind_in_row_ = doubtful_in_row_ = unconvinced_ = 0;
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

void StatusMonitor::Coast() {
  refused_ = false;
  if (status_ == TrackingStatus::kTracking) status_ = TrackingStatus::kCoasting;
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

/// Whether the pose is to be believed; after one frame that is not, only when some others are.
bool StatusMonitor::Believe(int attempted, int accepted) {
  if (!Agree(attempted, accepted, kDoubtful)) {
    unconvinced_ = kConvincingInRow;
  } else if (unconvinced_ > 0) {
    unconvinced_ = Agree(attempted, accepted, kConvincing) ? unconvinced_ - 1 : kConvincingInRow;
  }
  doubtful_in_row_ = unconvinced_ > 0 ? doubtful_in_row_ + 1 : 0;
  return unconvinced_ == 0;
}

void StatusMonitor::Count(int attempted, int accepted, bool settled) {
  const bool believed = !settled || Believe(attempted, accepted);
  window_.push_back({attempted, accepted});
  if (window_.size() > kWindow) window_.pop_front();
  const double share = ratio();
  quality_ = share > kGood  ? TrackingQuality::kGood
             : share < kBad ? TrackingQuality::kBad
                            : TrackingQuality::kPoor;
  bad_in_row_ = quality_ == TrackingQuality::kBad ? bad_in_row_ + 1 : 0;
  blind_in_row_ = accepted == 0 ? blind_in_row_ + 1 : 0;
  if (bad_in_row_ >= options_.lost_after_bad || blind_in_row_ >= options_.lost_after_blind ||
      doubtful_in_row_ >= kLongestDoubt) {
    Lose();
  } else if (accepted < options_.coasting_below || !believed) {
    status_ = TrackingStatus::kCoasting;
  } else {
    status_ = settled ? TrackingStatus::kTracking : TrackingStatus::kInitialising;
  }
}

}  // namespace saccade
