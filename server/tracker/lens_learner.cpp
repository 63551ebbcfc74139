#include "server/tracker/lens_learner.hpp"

#include <absl/strings/str_format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "server/features/target_detector.hpp"
#include "server/pipeline/stop_watch.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

/// Root mean square, over the picture, of what one direction is moved by [px].
double ShiftPx(const CameraModel& from, const CameraModel& to) {
  constexpr int kSteps = 8;
  double sum = 0.0;
  int count = 0;
  for (int y = 0; y <= kSteps; ++y) {
    for (int x = 0; x <= kSteps; ++x) {
      const Eigen::Vector2d pixel((from.width() - 1) * x / static_cast<double>(kSteps),
                                  (from.height() - 1) * y / static_cast<double>(kSteps));
      const auto ray = from.Unproject(pixel);
      const auto seen = ray ? to.Project(*ray) : std::nullopt;
      if (!seen) continue;
      sum += (*seen - pixel).squaredNorm();
      ++count;
    }
  }
  return count > 0 ? std::sqrt(sum / count) : 1e9;
}

}  // namespace

LensLearner::LensLearner(const TrackerOptions& options, std::shared_ptr<const CameraModel> assumed)
    : options_(options), lens_(std::move(assumed)) {
  assumed_ = known_ = LensVectorOf(lens_->intrinsics());
  const double centre_px = learning_.centre_share * lens_->width();
  LensVector sigma;
  sigma << learning_.focal_share, centre_px, centre_px, learning_.k1_sigma, learning_.k2_sigma,
      learning_.tangential_sigma, learning_.tangential_sigma, learning_.k3_sigma;
  known_covariance_ = sigma.cwiseAbs2().asDiagonal();
  assumed_information_ = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
}

/// What lenses are in general, and what was found so far.
void LensLearner::SetPrior(LensBundle& bundle) const {
  LensMatrix information = assumed_information_;
  LensVector pull = assumed_information_ * assumed_;
  if (changes_ > 0) {
    const LensMatrix found = known_covariance_.inverse();
    information += found;
    pull += found * known_;
  }
  bundle.lens = known_;
  bundle.prior_covariance = information.inverse();
  bundle.prior = bundle.prior_covariance * pull;
}

void LensLearner::Stop() {
  if (!running_.valid()) return;
  stop_ = true;
  running_.get();
  stop_ = false;
}

void LensLearner::Reset() {
  Stop();
  began_ns_.reset();
  board_ = LensBundle();
  studied_ = 0;
}

void LensLearner::Wait() const {
  if (running_.valid()) running_.wait();
}

LensState LensLearner::state() const {
  const CameraIntrinsics& lens = lens_->intrinsics();
  const double told = changes_ > 0 ? learning_.shared : 1.0;
  const LensVector sigma = told * known_covariance_.diagonal().cwiseSqrt();
  LensState state;
  state.focal_px = lens.fx;
  state.focal_sigma_px = lens.fx * sigma[0];
  state.centre_px = {lens.cx, lens.cy};
  state.centre_sigma_px = sigma.segment<2>(1);
  state.k1 = known_[3];
  state.k1_sigma = sigma[3];
  state.k2 = known_[4];
  state.k2_sigma = sigma[4];
  state.changes = changes_;
  state.learnt = sigma[0] < learning_.learnt && last_shift_px_ < learning_.learnt_shift_px;
  return state;
}

void LensLearner::Start(std::int64_t frame, Timestamp time_ns, const Map& map,
                        const FilterState& filter) {
  if (!began_ns_) {
    began_ns_ = time_ns;
    next_s_ = learning_.first_s;
  }
  if (running_.valid() || Seconds(time_ns - *began_ns_) < next_s_ || state().learnt) return;
  auto job = map.MakeLensJob(*lens_, filter);
  if (!job) return;
  next_s_ = learning_.later * Seconds(time_ns - *began_ns_);
  job_ = *std::move(job);
  SetPrior(job_.problem);
  started_ = frame;
  running_ = std::async(std::launch::async,
                        [this, problem = job_.problem, like = lens_->intrinsics()]() mutable {
                          if (options_.adjust_live) {
                            setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
                          }
                          return AdjustLens(std::move(problem), like, stop_);
                        });
}

