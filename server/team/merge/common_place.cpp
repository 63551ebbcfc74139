#include "server/team/merge/common_place.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "server/features/pose_fit.hpp"

namespace saccade {
namespace {

constexpr double kSamePlace_px = 6.0;  // points closer than this are no rivals of each other
constexpr double kBack_px = 6.0;       // at 640 pixels
constexpr int kGuidedHamming = 56;
constexpr double kMostScale = 1.9, kMostAside_rad = 0.6, kBorder_px = 24.0;
constexpr int kColumns = 4, kRows = 3, kFewestInCell = 6;
constexpr double kEmptyCell = 0.12;  // share found
constexpr std::size_t kNearViews = 5;
constexpr std::size_t kFewestScales = 8;
constexpr double kScaleSpread = 0.2;  // median deviation of log scale of single points
constexpr double kLeastAgreement = 0.2;
constexpr int kFewestBack = 15;  // expected the other way before its share says anything

double Median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <int N>
double LeastSpread(const std::vector<Eigen::Matrix<double, N, 1>>& points) {
  Eigen::Matrix<double, N, 1> mean = Eigen::Matrix<double, N, 1>::Zero();
  for (const auto& point : points) mean += point / static_cast<double>(points.size());
  Eigen::Matrix<double, N, N> scatter = Eigen::Matrix<double, N, N>::Zero();
  for (const auto& point : points) scatter += (point - mean) * (point - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> eigen(scatter);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[0]) / static_cast<double>(points.size()));
}

/// Points of known range of one view that look like one point of the other and like no second one.
std::vector<CommonPoint> MatchByLook(const std::shared_ptr<const PlaceView>& mapped,
                                     const PlaceView& query, const CommonPlaceOptions& options) {
  const int beyond = static_cast<int>(options.max_hamming / options.ratio) + 1;
  std::map<std::size_t, std::pair<int, CommonPoint>> by_query;
  std::vector<int> distances(query.described.size());
  for (std::size_t m = 0; m < mapped->described.size(); ++m) {
    if (!mapped->Knows(m)) continue;
    for (std::size_t q = 0; q < distances.size(); ++q) {
      distances[q] = PointDistance(mapped->described[m], query.described[q], beyond);
    }
    const auto best = std::min_element(distances.begin(), distances.end());
    if (best == distances.end() || *best > options.max_hamming) continue;
    const auto at = static_cast<std::size_t>(best - distances.begin());
    int second = 256;
    for (std::size_t q = 0; q < distances.size(); ++q) {
      if (distances[q] < second &&
          (query.described[q].pixel - query.described[at].pixel).norm() > kSamePlace_px) {
        second = distances[q];
      }
    }
    if (*best > options.ratio * second) continue;
    const auto [entry, fresh] = by_query.try_emplace(at, *best, CommonPoint{mapped, m, at});
    if (!fresh && *best < entry->second.first) entry->second = {*best, {mapped, m, at}};
  }
  std::vector<CommonPoint> matches;
  for (const auto& [at, match] : by_query) matches.push_back(match.second);
  return matches;
}

absl::StatusOr<RansacPose> Solve(const PlaceView& query, const std::vector<CommonPoint>& matches,
                                 int least, const CommonPlaceOptions& options) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (const CommonPoint& match : matches) {
    points.push_back(match.mapped->points_in_world[match.mapped_point]);
    pixels.push_back(query.described[match.query_point].pixel);
  }
  return FitPoseRansac(*query.camera, points, pixels,
                       {.inlier_px = options.inlier_px * query.camera->width() / 640.0,
                        .min_inliers = least,
                        .seed = options.seed});
}

/// Where a point of `seen_by` should be in a picture; nothing where it could not be recognised.
std::optional<Eigen::Vector2d> ShouldBeAt(const PlaceView& seen_by, std::size_t point,
                                          const Rigid3& world_from_camera,
                                          const CameraModel& camera) {
  const Eigen::Vector3d& there = seen_by.points_in_world[point];
  const Eigen::Vector3d from_here = there - world_from_camera.translation;
  const Eigen::Vector3d from_view = there - seen_by.world_from_camera().translation;
  const double here = from_here.norm(), before = from_view.norm();
  if (here > kMostScale * before || before > kMostScale * here ||
      from_here.dot(from_view) < std::cos(kMostAside_rad) * here * before) {
    return std::nullopt;
  }
  const auto pixel = camera.Project(world_from_camera.Inverse() * there);
  if (!pixel || !camera.InImage(*pixel, kBorder_px)) return std::nullopt;
  return pixel;
}

/// The point of `query` near `pixel` that looks like it, or nothing.
std::optional<std::size_t> LooksLike(const DescribedPoint& look, const Eigen::Vector2d& pixel,
                                     const PlaceView& query, double radius_px) {
  const double radius = radius_px * query.camera->width() / 640.0;
  std::optional<std::size_t> best;
  int least = kGuidedHamming + 1;
  for (std::size_t q = 0; q < query.described.size(); ++q) {
    if ((query.described[q].pixel - pixel).squaredNorm() > radius * radius) continue;
    const int distance = PointDistance(look, query.described[q], least);
    if (distance < least) {
      least = distance;
      best = q;
    }
  }
  return best;
}

struct Cells {
  std::array<std::pair<int, int>, static_cast<std::size_t>(kColumns) * kRows> counts{};

  void Add(const Eigen::Vector2d& pixel, const CameraModel& camera, bool found) {
    const int column = static_cast<int>(pixel.x() * kColumns / camera.width());
    const int row = static_cast<int>(pixel.y() * kRows / camera.height());
    auto& [expected, seen] =
        counts[std::clamp(row, 0, kRows - 1) * kColumns + std::clamp(column, 0, kColumns - 1)];
    ++expected;
    seen += found ? 1 : 0;
  }
  void Judge(Presence& presence) const {
    for (const auto& [expected, found] : counts) {
      if (expected < kFewestInCell) continue;
      ++presence.cells;
      presence.empty_cells += found < kEmptyCell * expected ? 1 : 0;
    }
  }
};

