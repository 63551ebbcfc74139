#include "server/calibrate/view_picker.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr Timestamp kSoonAfter_ns = 200'000'000;
constexpr double kHardlyMoved = 0.004;  // of the picture's width
constexpr double kDiffers = 0.12;
constexpr double kNominalFocal = 0.85;  // of the width: 60 deg
constexpr double kPickTilted = 0.3;     // sine of the tilt: 17 deg
constexpr int kTiltsWanted = 3;
constexpr double kNear = 0.45;  // the board's diagonal against the picture's

}  // namespace

double ViewPicker::Place::Distance(const Place& other) const {
  const double apart = std::max(std::abs(x - other.x), std::abs(y - other.y));
  const double sizes = std::abs(size - other.size);
  const double tilts = std::hypot(tilt_x - other.tilt_x, tilt_y - other.tilt_y);
  return apart + sizes + 0.5 * tilts;
}

ViewPicker::Place ViewPicker::PlaceOf(const BoardView& view) const {
  cv::Point2d middle(0, 0);
  for (const cv::Point2d& corner : view.corners) middle += corner;
  middle *= 1.0 / static_cast<double>(view.corners.size());
  const auto far = std::max_element(
      view.corners.begin(), view.corners.end(),
      [&](const auto& a, const auto& b) { return cv::norm(a - middle) < cv::norm(b - middle); });
  Place place{middle.x / picture_.width, middle.y / picture_.height,
              2 * cv::norm(*far - middle) / std::hypot(picture_.width, picture_.height), 0, 0};
  const double focal = kNominalFocal * picture_.width;
  const cv::Matx33d nominal(focal, 0, 0.5 * picture_.width, 0, focal, 0.5 * picture_.height, 0, 0,
                            1);
  cv::Vec3d rotation, translation;
  if (cv::solvePnP(view.points, view.corners, nominal, {}, rotation, translation, false,
                   cv::SOLVEPNP_IPPE)) {
    cv::Matx33d turn;
    cv::Rodrigues(rotation, turn);
    const double sign = turn(2, 2) < 0 ? -1 : 1;
    place.tilt_x = sign * turn(0, 2);
    place.tilt_y = sign * turn(1, 2);
  }
  return place;
}

ViewPicker::Verdict ViewPicker::Offer(const BoardView& view) {
  double moved = 0;
  if (last_.points == view.points && view.time_ns - last_.time_ns < kSoonAfter_ns) {
    for (std::size_t k = 0; k < view.corners.size(); ++k) {
      moved = std::max(moved, cv::norm(view.corners[k] - last_.corners[k]));
    }
  }
  last_ = view;
  const Place place = PlaceOf(view);
  for (const Place& other : places_) {
    if (place.Distance(other) < kDiffers) return Verdict::kAlike;
  }
  if (moved > kHardlyMoved * picture_.width) return Verdict::kMoving;
  if (static_cast<int>(views_.size()) >= kMostViews) return Verdict::kAlike;
  Take(view);
  return Verdict::kTaken;
}

void ViewPicker::Take(const BoardView& view) {
  views_.push_back(view);
  places_.push_back(PlaceOf(view));
  for (const cv::Point2d& corner : view.corners) {
    const int column = static_cast<int>(corner.x * kColumns / picture_.width);
    const int row = static_cast<int>(corner.y * kRows / picture_.height);
    ++counts_[std::clamp(row, 0, kRows - 1) * kColumns + std::clamp(column, 0, kColumns - 1)];
  }
}

double ViewPicker::Covered() const {
  const auto seen = std::count_if(counts_.begin(), counts_.end(), [](int n) { return n > 0; });
  return static_cast<double>(seen) / static_cast<double>(counts_.size());
}

std::string ViewPicker::TiltAdvice() const {
  int left = 0, right = 0, up = 0, down = 0;
  for (const Place& place : places_) {
    left += place.tilt_x < -kPickTilted;
    right += place.tilt_x > kPickTilted;
    up += place.tilt_y < -kPickTilted;
    down += place.tilt_y > kPickTilted;
  }
  if (std::min(left, right) < kTiltsWanted) {
    return absl::StrCat("turn the board by 30 degrees, its ", left < right ? "left" : "right",
                        " side towards the camera");
  }
  if (std::min(up, down) < kTiltsWanted) {
    return absl::StrCat("tilt the board by 30 degrees, its ", up < down ? "upper" : "lower",
                        " side towards the camera");
  }
  return "";
}

std::string ViewPicker::PlaceAdvice() const {
  static constexpr const char* kAcross[] = {"left", "", "right"};
  static constexpr const char* kAlong[] = {"upper", "", "lower"};
  // The emptiest of nine places.
  for (const auto& [along, across] : std::vector<std::pair<int, int>>{
           {1, 0}, {1, 2}, {0, 1}, {2, 1}, {0, 0}, {0, 2}, {2, 0}, {2, 2}}) {
    const int column = across == 0 ? 0 : across == 1 ? kColumns / 2 : kColumns - 1;
    const int row = along == 0 ? 0 : along == 1 ? kRows / 2 : kRows - 1;
    if (Corners(column, row) > 0) continue;
    if (along == 1) return absl::StrCat("move the board to the ", kAcross[across], " edge");
    if (across == 1) return absl::StrCat("move the board to the ", kAlong[along], " edge");
    return absl::StrCat("move the board into the ", kAlong[along], " ", kAcross[across], " corner");
  }
  return "";
}

std::string ViewPicker::Advice() const {
  if (places_.empty()) return "show the whole board";
  if (std::string place = PlaceAdvice(); !place.empty()) return place;
  if (std::string tilt = TiltAdvice(); !tilt.empty()) return tilt;
  const bool near = std::any_of(places_.begin(), places_.end(),
                                [](const Place& place) { return place.size > kNear; });
  if (!near) return "come nearer: the board should fill half of the picture";
  if (static_cast<int>(views_.size()) < kEnoughViews) return "go on: other places, other tilts";
  return "";
}

bool ViewPicker::Complete() const { return Advice().empty(); }

}  // namespace saccade