std::optional<KeyframeGraph::LensJob> LensLearner::Finish(std::int64_t frame) {
  waited_ms_ = 0.0;
  if (!running_.valid() || frame < started_ + options_.adjust_delay) return std::nullopt;
  if (options_.adjust_live &&
      running_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    return std::nullopt;
  }
  StopWatch watch;
  auto solution = running_.get();
  waited_ms_ = watch.Lap_ms();
  if (!solution) {
    Log("lens: the keyframes do not tell it yet");
    return std::nullopt;
  }
  if (!Take(*solution, job_.keyframes.size())) return std::nullopt;
  job_.problem = std::move(solution->problem);
  return std::move(job_);
}

bool LensLearner::Take(const LensBundleSolution& solution, std::size_t views) {
  const LensVector sigma = learning_.shared * solution.covariance.diagonal().cwiseSqrt();
  const auto learnt =
      std::make_shared<const CameraModel>(LensOf(solution.problem.lens, lens_->intrinsics()));
  const double shift_px = ShiftPx(*lens_, *learnt);
  const CameraIntrinsics& lens = learnt->intrinsics();
  const bool taken = sigma[0] < learning_.enough;
  Log(absl::StrFormat(
      "lens%s: f %.1f +- %.1f px, centre (%.1f, %.1f) +- (%.1f, %.1f), k1 %.3f +- %.3f, k2 %.3f, "
      "k3 %.3f; rms %.2f -> %.2f px of %d in %d views; moves pixels by %.2f",
      taken ? "" : " (not taken yet)", lens.fx, lens.fx * sigma[0], lens.cx, lens.cy, sigma[1],
      sigma[2], lens.distortion[0], sigma[3], lens.distortion[1], lens.distortion[4],
      solution.rms_px_before, solution.rms_px_after, solution.observations, views, shift_px));
  if (!taken) return false;
  known_covariance_ = solution.covariance;
  last_shift_px_ = shift_px;
  known_ = solution.problem.lens;
  if (shift_px < learning_.least_shift_px) return false;
  lens_ = learnt;
  ++changes_;
  return true;
}

bool LensLearner::Study(const ChessboardTarget& target, const ImagePyramid& picture) {
  constexpr int kMostPictures = 60, kEvery = 6;
  constexpr std::size_t kFewestViews = 24;  // those of a moment err alike
  constexpr double kSigma_px = 0.5;         // of a corner, bent boards and blur included
  constexpr double kWellKnown = 0.01;       // sigma of the focal length, relative
  const double focal_sigma = std::sqrt(known_covariance_(0, 0));
  if (++studied_ > kMostPictures || focal_sigma < kWellKnown) return false;
  const auto seen = SeeChessboard(picture, *lens_, target);
  if (!seen.ok()) return true;
  const int view = static_cast<int>(board_.world_from_camera.size());
  board_.world_from_camera.push_back(seen->world_from_camera);
  for (std::size_t k = 0; k < seen->pixels.size(); ++k) {
    board_.known.push_back({view, seen->points_in_world[k], seen->pixels[k], kSigma_px});
  }
  const std::size_t views = board_.world_from_camera.size();
  const bool last = studied_ == kMostPictures;
  if (views < kFewestViews || (views % kEvery != 0 && !last)) return true;
  SetPrior(board_);
  const std::atomic<bool> stop = false;
  const auto solution = AdjustLens(board_, lens_->intrinsics(), stop);
  if (!solution) return true;
  if (std::sqrt(solution->covariance(0, 0)) > kWellKnown && !last) return true;
  Take(*solution, views);
  return true;  // what comes now is seen through the new one
}

std::string LearningWords(const LensState& state) {
  if (state.learnt) return "";
  return absl::StrFormat("Learning the lens: focal length %.0f +- %.0f px.", state.focal_px,
                         state.focal_sigma_px);
}

}  // namespace saccade