/// `seen_by`'s points in the picture of `query`.
void Look(const std::shared_ptr<const PlaceView>& seen_by, const PlaceView& query,
          const Rigid3& world_from_camera, double radius_px, Presence& presence, Cells& cells,
          std::vector<CommonPoint>* found) {
  for (std::size_t m = 0; m < seen_by->described.size(); ++m) {
    if (!seen_by->Knows(m)) continue;
    const auto pixel = ShouldBeAt(*seen_by, m, world_from_camera, *query.camera);
    if (!pixel) continue;
    const auto like = LooksLike(seen_by->described[m], *pixel, query, radius_px);
    ++presence.expected;
    presence.found += like ? 1 : 0;
    cells.Add(*pixel, *query.camera, like.has_value());
    if (like && found != nullptr) found->push_back({seen_by, m, *like});
  }
}

/// The query's own points in the pictures of the map's views about there: what the map should have
/// seen if this were the place.
Presence PresentBack(const CommonPlace& place, const PlaceBook& map) {
  Presence presence;
  if (!place.scale) return presence;
  const Similarity3 mapped_from_query = place.MappedFromQueryWorld();
  const Similarity3 query_from_mapped = mapped_from_query.Inverse();
  std::set<FrameId> looked;
  for (const auto& view : map.Near(place.mapped_from_camera, place.distance, kNearViews)) {
    Cells cells;
    Presence one;
    const Rigid3 there = query_from_mapped.Move(view->world_from_camera());
    Look(place.query, *view, there, kBack_px, one, cells, nullptr);
    cells.Judge(one);
    presence.expected += one.expected;
    presence.found += one.found;
    presence.cells += one.cells;
    presence.empty_cells += one.empty_cells;
  }
  return presence;
}

void MeasureScale(CommonPlace& place) {
  std::vector<double> ranges, logs;
  for (const CommonPoint& point : place.points) {
    const double there =
        (point.mapped->points_in_world[point.mapped_point] - place.mapped_from_camera.translation)
            .norm();
    ranges.push_back(there);
    const double here = place.query->told.points[point.query_point].range;
    if (here > 0.0) logs.push_back(std::log(there / here));
  }
  place.distance = Median(ranges);
  if (logs.size() < kFewestScales) return;
  const double middle = Median(logs);
  std::vector<double> off;
  for (const double log : logs) off.push_back(std::abs(log - middle));
  if (Median(off) < kScaleSpread) place.scale = std::exp(middle);
}

bool Proven(const CommonPlace& place, const CommonPlaceOptions& options) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (const CommonPoint& point : place.points) {
    points.push_back(point.mapped->points_in_world[point.mapped_point]);
    pixels.push_back(place.query->described[point.query_point].pixel);
  }
  const auto missing = [&](const Presence& presence) {
    return presence.share() < options.least_share ||
           presence.empty_cells > options.most_empty * presence.cells;
  };
  return LeastSpread<2>(pixels) >= options.spread_px * place.query->camera->width() / 640.0 &&
         LeastSpread<3>(points) >= options.off_plane * place.distance && !missing(place.there) &&
         !(place.back.expected >= kFewestBack && missing(place.back));
}

}  // namespace

Similarity3 CommonPlace::MappedFromQueryWorld() const {
  const double s = scale.value_or(1.0);
  const Eigen::Quaterniond turn =
      (mapped_from_camera.rotation * query->world_from_camera().rotation.conjugate()).normalized();
  return {s, turn,
          mapped_from_camera.translation - s * (turn * query->world_from_camera().translation)};
}

Presence PresentIn(const PlaceView& query, const Rigid3& mapped_from_camera, double distance,
                   const PlaceBook& map, std::vector<CommonPoint>* found, double radius_px) {
  Presence presence;
  Cells cells;
  for (const auto& view : map.Near(mapped_from_camera, distance, kNearViews)) {
    Look(view, query, mapped_from_camera, radius_px, presence, cells, found);
  }
  cells.Judge(presence);
  if (found != nullptr) {
    std::set<std::size_t> taken;
    std::erase_if(*found,
                  [&](const CommonPoint& one) { return !taken.insert(one.query_point).second; });
  }
  return presence;
}

std::optional<CommonPlace> FindCommonPlace(const std::shared_ptr<const PlaceView>& query,
                                           const PlaceBook& map,
                                           const CommonPlaceOptions& options) {
  for (const auto& candidate : map.MostAlike(*query, options.candidates)) {
    const std::vector<CommonPoint> matches = MatchByLook(candidate, *query, options);
    const auto first = Solve(*query, matches, options.by_descriptor, options);
    if (!first.ok() || static_cast<double>(first->inliers.size()) <
                           kLeastAgreement * static_cast<double>(matches.size())) {
      continue;
    }
    CommonPlace place;
    place.query = query;
    std::vector<CommonPoint> guided;
    PresentIn(*query, first->fit.world_from_camera, candidate->distance, map, &guided);
    const auto second = Solve(*query, guided, options.guided, options);
    if (!second.ok()) continue;
    place.mapped_from_camera = second->fit.world_from_camera;
    for (const int k : second->inliers) place.points.push_back(guided[k]);
    MeasureScale(place);
    place.there = PresentIn(*query, place.mapped_from_camera, place.distance, map);
    place.back = PresentBack(place, map);
    if (Proven(place, options)) return place;
  }
  return std::nullopt;
}

}  // namespace saccade
