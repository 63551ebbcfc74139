#include "server/tracker/start_finder.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "server/pipeline/stop_watch.hpp"
#include "server/tracker/line_time.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMostShots = 60;   // kept; then every second one goes
constexpr std::size_t kMostSolved = 12;  // keyframes of one problem, besides those of births
constexpr int kFewestShared = 20;        // points that a keyframe shares with the newest
constexpr double kParallaxSigmas = 1.5;  // root mean square that a turn leaves, before it is tried
constexpr double kLeastNoise = 0.5;      // of R: patches seen from elsewhere are biased alike
// Residuals above that are no noise of patches but what the model lacks (a shutter in a fast turn),
// and that does not average out: a start with 0.55 counts its sigmas in full.
constexpr double kUnmodelled = 10.0;
constexpr double kMargin = 4.5;         // half of chi squared: three sigmas
constexpr int kFewestKnown = 12;        // points whose range is known
constexpr double kLeastAgreeing = 0.8;  // of the sightings

}  // namespace

void StartFinder::Stop() {
  if (!running_.valid()) return;
  stop_ = true;
  running_.get();
  stop_ = false;
}

void StartFinder::Reset() {
  Stop();
  shots_.clear();
  newest_feature_ = 0;
}

void StartFinder::Wait() const {
  if (running_.valid()) running_.wait();
}

std::optional<StartFinder::Seen> StartFinder::See(const CameraModel& camera, FeatureId id,
                                                  const Eigen::Vector2d& pixel, double sigma_px) {
  Seen seen;
  seen.id = id;
  seen.pixel = pixel;
  const auto ray = camera.Unproject(pixel, &seen.d_bearing);
  if (!ray) return std::nullopt;
  seen.late = LateInReadouts(camera, pixel);
  seen.ray.ray = *ray;
  seen.ray.sigma_rad = sigma_px / (0.5 * (camera.intrinsics().fx + camera.intrinsics().fy));
  return seen;
}

void StartFinder::Record(Timestamp time_ns, const CameraModel& camera, const FilterState& filter,
                         const LandmarkMap& map, const FrameMatches& matches) {
  Shot shot;
  shot.time_ns = time_ns;
  shot.world_from_camera = filter.camera().world_from_camera;
  for (const LandmarkMatch& match : matches.in_view) {
    if (!match.accepted() || !filter.Has(match.id)) continue;
    auto seen = See(camera, match.id, match.pixel, std::sqrt(match.noise(0, 0)));
    if (!seen) continue;
    seen->ray.d_readout = -seen->d_bearing * match.d_readout;
    shot.sightings.push_back(*seen);
  }
  FeatureId newest = newest_feature_;
  for (const FeatureId id : filter.FeatureIds()) {
    if (id <= newest_feature_) continue;
    newest = std::max(newest, id);
    const Landmark* landmark = map.Find(id);
    if (landmark == nullptr) continue;
    const auto seen = See(camera, id, landmark->patch.birth_pixel, options_.pixel_sigma_px);
    if (seen) shot.births.push_back(*seen);
  }
  newest_feature_ = newest;
  shots_.push_back(std::move(shot));
  TellRates();
  if (!running_.valid()) Thin();
}

void StartFinder::Thin() {
  if (shots_.size() <= kMostShots) return;
  std::vector<Shot> kept;
  for (std::size_t k = 0; k < shots_.size(); ++k) {
    const bool wanted = k % 2 == 0 || k + 1 == shots_.size() || !shots_[k].births.empty();
    if (wanted) kept.push_back(std::move(shots_[k]));
  }
  // Where features were born in nearly every frame, the oldest go.
  if (kept.size() > 2 * kMostShots) kept.erase(kept.begin(), kept.end() - kMostShots);
  shots_ = std::move(kept);
}

/// Against the oldest shot that shares enough with the newest: what one rotation leaves.
bool StartFinder::ShowsParallax() const {
  const Shot& newest = shots_.back();
  for (const Shot& oldest : shots_) {
    if (&oldest == &newest) return false;
    std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> pairs;
    double sigma_rad = 0.0;
    for (const Seen& seen : newest.sightings) {
      const Seen* before = Find(oldest.sightings, seen.id);
      if (before == nullptr) before = Find(oldest.births, seen.id);
      if (before == nullptr) continue;
      pairs.emplace_back(before->ray.ray, seen.ray.ray);
      sigma_rad += seen.ray.sigma_rad;
    }
    if (std::ssize(pairs) < kFewestShared) continue;
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const auto& [a, b] : pairs) sum += b * a.transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d keep = Eigen::Matrix3d::Identity();
    keep(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    const Eigen::Matrix3d turn = svd.matrixU() * keep * svd.matrixV().transpose();
    double squared = 0.0;
    for (const auto& [a, b] : pairs) squared += (b - turn * a).squaredNorm();
    const double count = static_cast<double>(pairs.size());
    return std::sqrt(squared / (2.0 * count)) > kParallaxSigmas * kLeastNoise * sigma_rad / count;
  }
  return false;
}

