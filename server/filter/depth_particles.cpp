#include "server/filter/depth_particles.hpp"

#include <absl/strings/str_cat.h>

#include <cmath>

namespace saccade {
namespace {

constexpr double kMostOutOfView = 0.5;  // of the weight, above which a frame is no attempt

}  // namespace

absl::Status DepthParticleOptions::Validate() const {
  const auto bad = [](const char* field, double value, const char* range) {
    return absl::InvalidArgumentError(
        absl::StrCat("depth particles: ", field, " = ", value, " is not in ", range));
  };
  if (count < 2 || count > 10000) return bad("count", count, "2 .. 10000");
  if (!(min_range_m > 0.0)) return bad("min_range_m", min_range_m, "(0, max_range_m)");
  if (!(max_range_m > min_range_m)) return bad("max_range_m", max_range_m, "(min_range_m, ...)");
  if (!(least_weight >= 0.0 && least_weight < 1.0))
    return bad("least_weight", least_weight, "[0, 1)");
  if (!(known_below > 0.0)) return bad("known_below", known_below, "(0, ...)");
  if (fewest < 1 || fewest >= count) return bad("fewest", fewest, "1 .. count - 1");
  if (max_attempts < 1) return bad("max_attempts", max_attempts, "1 ...");
  if (!(least_speed_m_s >= 0.0)) return bad("least_speed_m_s", least_speed_m_s, "[0, ...)");
  return absl::OkStatus();
}

DepthParticles::DepthParticles(const DepthParticleOptions& options) : options_(options) {
  particles_.resize(static_cast<std::size_t>(options.count));
  const double span = options.max_range_m - options.min_range_m;
  for (int k = 0; k < options.count; ++k) {
    DepthParticle& particle = particles_[static_cast<std::size_t>(k)];
    particle.range_m = options.min_range_m + span * (k + 0.5) / options.count;
    particle.weight = 1.0 / options.count;
  }
}

bool DepthParticles::WorthAttempt(const Eigen::Vector3d& velocity_m_s) const {
  return velocity_m_s.norm() > options_.least_speed_m_s;
}

void DepthParticles::Predict(const CameraModel& camera, const DepthLine& line,
                             const Eigen::Matrix2d& noise) {
  PointFromClone point = line.line;
  Eigen::Matrix<double, 2, 14> h;
  for (DepthParticle& particle : particles_) {
    point.inverse_range = 1.0 / particle.range_m;
    const auto at = PredictFromClone(camera, line.world_from_camera, point);
    particle.pixel.reset();
    if (!at || !camera.InImage(at->pixel)) continue;
    h << at->d_camera, at->d_clone, at->d_point.leftCols<2>();
    particle.pixel = at->pixel;
    particle.covariance = h * line.covariance * h.transpose() + noise;
  }
}

DepthVerdict DepthParticles::Update(std::span<const std::optional<Eigen::Vector2d>> matches) {
  double out_of_view = 0.0;
  for (const DepthParticle& particle : particles_) {
    out_of_view += particle.pixel ? 0.0 : particle.weight;
  }
  if (matches.size() != particles_.size() || out_of_view > kMostOutOfView) {
    return DepthVerdict::kPartial;
  }
  ++attempts_;
  double sum = 0.0;
  for (std::size_t k = 0; k < particles_.size(); ++k) {
    DepthParticle& particle = particles_[k];
    double likelihood = 0.0;
    if (particle.pixel && matches[k]) {
      const Eigen::Vector2d off = *matches[k] - *particle.pixel;
      const double determinant = particle.covariance.determinant();
      if (determinant > 0.0) {
        likelihood =
            std::exp(-0.5 * off.dot(particle.covariance.inverse() * off)) / std::sqrt(determinant);
      }
    }
    particle.weight *= likelihood;
    sum += particle.weight;
  }
  if (!(sum > 0.0)) return DepthVerdict::kGone;
  const double least = options_.least_weight / options_.count;
  std::erase_if(particles_, [&](const DepthParticle& p) { return p.weight < least * sum; });
  double kept = 0.0;
  for (const DepthParticle& particle : particles_) kept += particle.weight;
  for (DepthParticle& particle : particles_) particle.weight /= kept;
  if (static_cast<int>(particles_.size()) <= options_.fewest) return DepthVerdict::kGone;
  if (range_sigma_m() < options_.known_below * range_m()) return DepthVerdict::kKnown;
  return attempts_ >= options_.max_attempts ? DepthVerdict::kGone : DepthVerdict::kPartial;
}

template <typename Function>
std::pair<double, double> DepthParticles::Moments(const Function& of_range) const {
  // Each particle stands for the piece of line around it: a third of the half width, squared.
  const double half = 0.5 * (options_.max_range_m - options_.min_range_m) / options_.count;
  double mean = 0.0, square = 0.0;
  for (const DepthParticle& p : particles_) {
    const double value = of_range(p.range_m);
    const double width = 0.5 * (of_range(p.range_m + half) - of_range(p.range_m - half));
    mean += p.weight * value;
    square += p.weight * (value * value + width * width / 3.0);
  }
  return {mean, std::sqrt(std::max(0.0, square - mean * mean))};
}

double DepthParticles::range_m() const {
  return Moments([](double range) { return range; }).first;
}
double DepthParticles::range_sigma_m() const {
  return Moments([](double range) { return range; }).second;
}
double DepthParticles::inverse_range() const {
  return Moments([](double range) { return 1.0 / range; }).first;
}
double DepthParticles::inverse_range_sigma() const {
  return Moments([](double range) { return 1.0 / range; }).second;
}

}  // namespace saccade
