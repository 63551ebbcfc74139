#include "server/tracker/carried_squares.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>

#include "server/capture/gap.hpp"
#include "server/markers/corner_look.hpp"
#include "server/markers/marker_pattern.hpp"
#include "server/markers/square_map.hpp"
#include "server/tracker/square_pose.hpp"

namespace saccade {
namespace {

constexpr int kLookEvery = 5;  // frames, when nothing is missing
constexpr int kMostUnseen = 3;
constexpr std::size_t kMostRemembered = 100;  // frames
constexpr double kForget_s = 1.0;             // of velocity, and of which reading is which
/// Of where a corner is expected, tried in turn: a wide search meets the code's own edges.
constexpr std::array<double, 3> kSpreads_px = {0.8, 1.5, 4.0};
constexpr double kCarriedBorder_px = 4.0;
constexpr double kShortest_px = 12.0;  // side that is searched
constexpr double kStray_px = 3.0;      // from where the detector saw it: what is followed is not it
constexpr double kFacing = 0.17;       // cosine; see LandmarkTracker
constexpr double kSigma_px = 0.3, kVariance_px2 = kSigma_px * kSigma_px;
constexpr double kFloor_px = 0.05;  // as SquarePose::ratio has it
constexpr double kKeep = 0.95;      // of costs, from one picture to the next
constexpr double kMost = 30.0;      // cost of one picture
constexpr double kSure = 20.0;      // difference of costs that decides
constexpr double kSame_rad = 0.1;

/// Grey pictures: libapriltag where it suffices, else OpenCV, which reads its tags too.
absl::StatusOr<std::unique_ptr<MarkerDetector>> DetectorFor(const CarriedSquareList& squares) {
  MarkerOptions options;
  bool tags_alone = true;
  for (const CarriedSquare& square : squares) {
    if (std::ranges::find(options.families, square.family) != options.families.end()) continue;
    options.families.push_back(square.family);
    tags_alone = tags_alone && absl::StartsWith(square.family, "apriltag");
  }
  return MakeMarkerDetector(tags_alone ? "apriltag" : "aruco", options);
}

/// Where its sides are, all four; nothing if something is before it, or it is another.
std::optional<MarkerSighting> Sides(const Frame& frame, const CarriedSquare& square,
                                    const std::array<Eigen::Vector2d, 4>& corners,
                                    double spread_px) {
  SquareGuess guess{corners, {}};
  guess.covariances.fill(spread_px * spread_px * Eigen::Matrix2d::Identity());
  const SquareSearch search = SearchSquareTwice(frame.grey, *frame.camera, guess);
  if (search.found() < 4) return std::nullopt;
  const CornerLook look = LookAtCorners(frame.grey, guess, search, BorderShare(square.family));
  if (!std::ranges::all_of(look.seen, [](bool seen) { return seen; })) return std::nullopt;
  MarkerSighting sighting{square.family, square.id, {}, {}, 0};
  for (std::size_t c = 0; c < 4; ++c) {
    sighting.corners[c] = search.corners[c]->pixel;
    sighting.variance_px2[c] = 0.5 * search.corners[c]->covariance.trace() + kVariance_px2;
  }
  return sighting;
}

}  // namespace

absl::Status CheckCarried(const CarriedSquare& square) {
  const auto made = DetectorFor({square});
  if (made.ok()) {
    const absl::Status there = PatternOf(square.family, square.id).status();
    return there.ok() ? there
                      : absl::InvalidArgumentError(absl::StrCat("marker.id: ", there.message()));
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "marker.family: '", square.family, "' cannot be followed (", made.status().message(),
      "); take ", absl::StrJoin(KnownFamilies("aruco"), ", ")));
}