std::vector<std::size_t> StartFinder::ChooseShots() const {
  const Shot& newest = shots_.back();
  std::vector<std::size_t> sharing;
  for (std::size_t k = 0; k + 1 < shots_.size(); ++k) {
    int shared = 0;
    for (const Seen& seen : newest.sightings) {
      const bool both = Find(shots_[k].sightings, seen.id) != nullptr ||
                        Find(shots_[k].births, seen.id) != nullptr;
      shared += both ? 1 : 0;
    }
    if (shared >= kFewestShared) sharing.push_back(k);
  }
  std::vector<std::size_t> chosen;
  const std::size_t step =
      std::max<std::size_t>(1, (sharing.size() + kMostSolved - 1) / kMostSolved);
  for (std::size_t k = 0; k < sharing.size(); ++k) {
    if (k % step == 0 || !shots_[sharing[k]].births.empty()) chosen.push_back(sharing[k]);
  }
  chosen.push_back(shots_.size() - 1);
  return chosen;
}

StartFinder::Job StartFinder::MakeJob(const FilterState& filter) const {
  Job job;
  job.shots = ChooseShots();
  job.problem.readout_s = filter.options().readout_s;
  job.problem.readout_sigma_s = filter.options().readout_sigma_s;
  std::map<FeatureId, int> seen_by;
  for (const std::size_t k : job.shots) {
    for (const Seen& seen : shots_[k].sightings) ++seen_by[seen.id];
  }
  std::map<FeatureId, int> index;
  for (std::size_t at = 0; at < job.shots.size(); ++at) {
    const Shot& shot = shots_[job.shots[at]];
    job.problem.world_from_camera.push_back(shot.world_from_camera);
    for (const Seen& birth : shot.births) {
      if (seen_by[birth.id] < 2 || !filter.Has(birth.id)) continue;
      index[birth.id] = static_cast<int>(job.points.size());
      job.points.push_back(birth.id);
      StartPoint point;
      point.anchor = static_cast<int>(at);
      point.seen = birth.ray;
      const PointFromClone now = filter.Point(birth.id);
      point.bearing = point.seen.At(job.problem.readout_s);
      point.inverse_range = std::max(1e-3, now.inverse_range);
      job.problem.points.push_back(point);
    }
    for (const Seen& seen : shot.sightings) {
      const auto point = index.find(seen.id);
      if (point == index.end()) continue;
      job.problem.sightings.push_back({static_cast<int>(at), point->second, seen.ray});
    }
  }
  return job;
}

void StartFinder::Start(std::int64_t frame, const FilterState& filter) {
  if (running_.valid() || shots_.size() < 3 || !ShowsParallax()) return;
  job_ = MakeJob(filter);
  started_ = frame;
  running_ = std::async(std::launch::async, [this, problem = job_.problem] {
    if (options_.adjust_live) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
    return SolveStart(problem, stop_);
  });
}

bool StartFinder::Holds(const StartEvidence& evidence) const {
  const double noise = kLeastNoise + kUnmodelled * std::max(0.0, evidence.noise - kLeastNoise);
  return noise * evidence.scale_sigma < options_.start_scale_sigma && evidence.margin > kMargin &&
         evidence.known_points >= kFewestKnown && evidence.agreeing >= kLeastAgreeing;
}

std::optional<FoundStart> StartFinder::Finish(std::int64_t frame) {
  waited_ms_ = 0.0;
  if (!running_.valid() || frame < started_ + options_.adjust_delay) return std::nullopt;
  if (options_.adjust_live &&
      running_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    return std::nullopt;
  }
  StopWatch watch;
  auto solution = running_.get();
  waited_ms_ = watch.Lap_ms();
  if (!solution || !Holds(solution->evidence)) return std::nullopt;
  ScaleTo(options_.initial_depth_m, *solution);
  return Read(*solution);
}

}  // namespace saccade
