#include "server/tracker/square_doubts.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "server/tracker/square_pose.hpp"

namespace saccade {
namespace {

constexpr int kLaterEvery = 25;         // pictures
constexpr int kTwinPictures = 3;        // in which both were seen
constexpr int kMirroredPictures = 3;    // in a row
constexpr std::size_t kFewFactors = 5;  // pictures that told a size
constexpr double kWorst_px = 1.5;       // rms of the corners of a square that has only grown
constexpr double kLeast_px = 16.0;      // side of one that tells its size
constexpr int kOthers = 2;              // squares that agree on the camera without this one

/// How much larger than said a square is that lies where it should; nothing if it does not.
std::optional<double> FactorOf(const CameraModel& camera, const Rigid3& world_from_camera,
                               const KnownSquare& square, const MarkerSighting& seen) {
  if (ShortestSide(seen) < kLeast_px) return std::nullopt;
  const Rigid3 camera_from_square = world_from_camera.Inverse() * square.world_from_square;
  double factor = 1.0, rms = 0.0;
  for (int round = 0; round < 4; ++round) {
    const auto corners = SquareCorners(square.family, factor * square.side_m);
    std::array<Eigen::Vector2d, 4> at;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (int c = 0; c < 4; ++c) {
      const auto pixel = camera.Project(camera_from_square * corners[c]);
      if (!pixel) return std::nullopt;
      at[c] = *pixel;
      middle += 0.25 * *pixel;
    }
    const Eigen::Vector2d shift = Middle(seen) - middle;
    double along = 0.0, squares = 0.0, off = 0.0;
    for (int c = 0; c < 4; ++c) {
      const Eigen::Vector2d from = at[c] - middle, to = seen.corners[c] - Middle(seen);
      along += from.dot(to);
      squares += from.squaredNorm();
      off += (at[c] + shift - seen.corners[c]).squaredNorm();
    }
    rms = std::sqrt(0.25 * off);
    factor *= along / squares;
    if (!(factor > 0.2 && factor < 5.0)) return std::nullopt;
  }
  if (rms > kWorst_px) return std::nullopt;
  return factor;
}

double Median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void SquareDoubts::Say(const std::string& what, std::string words) {
  if (said_.insert(what).second) news_.push_back(std::move(words));
}

void SquareDoubts::LookForTwins(const std::vector<MarkerSighting>& seen) {
  std::set<Key> twins;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    for (std::size_t i = 0; i < k; ++i) {
      const bool same = seen[i].id == seen[k].id && seen[i].family == seen[k].family;
      const bool apart = (Middle(seen[i]) - Middle(seen[k])).norm() > ShortestSide(seen[k]);
      if (same && apart) twins.insert({seen[k].family, seen[k].id});
    }
  }
  for (const Key& key : twins) {
    if (++twins_[key] < kTwinPictures) continue;
    Say(absl::StrCat("twin ", key.first, key.second),
        absl::StrCat("square ", key.first, " ", key.second,
                     " is in the picture twice; neither is used while both are seen: give each "
                     "square an id of its own"));
  }
}

void SquareDoubts::Add(const CameraModel& camera, const std::vector<MarkerSighting>& seen,
                       const SquareMap& map) {
  ++looks_;
  if (!seen.empty()) mirrored_ = 0;
  LookForTwins(seen);
  std::vector<MarkerSighting> known;
  for (const MarkerSighting& sighting : seen) {
    const auto same = [&](const MarkerSighting& other) {
      return other.id == sighting.id && other.family == sighting.family;
    };
    if (map.Find(sighting.family, sighting.id) != nullptr &&
        std::count_if(seen.begin(), seen.end(), same) == 1) {
      known.push_back(sighting);
    }
  }
  if (known.size() <= kOthers) return;
  if (!wants_pictures() && ++skipped_ % kLaterEvery != 0) return;
  ++pictures_;
  const auto pose = PoseOfSquares(camera, known, map);
  if (!pose) return;
  for (const MarkerSighting& sighting : known) {
    const KnownSquare& square = *map.Find(sighting.family, sighting.id);
    const auto factor = FactorOf(camera, pose->fit.world_from_camera, square, sighting);
    if (!factor) continue;
    // One that looks right is among those that agree, but is not its own witness.
    if (pose->squares - (std::abs(*factor - 1.0) < kLeastOff ? 1 : 0) < kOthers) continue;
    std::vector<double>& all = factors_[{sighting.family, sighting.id}];
    all.push_back(*factor);
    if (all.size() < kFewFactors) continue;
    AddSize(square.family, square.id, square.side_m, Median(all));
    if (all.size() > 2 * kFewFactors) all.erase(all.begin());
  }
}

void SquareDoubts::AddSize(const std::string& family, int id, double said_m, double factor) {
  if (std::abs(factor - 1.0) < kLeastOff) return;
  Say(absl::StrCat("size ", family, id),
      absl::StrFormat("square %s %d is not of the size that is said: by the others it is %.2f "
                      "times as large, %.1f mm instead of %.1f mm; measure its black border, and "
                      "correct its size or print it at 100 %%",
                      family, id, factor, 1e3 * factor * said_m, 1e3 * said_m));
}

void SquareDoubts::AddDisagreement(const std::string& family, int id, int other, double factor) {
  if (std::abs(factor - 1.0) < kLeastOff) return;
  Say(absl::StrCat("two ", family, std::min(id, other), " ", std::max(id, other)),
      absl::StrFormat("squares %s %d and %d are said to be of one size, and %d is %.2f times as "
                      "large as %d: one of them is printed wrong; measure both",
                      family, id, other, id, factor, other));
}

void SquareDoubts::AddMirrored(std::size_t squares) {
  mirrored_ = squares > 0 ? mirrored_ + 1 : 0;
  if (mirrored_ < kMirroredPictures) return;
  Say("mirrored",
      absl::StrCat("the picture is mirrored: ", squares,
                   squares == 1 ? " square is" : " squares are",
                   " read in its mirror image, none in it; turn mirroring off where it is taken"));
}

}  // namespace saccade
