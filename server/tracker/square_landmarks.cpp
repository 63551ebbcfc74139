#include "server/tracker/square_landmarks.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "server/markers/corner_look.hpp"
#include "server/tracker/line_time.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMostViews = 40;    // of a square; beyond, every second one is forgotten
constexpr std::size_t kMostPoses = 400;   // frames
constexpr int kLookEvery = 5;             // frames, when nothing is missing
constexpr double kLandmarkFacing = 0.17;  // cosine; see LandmarkTracker
constexpr double kShortest_px = 14.0;
constexpr double kBorder_px = 4.0;
constexpr int kHiddenCorners = 3;   // behind known geometry: the square is not searched
constexpr int kHiddenLines = 2;     // with no more sides than this something is before the square
constexpr double kSigma_px = 0.25;  // of a corner beyond its fits: lens, print, shutter
constexpr double kLeastSpread_px = 1.0;  // of where a corner is expected
constexpr double kMostSpread_px = 6.0;
constexpr double kGate_sigmas = 4.0;

}  // namespace

absl::StatusOr<std::unique_ptr<SquareLandmarks>> SquareLandmarks::Create(
    const LandmarkOptions& options) {
  if (const absl::Status valid = options.Validate(); !valid.ok()) return valid;
  absl::StatusOr<SquareMap> known = LoadSquares(options);
  if (!known.ok()) return known.status();
  absl::StatusOr<std::unique_ptr<MarkerDetector>> detector = MakeDetector(options, *known);
  if (!detector.ok()) return detector.status();
  return std::unique_ptr<SquareLandmarks>(
      new SquareLandmarks(options, *std::move(known), *std::move(detector)));
}

SquareLandmarks::SquareLandmarks(const LandmarkOptions& options, SquareMap known,
                                 std::unique_ptr<MarkerDetector> detector)
    : options_(options), known_(std::move(known)), watch_(std::move(detector)) {
  known_states_.resize(4 * known_.squares.size());
  for (const KnownSquare& square : known_.squares) {
    known_shares_.push_back(BorderShare(square.family));
  }
  mapped_share_ = BorderShare(options_.family);
}

void SquareLandmarks::SetCarried(std::shared_ptr<const CarriedSquareList> carried) {
  if (carried == carried_) return;
  carried_ = std::move(carried);
  for (const CarriedSquare& one : *carried_) {
    mapped_.erase({one.family, one.id});
    views_.erase({one.family, one.id});
  }
}

bool SquareLandmarks::IsCarried(const std::string& family, int id) const {
  return std::ranges::any_of(
      *carried_, [&](const CarriedSquare& one) { return one.id == id && one.family == family; });
}

void SquareLandmarks::Reset() {
  watch_.Drop();
  newest_.clear();
  mapped_.clear();
  misprinted_.clear();
  ForgetViews();
  ForgetSearch();
}

void SquareLandmarks::ForgetViews() {
  views_.clear();
  poses_.clear();
}

void SquareLandmarks::ScaleViews(double by) {
  for (auto& [time, pose] : poses_) pose.translation *= by;
}

void SquareLandmarks::ForgetSearch() {
  found_.clear();
  attempted_ = 0;
  std::ranges::fill(known_states_, FeatureState::kNotAttempted);
}

void SquareLandmarks::Look(const Frame& frame, bool eager) {
  ForgetSearch();
  newest_.clear();
  detector_ms_ = 0;
  const auto seen = watch_.Take(/*wait=*/!options_.live);
  waited_ms_ = watch_.waited_ms();
  if (seen) Take(*frame.camera, *seen);
  const bool wanting = eager || !views_.empty() || (mapped_.empty() && !options_.family.empty());
  if (frames_++ % kLookEvery == 0 || wanting) watch_.Look(frame.grey, frame.capture_time_ns);
}