void CarriedSquares::SetWanted(std::shared_ptr<const CarriedSquareList> wanted) {
  if (wanted == wanted_ || *wanted == *wanted_) return;
  wanted_ = std::move(wanted);
  watch_ = nullptr;
  std::erase_if(followed_, [this](const auto& entry) {
    return std::ranges::none_of(*wanted_, [&entry](const CarriedSquare& one) {
      return Key(one.family, one.id) == entry.first;
    });
  });
  if (wanted_->empty()) return Publish();
  auto detector = DetectorFor(*wanted_);
  // CheckCarried has made one of each.
  if (detector.ok()) watch_ = std::make_unique<SquareWatch>(*std::move(detector));
  Publish();
}

std::shared_ptr<const std::vector<MarkerPose>> CarriedSquares::Step(const Frame& frame,
                                                                    Timestamp captured_ns,
                                                                    const MapSnapshot& tracked) {
  if (watch_ == nullptr || frame.camera == nullptr || frame.grey.type() != CV_8UC1) return told_;
  if (tracked.map_generation != generation_) followed_.clear();
  if (tracked.map_generation != generation_ || tracked.map_revision != revision_) cameras_.clear();
  generation_ = tracked.map_generation;
  revision_ = tracked.map_revision;
  const bool usable = tracked.metric && tracked.status == TrackingStatus::kTracking;
  if (usable) {
    cameras_[frame.capture_time_ns] = tracked.world_from_camera;
    while (cameras_.size() > kMostRemembered) cameras_.erase(cameras_.begin());
  }
  TakeDetection(*frame.camera, captured_ns - frame.capture_time_ns);
  bool missing = false;
  for (const CarriedSquare& square : *wanted_) {
    Followed& followed = followed_[{square.family, square.id}];
    if (usable && followed.searched) {
      Search(frame, captured_ns, tracked.world_from_camera, square, followed);
    }
    missing = missing || followed.measured_ns != frame.capture_time_ns;
  }
  if (usable && (missing || ++frames_ % kLookEvery == 0)) {
    watch_->Look(frame.grey, frame.capture_time_ns);
  }
  Publish();
  return told_;
}

void CarriedSquares::TakeDetection(const CameraModel& camera, Timestamp captured_offset_ns) {
  const auto seen = watch_->Take(waits_);
  if (!seen) return;
  const auto pose = cameras_.find(seen->time_ns);
  if (pose == cameras_.end()) return;
  for (const CarriedSquare& square : *wanted_) {
    Followed& followed = followed_[{square.family, square.id}];
    std::vector<MarkerSighting> own;
    std::ranges::copy_if(seen->sightings, std::back_inserter(own), [&](const auto& one) {
      return one.family == square.family && one.id == square.id && one.corrected_bits == 0;
    });
    // One that is there twice has no place.
    if (own.size() != 1) {
      followed.searched = followed.searched && ++followed.unseen < kMostUnseen;
      continue;
    }
    followed.unseen = 0;
    const auto same = followed.corners.find(seen->time_ns);
    if (followed.searched && same != followed.corners.end()) {
      double off_px = 0.0;
      for (int c = 0; c < 4; ++c) {
        off_px = std::max(off_px, (same->second[c] - own[0].corners[c]).norm());
      }
      if (off_px < kStray_px) continue;
      followed.measured_ns = 0;  // something else was followed
    } else if (followed.measured_ns >= seen->time_ns) {
      continue;  // found again since
    }
    Measure(camera, pose->second, seen->time_ns, seen->time_ns + captured_offset_ns, square.side_m,
            own[0], followed);
  }
}

