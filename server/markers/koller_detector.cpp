#include "server/markers/koller_detector.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <string>

#include "server/markers/border_fit.hpp"
#include "server/markers/koller_code.hpp"
#include "server/markers/koller_reading.hpp"
#include "server/markers/puddles.hpp"
#include "server/markers/square_region.hpp"

namespace saccade {
namespace {

// How far up from a puddle's bottom its border is, of its depth: the middle, and for squares that a
// shadow, glare or something else lies across, lower and higher.
constexpr std::array kLevels = {0.5, 0.3, 0.7, 0.2};
constexpr double kKollerReachOfSide = 0.06, kLeastKollerReach_px = 2, kMostKollerReach_px = 4;
constexpr double kLeastSupport = 0.5;

double ShortestOf(const std::array<Eigen::Vector2d, 4>& corners) {
  MarkerSighting sighting;
  sighting.corners = corners;
  return ShortestSide(sighting);
}

struct Channels {
  explicit Channels(const cv::Mat& color) {
    cv::Mat blue, red, most;
    cv::extractChannel(color, blue, 0);
    cv::extractChannel(color, green, 1);
    cv::extractChannel(color, red, 2);
    cv::max(blue, green, most);
    cv::subtract(red, most, redness);
    cv::GaussianBlur(redness, redness, {3, 3}, 0);
    cv::cvtColor(color, grey, cv::COLOR_BGR2GRAY);
    cv::GaussianBlur(grey, grey, {3, 3}, 0);
    cv::GaussianBlur(green, grown, {3, 3}, 0);
  }
  cv::Mat grey, green, grown, redness;
};

absl::StatusOr<MarkerSighting> Read(const cv::Mat& color, const Channels& channels,
                                    const SquareRegion& region) {
  BorderFitOptions options;
  options.reach_px = std::clamp(kKollerReachOfSide * ShortestOf(region.corners),
                                kLeastKollerReach_px, kMostKollerReach_px);
  options.least_support = kLeastSupport;
  const std::optional<BorderFit> fit = FitBorder(channels.green, region.corners, options);
  if (!fit) return absl::NotFoundError("a side is not straight, or covered");
  const absl::StatusOr<KollerReading> reading = ReadKollerSquare(color, fit->corners);
  if (!reading.ok()) return reading.status();
  MarkerSighting sighting;
  sighting.family = kKollerFamily;
  sighting.id = reading->id;
  for (int k = 0; k < 4; ++k) {
    sighting.corners[k] = fit->corners[(k + reading->turns) % 4];
    sighting.variance_px2[k] = fit->variance_px2[(k + reading->turns) % 4];
  }
  return sighting;
}

bool SamePlace(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double side_px) {
  return (a - b).norm() < 0.5 * side_px;
}

}  // namespace

/// Those that are not looked for; all, if the picture must be mirrored.
void KollerDetector::DropStrangers(std::vector<MarkerSighting>& found) {
  if (ids_.empty()) return;
  const auto wanted = [&](int id) { return std::find(ids_.begin(), ids_.end(), id) != ids_.end(); };
  const bool mirrored = std::any_of(found.begin(), found.end(), [&](const MarkerSighting& seen) {
    return !wanted(seen.id) && wanted(MirroredKollerId(seen.id));
  });
  std::erase_if(found, [&](const MarkerSighting& seen) {
    if (!mirrored && wanted(seen.id)) return false;
    Drop({seen.family, seen.id, Middle(seen),
          mirrored ? "the picture is mirrored, by what else is in it; turn that off where it was "
                     "taken"
                   : "it is not among the ids that are looked for"});
    return true;
  });
}

std::vector<MarkerSighting> KollerDetector::Detect(const cv::Mat& picture) {
  std::vector<MarkerSighting> found;
  ClearDropped();
  if (picture.empty() || picture.type() != CV_8UC3) return found;
  const Channels channels(picture);
  RegionGrower grower(channels.grown, channels.redness);
  std::vector<MarkerDrop> doubtful;
  for (const Puddle& puddle : FindPuddles(channels.grey)) {
    const int bottom = channels.grown.at<std::uint8_t>(puddle.bottom);
    for (const double level : kLevels) {
      const auto region =
          grower.Grow(puddle.bottom, bottom + static_cast<int>(level * puddle.depth));
      if (!region) continue;
      absl::StatusOr<MarkerSighting> sighting = Read(picture, channels, *region);
      if (sighting.ok()) {
        const Eigen::Vector2d middle = Middle(*sighting);
        const double side = ShortestSide(*sighting);
        if (std::none_of(found.begin(), found.end(), [&](const MarkerSighting& other) {
              return SamePlace(Middle(other), middle, side);
            })) {
          found.push_back(*std::move(sighting));
        }
        break;
      }
      if (!absl::IsNotFound(sighting.status())) {
        MarkerSighting at;
        at.corners = region->corners;
        doubtful.push_back(
            {kKollerFamily, -1, Middle(at), std::string(sighting.status().message())});
      }
    }
  }
  // What was read in the end, at another level, was not dropped; nor is anything twice.
  for (const MarkerDrop& drop : doubtful) {
    const bool read = std::any_of(found.begin(), found.end(), [&](const MarkerSighting& other) {
      return SamePlace(Middle(other), drop.middle, ShortestSide(other));
    });
    if (!read) Drop(drop);
  }
  for (MarkerDrop& drop : DropRepeated(found)) Drop(std::move(drop));
  DropStrangers(found);
  return found;
}

}  // namespace saccade