void SquareLandmarks::Take(const CameraModel& camera, const SquareWatch::Seen& seen) {
  detector_ms_ = seen.detector_ms;
  doubts_.Add(camera, seen.sightings, known_);
  if (seen.mirrored) doubts_.AddMirrored(*seen.mirrored);
  for (const std::string& words : doubts_.Take()) Log(absl::StrCat("landmarks: ", words));
  newest_ = seen.sightings;
  std::erase_if(newest_, [this](const auto& one) { return IsCarried(one.family, one.id); });
  for (const MarkerSighting& sighting : newest_) {
    const auto same = [&](const MarkerSighting& other) {
      return other.id == sighting.id && other.family == sighting.family;
    };
    const Key key{sighting.family, sighting.id};
    // A square that is there twice has no place; one with guessed bits may be none.
    if (sighting.family != options_.family || !(options_.size_m > 0) ||
        known_.Find(sighting.family, sighting.id) != nullptr || mapped_.contains(key) ||
        misprinted_.contains(key) || sighting.corrected_bits > 0 ||
        std::ranges::count_if(newest_, same) != 1) {
      continue;
    }
    std::vector<MarkerView>& views = views_[key];
    views.push_back({seen.time_ns, Rigid3(), sighting});
    if (views.size() <= kMostViews) continue;
    for (std::size_t k = 1; 2 * k < views.size(); ++k) views[k] = views[2 * k];
    views.resize(views.size() / 2);
  }
}

std::optional<SquaresPose> SquareLandmarks::FindCamera(const CameraModel& camera, bool with_known,
                                                       const FilterState& filter) const {
  if (newest_.empty()) return std::nullopt;
  SquareMap all = with_known ? known_ : SquareMap();
  for (const auto& [key, mapped] : mapped_) {
    const auto pose = filter.ClonePose(mapped.marker);
    if (pose) all.squares.push_back({key.first, key.second, mapped.side_m, *pose});
  }
  return PoseOfSquares(camera, newest_, all);
}

void SquareLandmarks::SearchOne(const Frame& frame, const Rigid3& pose, const Matrix6d& covariance,
                                const CameraMotion& motion, double readout_s, const Sought& sought,
                                std::array<FeatureState, 4>& states) {
  const CameraModel& camera = *frame.camera;
  states.fill(FeatureState::kNotAttempted);
  const auto& [world_from_square, corners, border_share, marker] = sought;
  const Eigen::Vector3d at = (world_from_square.Inverse() * pose).translation;
  if (at.z() < kLandmarkFacing * at.norm()) return;
  std::array<Eigen::Vector3d, 4> in_world = corners;
  for (Eigen::Vector3d& corner : in_world) corner = world_from_square * corner;
  std::array<bool, 4> hidden{};
  if (sight_) hidden = sight_->Hides(pose.translation, in_world);
  if (std::ranges::count(hidden, true) >= kHiddenCorners) return;
  SquareGuess guess;
  std::array<Eigen::Vector2d, 4> d_readout;
  Eigen::Matrix<double, 6, 1> velocities;
  velocities << motion.velocity_m_s, motion.angular_velocity_rad_s;
  double longest = 0.0;
  for (int c = 0; c < 4; ++c) {
    const auto seen = PredictFixed(camera, pose, world_from_square * corners[c]);
    if (!seen || !camera.InImage(seen->pixel, kBorder_px)) return;
    d_readout[c] = seen->d_camera * velocities * LateInReadouts(camera, seen->pixel);
    guess.corners[c] = seen->pixel + readout_s * d_readout[c];
    const Eigen::Matrix2d spread = seen->d_camera * covariance * seen->d_camera.transpose();
    const double sigma =
        std::clamp(std::sqrt(std::max(0.0, 0.5 * spread.trace())), kLeastSpread_px, kMostSpread_px);
    guess.covariances[c] = sigma * sigma * Eigen::Matrix2d::Identity();
  }
  for (int c = 0; c < 4; ++c) {
    longest = std::max(longest, (guess.corners[c] - guess.corners[(c + 1) % 4]).norm());
  }
  if (longest < kShortest_px) return;
  const SquareSearch search = SearchSquareTwice(frame.grey, camera, guess);
  if (search.lines <= kHiddenLines) return;
  const CornerLook look = LookAtCorners(frame.grey, guess, search, border_share);
  std::vector<Observation> own;
  for (int c = 0; c < 4; ++c) {
    if (hidden[c] || !look.seen[c]) continue;
    ++attempted_;
    states[c] = FeatureState::kFailed;
    if (!search.corners[c]) continue;
    Observation observation;
    observation.known_point = marker != 0 ? corners[c] : world_from_square * corners[c];
    observation.marker = marker;
    observation.pixel = search.corners[c]->pixel - readout_s * d_readout[c];
    observation.d_readout = d_readout[c];
    observation.noise =
        search.corners[c]->covariance + kSigma_px * kSigma_px * Eigen::Matrix2d::Identity();
    const Eigen::Vector2d off = search.corners[c]->pixel - guess.corners[c];
    const Eigen::Matrix2d spread = guess.covariances[c] + observation.noise;
    if (off.dot(spread.inverse() * off) > kGate_sigmas * kGate_sigmas) continue;
    states[c] = FeatureState::kMeasured;
    own.push_back(observation);
  }
  if (own.size() < 2) {  // more likely something else's
    for (FeatureState& state : states) {
      if (state == FeatureState::kMeasured) state = FeatureState::kFailed;
    }
    return;
  }
  if (own.size() >= 3) {
    papers_.push_back({world_from_square.rotation * Eigen::Vector3d::UnitZ(), look.paper});
  }
  found_.insert(found_.end(), own.begin(), own.end());
}