void CarriedSquares::Search(const Frame& frame, Timestamp captured_ns,
                            const Rigid3& world_from_camera, const CarriedSquare& square,
                            Followed& followed) {
  if (followed.measured_ns >= frame.capture_time_ns) return;
  const double since_s = Seconds(frame.capture_time_ns - followed.measured_ns);
  const std::size_t best =
      followed.told.value_or(followed.readings[0].cost <= followed.readings[1].cost ? 0 : 1);
  Rigid3 expected = followed.readings[best].world_from_marker;
  if (since_s < kForget_s) expected.translation += since_s * followed.velocity_m_s;
  const Rigid3 camera_from_marker = world_from_camera.Inverse() * expected;
  const Eigen::Vector3d eye = camera_from_marker.Inverse().translation;
  if (eye.z() < kFacing * eye.norm()) return;
  std::array<Eigen::Vector2d, 4> corners;
  const auto points = SquareCorners(square.family, square.side_m);
  double longest = 0.0;
  for (int c = 0; c < 4; ++c) {
    const auto pixel = frame.camera->Project(camera_from_marker * points[c]);
    if (!pixel || !frame.camera->InImage(*pixel, kCarriedBorder_px)) return;
    corners[c] = *pixel;
  }
  for (int c = 0; c < 4; ++c) {
    longest = std::max(longest, (corners[c] - corners[(c + 1) % 4]).norm());
  }
  if (longest < kShortest_px) return;
  for (const double spread_px : kSpreads_px) {
    const auto found = Sides(frame, square, corners, spread_px);
    if (!found) continue;
    return Measure(*frame.camera, world_from_camera, frame.capture_time_ns, captured_ns,
                   square.side_m, *found, followed);
  }
}

void CarriedSquares::Measure(const CameraModel& camera, const Rigid3& world_from_camera,
                             Timestamp time_ns, Timestamp captured_ns, double side_m,
                             const MarkerSighting& sighting, Followed& followed) {
  const auto pose = PoseOfSquare(camera, sighting, side_m);
  if (!pose) return;
  std::array<Rigid3, 2> now = {world_from_camera * pose->square_from_camera.Inverse(),
                               world_from_camera * pose->other.Inverse()};
  std::array<double, 2> rms = {pose->rms_px, std::max(pose->rms_px, kFloor_px) * pose->ratio};
  auto& [a, b] = followed.readings;
  const double since_s = Seconds(time_ns - followed.measured_ns);
  const bool continues = followed.measured_ns != 0 && since_s < kForget_s;
  if (continues) {
    const auto turn = [](const Reading& before, const Rigid3& after) {
      return RotationAngle(before.world_from_marker, after);
    };
    if (turn(a, now[1]) + turn(b, now[0]) < turn(a, now[0]) + turn(b, now[1])) {
      std::swap(now[0], now[1]);
      std::swap(rms[0], rms[1]);
    }
    const std::size_t told = followed.told.value_or(0);
    followed.velocity_m_s =
        (now[told].translation - followed.readings[told].world_from_marker.translation) / since_s;
  } else {
    a = b = Reading();
    followed.told.reset();
    followed.velocity_m_s.setZero();
  }
  for (std::size_t k = 0; k < 2; ++k) {
    Reading& reading = followed.readings[k];
    reading.world_from_marker = now[k];
    reading.cost = kKeep * reading.cost + std::min(kMost, 4.0 * rms[k] * rms[k] / kVariance_px2);
  }
  const std::size_t best = a.cost <= b.cost ? 0 : 1;
  if (RotationAngle(now[0], now[1]) < kSame_rad) {  // either is right, and what follows may be
    a.cost = b.cost = 0.0;                          // another's
    if (!followed.told) followed.told = best;
  } else if (std::abs(a.cost - b.cost) > kSure) {
    followed.told = best;
  }
  followed.measured_ns = time_ns;
  followed.searched = true;
  followed.corners[time_ns] = sighting.corners;
  while (followed.corners.size() > kMostRemembered) {
    followed.corners.erase(followed.corners.begin());
  }
  if (!followed.told) return;
  followed.world_from_marker = followed.readings[*followed.told].world_from_marker;
  followed.seen_ns = captured_ns;
}

void CarriedSquares::Publish() {
  auto told = std::make_shared<std::vector<MarkerPose>>();
  for (const auto& [key, followed] : followed_) {
    if (followed.seen_ns == 0) continue;
    told->push_back({key.first, static_cast<std::uint32_t>(key.second), followed.world_from_marker,
                     followed.seen_ns});
  }
  told_ = told->empty() ? nullptr : std::move(told);
}

}  // namespace saccade
