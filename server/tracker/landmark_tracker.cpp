#include "server/tracker/landmark_tracker.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "server/capture/gap.hpp"
#include "server/markers/corner_look.hpp"
#include "server/pipeline/stop_watch.hpp"
#include "server/tracker/square_pose.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr int kEnoughSquares = 2;
constexpr int kLostAfter = 15;       // frames with fewer
constexpr double kGate_chi2 = 13.8;  // of a corner's innovation, two rows, one in a thousand
constexpr double kFacing = 0.17;     // cosine: a square seen more aslant has no lines to fit
constexpr double kTrackerShortest_px = 14.0;  // side that is searched
constexpr double kTrackerBorder_px = 4.0;
constexpr double kCornerNoise_px = 0.05;  // beyond the fits: print and lens
constexpr int kTrackerHiddenCorners = 3;  // behind known geometry: the square is not searched
constexpr int kTrackerHiddenLines =
    2;  // with no more sides than this something is before the square
constexpr double kFirstPosition_m = 0.02, kFirstAngle_rad = 0.01;  // beyond what the detector says

}  // namespace

absl::StatusOr<std::unique_ptr<LandmarkTracker>> LandmarkTracker::Create(
    const SourceInfo& source, const LandmarkOptions& options) {
  if (const absl::Status valid = options.Validate(); !valid.ok()) return valid;
  if (source.camera == nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat("source ", source.uri, ": has no camera; give camera.yaml"));
  }
  absl::StatusOr<SquareMap> map = LoadSquares(options);
  if (!map.ok()) return map.status();
  if (map->squares.size() < kEnoughSquares) {
    return absl::InvalidArgumentError(
        absl::StrCat(options.file.string(), ": has ", map->squares.size(),
                     " squares; landmarks.mode koller needs two or more"));
  }
  absl::StatusOr<std::unique_ptr<MarkerDetector>> detector = MakeDetector(options, *map);
  if (!detector.ok()) return detector.status();
  return std::unique_ptr<LandmarkTracker>(
      new LandmarkTracker(options, *std::move(map), *std::move(detector)));
}

LandmarkTracker::LandmarkTracker(const LandmarkOptions& options, SquareMap map,
                                 std::unique_ptr<MarkerDetector> detector)
    : options_(options), map_(std::move(map)), watch_(std::move(detector)) {
  for (const KnownSquare& square : map_.squares) {
    points_.push_back(square.CornersInWorld());
    border_shares_.push_back(BorderShare(square.family));
  }
  corners_.resize(4 * points_.size());
}

void LandmarkTracker::Reset() {
  watch_.Drop();
  started_ = false;
  status_ = TrackingStatus::kInitialising;
  poor_in_row_ = 0;
  for (Corner& corner : corners_) corner = Corner();
  ++revision_;
}

absl::StatusOr<FeatureId> LandmarkTracker::SeedFeature(const Frame&, const Rigid3&,
                                                       const Eigen::Vector2d&, double, double) {
  return absl::FailedPreconditionError(
      "feature: landmarks.mode koller has no features but squares; use fused");
}

std::shared_ptr<const MapSnapshot> LandmarkTracker::Track(const Frame& frame) {
  StopWatch total;
  times_ = StageTimes();
  detector_ms_ = 0;
  if (frame.grey.type() != CV_8UC1 || frame.camera == nullptr) return Publish(frame);
  if (started_ && frame.capture_time_ns <= time_ns_ && !IsGap(time_ns_, frame.capture_time_ns)) {
    return Publish(frame);
  }
  attempted_ = matched_ = squares_seen_ = 0;
  searched_px2_ = 0;
  for (Corner& corner : corners_) {
    corner.state = FeatureState::kNotAttempted;
    corner.pixel.reset();
  }
  StopWatch watch;
  const bool begun = TakeDetection(frame);
  if (started_ && !begun) {
    if (IsGap(time_ns_, frame.capture_time_ns)) {
      started_ = false;
      status_ = TrackingStatus::kLost;
    } else {
      filter_.Predict(Seconds(frame.capture_time_ns - time_ns_), KollerNoise());
    }
  }
  time_ns_ = frame.capture_time_ns;
  times_.predict_ms = watch.Lap_ms() - times_.waited_ms;
  if (started_) Measure(frame);
  Judge();
  if (!started_ || squares_seen_ < kEnoughSquares || doubts_.wants_pictures()) {
    watch_.Look(frame.grey, frame.capture_time_ns);
  }
  times_.total_ms = total.Lap_ms() - times_.waited_ms;
  return Publish(frame);
}

