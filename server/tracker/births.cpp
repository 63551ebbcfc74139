#include "server/tracker/births.hpp"

#include <algorithm>
#include <cmath>

#include "server/filter/new_clone.hpp"
#include "server/tracker/depth_knowledge.hpp"
#include "server/tracker/line_time.hpp"

namespace saccade {
namespace {

constexpr int kDepthFeatures = 8;          // needed to guess the depth of a new one
constexpr int kFramesBetweenGrowth = 5;    // unless the view is nearly empty
constexpr double kBetweenGrowth_s = 0.16;  // where frames take longer

}  // namespace

void Births::Reset() { frames_since_growth_ = 1000; }

std::optional<Births::DepthGuess> Births::GuessDepth(const FilterState& filter,
                                                     const FrameMatches& matches) {
  std::vector<double> inverse;
  const Rigid3 camera_from_world = filter.camera().world_from_camera.Inverse();
  for (const LandmarkMatch& match : matches.in_view) {
    double range = 0.0;
    if (std::holds_alternative<Eigen::Vector3d>(match.point)) {
      range = (camera_from_world * std::get<Eigen::Vector3d>(match.point)).norm();
    } else if (filter.Has(match.id)) {
      const FeatureMarginal marginal = filter.Marginal(match.id);
      if (!KnownTo(marginal, DepthKnowledge::kToGuessOthers)) continue;
      range = (camera_from_world * marginal.point_in_world).norm();
    }
    if (range > 0.0) inverse.push_back(1.0 / range);
  }
  const bool enough = static_cast<int>(inverse.size()) >= kDepthFeatures ||
                      (inverse.size() >= 3 &&
                       std::holds_alternative<Eigen::Vector3d>(matches.in_view.front().point));
  if (!enough) return std::nullopt;
  std::nth_element(inverse.begin(), inverse.begin() + inverse.size() / 2, inverse.end());
  const double median = inverse[inverse.size() / 2];
  return DepthGuess{median, 0.5 * median};
}

int Births::Missing(const FrameMatches& matches) const {
  int usable = 0;
  for (const LandmarkMatch& match : matches.in_view) {
    usable += match.searched || match.waits || match.weight > 0 ? 1 : 0;
  }
  return options_.features_in_view - usable;
}

bool Births::Wants(const FrameMatches& matches) const {
  const int missing = Missing(matches);
  if (missing <= 0) return false;
  if (missing > options_.features_in_view / 2) return true;
  const bool due = frames_since_growth_ >= kFramesBetweenGrowth ||
                   Seconds(now_ns_ - grown_ns_) >= kBetweenGrowth_s;
  return missing >= options_.features_in_view / 8 && due;
}

std::optional<FeatureId> Births::Plant(const Frame& frame, const Eigen::Vector2d& pixel,
                                       const DepthGuess& depth, CloneId clone,
                                       const CameraMotion& motion, const FrameMatcher& matcher,
                                       FrontEnd& front_end, FilterState& filter, LandmarkMap& map) {
  auto patch = front_end.Cut(pixel);
  Eigen::Matrix<double, 3, 2> d_bearing;
  const auto bearing = frame.camera->Unproject(pixel, &d_bearing);
  if (!patch || !bearing) return std::nullopt;
  const double sigma = matcher.PixelSigma(*frame.camera, pixel);
  FeatureBirth birth;
  birth.id = map.NextId();
  // As seen in mid-exposure: the row's own pose is `late` from the clone's.
  const double late = filter.readout_s() * LateInReadouts(*frame.camera, pixel);
  const Eigen::Vector3d gone =
      filter.camera().world_from_camera.rotation.conjugate() * motion.velocity_m_s * late;
  birth.bearing =
      (ExpQuaternion(motion.angular_velocity_rad_s * late) * *bearing + depth.inverse_range * gone)
          .normalized();
  birth.bearing_covariance = sigma * sigma * d_bearing * d_bearing.transpose();
  birth.inverse_range = depth.inverse_range;
  birth.inverse_range_sigma = depth.inverse_range_sigma;
  if (!filter.AddFeature(clone, birth).ok()) return std::nullopt;
  Landmark landmark;
  landmark.id = birth.id;
  landmark.patch = *std::move(patch);
  map.Add(std::move(landmark));
  return birth.id;
}

int Births::Grow(const Frame& frame, const FrameMatches& matches, const DepthGuess& depth,
                 bool everywhere, const FrameMatcher& matcher, FrontEnd& front_end,
                 FilterState& filter, LandmarkMap& map, std::mt19937_64& random) {
  ++frames_since_growth_;
  now_ns_ = frame.capture_time_ns;
  if (!everywhere && !Wants(matches)) return 0;
  std::vector<Eigen::Vector2d> occupied;
  for (const LandmarkMatch& match : matches.in_view) occupied.push_back(match.pixel);
  const int wanted = everywhere ? options_.features_in_view : options_.births_per_clone;
  std::vector<Eigen::Vector2d> corners = front_end.Corners(occupied, 3 * wanted);
  if (corners.empty()) return 0;
  frames_since_growth_ = 0;
  grown_ns_ = now_ns_;
  // The best third for sure, the rest by chance among what is left: strong corners come in heaps.
  const int fixed = std::min<int>(wanted / 3, static_cast<int>(corners.size()));
  for (std::size_t k = corners.size(); k > static_cast<std::size_t>(fixed) + 1; --k) {
    std::swap(corners[k - 1], corners[fixed + random() % (k - fixed)]);
  }
  const NewClone clone(filter);
  int planted = 0;
  for (const Eigen::Vector2d& corner : corners) {
    if (planted >= wanted) break;
    const auto born =
        Plant(frame, corner, depth, clone.id(), matches.motion, matcher, front_end, filter, map);
    planted += born ? 1 : 0;
  }
  return planted;
}

}  // namespace saccade
