#include "server/tracker/picture_rate.hpp"

#include <algorithm>
#include <vector>

#include "server/capture/gap.hpp"

namespace saccade {
namespace {

constexpr std::size_t kIntervals = 9;  // of which the median counts: a dropped picture is no rate
constexpr std::size_t kFewestIntervals = 3;
constexpr double kEnough_hz = 20.0;  // of ordinary cameras; dim light brings them down to 15
constexpr double kMoving_px = 3.0;   // between two pictures; a hand at rest does less
constexpr int kFewestSearches = 8;
constexpr double kGoodShare = 0.5;  // of the searches
constexpr int kGoodInRow = 3;       // frames that end it

}  // namespace

void PictureRate::Add(double dt_s) {
  if (!(dt_s > 0.0)) return;
  intervals_s_.push_back(dt_s);
  if (intervals_s_.size() > kIntervals) intervals_s_.pop_front();
}

void PictureRate::Record(int attempted, int accepted, std::optional<double> moved_px) {
  if (moved_px) moves_ = *moved_px > kMoving_px;
  if (attempted >= kFewestSearches && accepted < kGoodShare * attempted) {
    failing_ = true;
    good_in_row_ = 0;
  } else if (accepted >= kFewestSearches && ++good_in_row_ >= kGoodInRow) {
    failing_ = false;
  }
}

std::optional<double> PictureRate::Median_s() const {
  if (intervals_s_.size() < kFewestIntervals) return std::nullopt;
  std::vector<double> sorted(intervals_s_.begin(), intervals_s_.end());
  const auto middle = sorted.begin() + std::ssize(sorted) / 2;
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

std::optional<double> PictureRate::TooFew() const {
  const auto interval_s = Median_s();
  if (!interval_s || *interval_s * kEnough_hz <= 1.0) return std::nullopt;
  // Over longer ones nothing is carried on: whatever moves is too fast.
  const bool gaps = *interval_s > 1e-9 * static_cast<double>(kLongestGap_ns);
  if (!gaps && !(failing_ && moves_)) return std::nullopt;
  return 1.0 / *interval_s;
}

}  // namespace saccade