void SquareLandmarks::Search(const Frame& frame, const Rigid3& pose, const Matrix6d& covariance,
                             const CameraMotion& motion, bool with_known,
                             const FilterState& filter) {
  ForgetSearch();
  papers_.clear();
  std::array<FeatureState, 4> states;
  for (std::size_t k = 0; with_known && k < known_.squares.size(); ++k) {
    const KnownSquare& square = known_.squares[k];
    if (IsCarried(square.family, square.id)) continue;
    SearchOne(frame, pose, covariance, motion, filter.readout_s(),
              {square.world_from_square, SquareCorners(square.family, square.side_m),
               known_shares_[k], 0},
              states);
    std::ranges::copy(states, known_states_.begin() + static_cast<std::ptrdiff_t>(4 * k));
  }
  for (const auto& [key, mapped] : mapped_) {
    const auto place = filter.ClonePose(mapped.marker);
    if (!place) continue;
    SearchOne(frame, pose, covariance, motion, filter.readout_s(),
              {*place, SquareCorners(key.first, mapped.side_m), mapped_share_, mapped.marker},
              states);
  }
  light_.Add(papers_);
}

std::optional<Rigid3> SquareLandmarks::PoseByFound(const CameraModel& camera, const Rigid3& start,
                                                   const Matrix6d& covariance,
                                                   const FilterState& filter) const {
  if (found_.size() < 4) return std::nullopt;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (const Observation& each : found_) {
    Eigen::Vector3d point = *each.known_point;
    if (each.marker != 0) point = filter.ClonePose(each.marker).value_or(Rigid3()) * point;
    points.push_back(point);
    pixels.push_back(each.pixel);
  }
  PoseFitOptions options;
  options.sigma_px = kSigma_px;
  options.prior_position_sigma_m =
      std::sqrt(std::max(1e-12, covariance.topLeftCorner<3, 3>().trace() / 3.0));
  options.prior_orientation_sigma_rad =
      std::sqrt(std::max(1e-12, covariance.bottomRightCorner<3, 3>().trace() / 3.0));
  const auto fit = FitPose(camera, points, pixels, start, options);
  if (!fit.ok()) return std::nullopt;
  return fit->world_from_camera;
}

void SquareLandmarks::Record(Timestamp time_ns, const Rigid3& world_from_camera) {
  poses_[time_ns] = world_from_camera;
  if (poses_.size() > kMostPoses) poses_.erase(poses_.begin());
}

void SquareLandmarks::RecordStart(const std::vector<std::pair<Timestamp, Rigid3>>& poses) {
  poses_.clear();
  for (const auto& [time, pose] : poses) poses_[time] = pose;
}

std::vector<MarkerView> SquareLandmarks::PosedViews(const std::vector<MarkerView>& views) const {
  std::vector<MarkerView> posed;
  posed.reserve(views.size());
  for (const MarkerView& view : views) {
    const auto pose = poses_.find(view.time_ns);
    if (pose == poses_.end()) continue;
    posed.push_back(view);
    posed.back().world_from_camera = pose->second;
  }
  return posed;
}

std::optional<Rigid3> SquareLandmarks::PoseOf(const std::string& family, int id,
                                              const FilterState& filter) const {
  const auto at = mapped_.find({family, id});
  if (at == mapped_.end()) return std::nullopt;
  return filter.ClonePose(at->second.marker);
}

}  // namespace saccade