bool LandmarkTracker::TakeDetection(const Frame& frame) {
  const auto seen = watch_.Take(/*wait=*/!options_.live);
  times_.waited_ms = watch_.waited_ms();
  if (!seen) return false;
  detector_ms_ = seen->detector_ms;
  doubts_.Add(*frame.camera, seen->sightings, map_);
  if (seen->mirrored) doubts_.AddMirrored(*seen->mirrored);
  for (const std::string& words : doubts_.Take()) Log(absl::StrCat("landmarks: ", words));
  const double age_s = Seconds(frame.capture_time_ns - seen->time_ns);
  if (age_s < 0.0 || IsGap(seen->time_ns, frame.capture_time_ns)) return false;
  // What carries on with one square is not thrown away for another's word.
  if (started_ && poor_in_row_ == 0) return false;
  std::vector<MarkerSighting> standing = seen->sightings;
  std::erase_if(standing, [this](const auto& one) { return IsCarried(one.family, one.id); });
  const auto pose = PoseOfSquares(*frame.camera, standing, map_);
  if (!pose) return false;
  Matrix6d covariance = pose->fit.covariance;
  covariance.diagonal().head<3>().array() += kFirstPosition_m * kFirstPosition_m;
  covariance.diagonal().tail<3>().array() += kFirstAngle_rad * kFirstAngle_rad;
  filter_.Reset(pose->fit.world_from_camera, covariance);
  filter_.Predict(age_s, KollerNoise());
  if (status_ == TrackingStatus::kLost) ++revision_;
  started_ = true;
  return true;
}

bool LandmarkTracker::IsCarried(const std::string& family, int id) const {
  return std::ranges::any_of(
      *carried_, [&](const CarriedSquare& one) { return one.id == id && one.family == family; });
}

void LandmarkTracker::SearchOne(const Frame& frame, std::size_t k) {
  const CameraModel& camera = *frame.camera;
  if (IsCarried(map_.squares[k].family, map_.squares[k].id)) return;
  const Rigid3 square_from_camera =
      map_.squares[k].world_from_square.Inverse() * filter_.WorldFromCamera();
  const Eigen::Vector3d& at = square_from_camera.translation;
  if (at.z() < kFacing * at.norm()) return;  // from behind, or too much aslant
  std::array<bool, 4> hidden{};
  if (sight_) hidden = sight_->Hides(filter_.WorldFromCamera().translation, points_[k]);
  if (std::ranges::count(hidden, true) >= kTrackerHiddenCorners) return;
  SquareGuess guess;
  std::array<PredictedPixel, 4> predicted;
  double longest = 0.0;
  for (int c = 0; c < 4; ++c) {
    const auto pixel = filter_.Predicted(camera, points_[k][c]);
    if (!pixel || !camera.InImage(pixel->at.pixel, kTrackerBorder_px)) return;
    predicted[c] = *pixel;
    guess.corners[c] = pixel->at.pixel;
    guess.covariances[c] = pixel->covariance;
  }
  for (int c = 0; c < 4; ++c) {
    corners_[4 * k + c].pixel = guess.corners[c];
    longest = std::max(longest, (guess.corners[c] - guess.corners[(c + 1) % 4]).norm());
  }
  if (longest < kTrackerShortest_px) return;
  const SquareSearch search = SearchSquareTwice(frame.grey, camera, guess);
  for (const Eigen::Matrix2d& spread : guess.covariances) {
    searched_px2_ += M_PI * 9.0 * std::sqrt(std::max(0.0, spread.determinant()));
  }
  // Something stands before it, which is no failure of the square's.
  if (search.lines <= kTrackerHiddenLines) return;
  const CornerLook look = LookAtCorners(frame.grey, guess, search, border_shares_[k]);
  int agreeing = 0;
  for (int c = 0; c < 4; ++c) {
    if (hidden[c] || !look.seen[c]) continue;
    Corner& corner = corners_[4 * k + c];
    corner.state = FeatureState::kFailed;
    if (!search.corners[c]) continue;
    const Eigen::Matrix2d noise = search.corners[c]->covariance +
                                  kCornerNoise_px * kCornerNoise_px * Eigen::Matrix2d::Identity();
    const Eigen::Vector2d off = search.corners[c]->pixel - guess.corners[c];
    if (off.dot((predicted[c].covariance + noise).inverse() * off) > kGate_chi2) continue;
    corner.pixel = search.corners[c]->pixel;
    corner.noise = noise;
    corner.state = FeatureState::kMeasured;
    ++agreeing;
  }
  if (agreeing >= 3) {
    papers_.push_back(
        {map_.squares[k].world_from_square.rotation * Eigen::Vector3d::UnitZ(), look.paper});
  }
  // Of a square half covered the free corners count; a lone one is more likely something else's.
  if (agreeing == 1) {
    for (int c = 0; c < 4; ++c) {
      if (corners_[4 * k + c].state == FeatureState::kMeasured) {
        corners_[4 * k + c].state = FeatureState::kFailed;
      }
    }
  }
}

