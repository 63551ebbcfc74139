#include "server/eval/points_front_end.hpp"

#include <algorithm>
#include <cstring>
#include <numbers>

#include "server/features/pose_fit.hpp"

namespace saccade {
namespace {

constexpr double kGateSquared = 9.0;      // of the search ellipse, 3 sigma
constexpr double kBorder_px = 16.0;       // corners keep from the picture's border
constexpr double kDistance_px = 12.0;     // and from what is there already
constexpr double kVerifiedStart_s = 1.0;  // before, all matches are true: a start is checked

PatchTemplate LookOf(int point) {
  PatchTemplate look;
  std::memcpy(look.pixels.data(), &point, sizeof point);
  return look;
}

}  // namespace

PointsFrontEnd::PointsFrontEnd(const PointsWorld& world, const PointsOptions& options)
    : world_(world), options_(options), random_(options.seed ^ 0xfa15eULL) {}

int PointsFrontEnd::PointOf(const PatchTemplate& look) {
  int point = 0;
  std::memcpy(&point, look.pixels.data(), sizeof point);
  return point;
}

absl::Status PointsFrontEnd::Check(const SourceInfo&) const { return absl::OkStatus(); }

bool PointsFrontEnd::Take(const Frame& frame) {
  frame_ = next_;
  time_s_ = Seconds(frame.capture_time_ns);
  return frame_ != nullptr;
}

const PointObservation* PointsFrontEnd::Seen(int point) const {
  if (frame_ == nullptr) return nullptr;
  const auto at = std::lower_bound(
      frame_->observations.begin(), frame_->observations.end(), point,
      [](const PointObservation& each, int number) { return each.point < number; });
  return at != frame_->observations.end() && at->point == point ? &*at : nullptr;
}

Eigen::Vector2d PointsFrontEnd::Stray(const LandmarkQuery& query) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const Eigen::Matrix2d ellipse = Eigen::LLT<Eigen::Matrix2d>(query.spread).matrixL();
  Eigen::Vector2d inside;
  do {
    inside = {uniform(random_), uniform(random_)};
  } while (inside.squaredNorm() > 1.0);
  return query.centre + std::sqrt(kGateSquared) * ellipse * inside;
}

LandmarkSighting PointsFrontEnd::Find(const LandmarkQuery& query) {
  LandmarkSighting sighting;
  sighting.searched_px2 =
      std::numbers::pi * kGateSquared * std::sqrt(std::max(0.0, query.spread.determinant()));
  sighting.kind = LandmarkSighting::Kind::kMissed;
  const PointObservation* seen = Seen(PointOf(query.landmark->patch));
  if (seen == nullptr) return sighting;
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  const bool stray = options_.false_matches > 0.0 && time_s_ >= kVerifiedStart_s &&
                     chance(random_) < options_.false_matches;
  const Eigen::Vector2d pixel = stray ? Stray(query) : seen->pixel;
  const Eigen::Vector2d off = pixel - query.centre;
  if (off.dot(query.spread.ldlt().solve(off)) >= kGateSquared) return sighting;
  sighting.kind = LandmarkSighting::Kind::kFound;
  sighting.pixel = pixel;
  return sighting;
}

std::vector<Eigen::Vector2d> PointsFrontEnd::Corners(std::span<const Eigen::Vector2d> occupied,
                                                     int most) {
  std::vector<Eigen::Vector2d> corners;
  if (frame_ == nullptr) return corners;
  const auto free = [](std::span<const Eigen::Vector2d> pixels, const Eigen::Vector2d& pixel) {
    return std::none_of(pixels.begin(), pixels.end(), [&](const Eigen::Vector2d& each) {
      return (each - pixel).norm() < kDistance_px;
    });
  };
  for (const PointObservation& seen : frame_->observations) {
    if (static_cast<int>(corners.size()) == most) break;
    if (!world_.camera.InImage(seen.pixel, kBorder_px)) continue;
    if (free(occupied, seen.pixel) && free(corners, seen.pixel)) corners.push_back(seen.pixel);
  }
  return corners;
}

std::optional<PatchTemplate> PointsFrontEnd::Cut(const Eigen::Vector2d& pixel) {
  if (frame_ == nullptr) return std::nullopt;
  for (const PointObservation& seen : frame_->observations) {
    if (seen.pixel == pixel) return LookOf(seen.point);
  }
  return std::nullopt;
}

absl::StatusOr<TargetObservation> PointsFrontEnd::FindChessboard(const ChessboardTarget&,
                                                                 const std::optional<Rigid3>&) {
  return absl::NotFoundError("points: there is no chessboard at feature level");
}

absl::StatusOr<PatchesSeen> PointsFrontEnd::FindPatches(const PatchTarget& target,
                                                        const StartPose& start) {
  PatchesSeen seen;
  TargetObservation& found = seen.observation;
  for (const KnownPatch& point : target.points) {
    const PointObservation* at = Seen(point.id);
    if (at == nullptr) continue;
    found.ids.push_back(point.id);
    found.pixels.push_back(at->pixel);
    found.points_in_world.push_back(point.point_in_world);
  }
  // As DetectPatches() does with what it has found.
  PoseFitOptions options;
  options.sigma_px = options_.noise_px;
  options.prior_position_sigma_m = start.position_sigma_m;
  options.prior_orientation_sigma_rad = start.orientation_sigma_rad;
  const auto fit =
      FitPose(world_.camera, found.points_in_world, found.pixels, start.world_from_camera, options);
  if (!fit.ok()) return fit.status();
  found.world_from_camera = fit->world_from_camera;
  found.pose_covariance = fit->covariance;
  found.rms_px = fit->rms_px;
  for (const KnownPatch& point : target.points) seen.looks.push_back(LookOf(point.id));
  return seen;
}

absl::StatusOr<PatchTemplate> PointsFrontEnd::CutClicked(const Frame&, const Eigen::Vector2d&) {
  return absl::NotFoundError("points: nothing is clicked at feature level");
}

absl::StatusOr<Eigen::Vector2d> PointsFrontEnd::FindClicked(const PatchTemplate&,
                                                            const LandmarkQuery&) {
  return absl::NotFoundError("points: nothing is clicked at feature level");
}

}  // namespace saccade