void LandmarkTracker::Measure(const Frame& frame) {
  StopWatch watch;
  papers_.clear();
  for (std::size_t k = 0; k < points_.size(); ++k) SearchOne(frame, k);
  light_.Add(papers_);
  times_.search_ms = watch.Lap_ms();
  std::vector<KnownSight> seen;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    int own = 0;
    for (int c = 0; c < 4; ++c) {
      Corner& corner = corners_[4 * k + c];
      attempted_ += corner.state != FeatureState::kNotAttempted ? 1 : 0;
      if (corner.state != FeatureState::kMeasured) continue;
      seen.push_back({points_[k][c], *corner.pixel, corner.noise});
      ++corner.matched;
      ++own;
    }
    squares_seen_ += own >= 3 ? 1 : 0;
  }
  matched_ = static_cast<int>(seen.size());
  if (!filter_.Update(*frame.camera, seen, 2).ok()) {
    matched_ = squares_seen_ = 0;
  }
  times_.update_ms = watch.Lap_ms();
}

void LandmarkTracker::Judge() {
  poor_in_row_ = started_ && squares_seen_ >= kEnoughSquares ? 0 : poor_in_row_ + 1;
  if (poor_in_row_ == 0) {
    status_ = TrackingStatus::kTracking;
  } else if (!started_) {
    if (status_ != TrackingStatus::kLost) status_ = TrackingStatus::kInitialising;
  } else if (poor_in_row_ >= kLostAfter) {
    status_ = TrackingStatus::kLost;
    started_ = false;
  } else {
    status_ = TrackingStatus::kCoasting;
  }
}

std::shared_ptr<const MapSnapshot> LandmarkTracker::Publish(const Frame& frame) const {
  auto snapshot = std::make_shared<MapSnapshot>();
  snapshot->frame_id = frame.id;
  snapshot->capture_time_ns = frame.capture_time_ns;
  snapshot->status = status_;
  snapshot->metric = true;
  snapshot->quality = status_ == TrackingStatus::kTracking   ? TrackingQuality::kGood
                      : status_ == TrackingStatus::kCoasting ? TrackingQuality::kPoor
                      : status_ == TrackingStatus::kLost     ? TrackingQuality::kBad
                                                             : TrackingQuality::kUnknown;
  if (status_ != TrackingStatus::kTracking) {
    snapshot->advice = "look at two of the squares or more";
  }
  const CameraMotion camera = ToCameraMotion(filter_.motion());
  snapshot->world_from_camera = camera.world_from_camera;
  snapshot->pose_covariance = filter_.PoseCovariance();
  snapshot->velocity_in_world = camera.velocity_m_s;
  snapshot->angular_velocity_in_camera = camera.angular_velocity_rad_s;
  snapshot->attempted = attempted_;
  snapshot->matched = matched_;
  snapshot->searched_px2 = searched_px2_;
  snapshot->map_revision = revision_;
  snapshot->stage_ms = times_;
  const Rigid3& camera_from_world = filter_.motion().camera_from_world;
  const Matrix6d pose = snapshot->pose_covariance;
  for (std::size_t k = 0; k < corners_.size(); ++k) {
    FeatureSnapshot& feature = snapshot->features.emplace_back();
    feature.id = k + 1;
    feature.state = corners_[k].state;
    feature.pixel = corners_[k].pixel;
    feature.matched_count = corners_[k].matched;
    feature.point_in_world = points_[k / 4][k % 4];
    feature.depth_known = true;
    Eigen::Matrix<double, 3, 6> by_pose;
    by_pose.leftCols<3>() = -camera_from_world.RotationMatrix();
    by_pose.rightCols<3>() = Skew(camera_from_world * feature.point_in_world);
    feature.covariance_in_camera = by_pose * pose * by_pose.transpose();
  }
  return snapshot;
}

}  // namespace saccade
