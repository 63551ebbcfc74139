#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "server/map/keyframe_graph.hpp"
#include "server/map/landmark.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade {

/// A landmark out of the filter: its looks and how well it was known. Where it is, the keyframe
/// graph knows.
struct DormantLandmark {
  Landmark landmark;
  double inverse_range_sigma = 1.0;                               // from its first keyframe [1/m]
  Eigen::Matrix3d covariance_in_world = Eigen::Matrix3d::Zero();  // when it left [m^2]
  std::uint64_t home = 0;        // clone that its covariance is counted from
  std::int64_t rests_until = 0;  // frame
  int failures = 0;              // times that it was woken and not seen
  /// Where the keyframe graph had it when it was last asked (Locate).
  struct Place {
    std::uint64_t version = 0;  // of its keyframe; 0: never asked
    KeyframeGraph::Recalled known;
    bool somewhere = false;                          // adjustment may have put it behind infinity
    double range_m = 0.0;                            // from its keyframe, along `ray`
    Eigen::Vector3d ray = Eigen::Vector3d::UnitZ();  // unit, in world
    Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  // [m]
  } place;
};

struct DormantOptions {
  int max_landmarks = 3000;  // then those matched least go
  double max_view_angle_rad = 0.7;
  double max_scale = 2.0;  // nearer or farther than at birth
  double border_px = 20.0;
  double apart_px = 8.0;    // from what is in view already
  int fewest_together = 4;  // of one keyframe, to be worth a pose clone; a seeded one is alone
};

/// What is out of sight, or the filter has no room for, but the map still knows: landmarks that
/// left it well measured, to be woken where they come back into view (slam-spec 6, T17, T19). The
/// tracker's thread owns it.
class DormantLandmarks {
 public:
  using Lookup = std::function<std::optional<KeyframeGraph::Recalled>(FeatureId)>;
  using VersionOf = std::function<std::uint64_t(KeyframeId)>;

  explicit DormantLandmarks(const DormantOptions& options) : options_(options) {}

  void Clear() { landmarks_.clear(); }
  std::size_t size() const { return landmarks_.size(); }
  bool Has(FeatureId id) const { return landmarks_.contains(id); }
  const std::map<FeatureId, DormantLandmark>& all() const { return landmarks_; }
  void Put(DormantLandmark landmark);
  /// Takes one out; it must be there.
  DormantLandmark Take(FeatureId id);
  /// The map was moved: how well each is known goes along.
  void Move(const std::function<Similarity3(FeatureId)>& world_from_before);
  /// Their looks, to be changed.
  void ForEach(const std::function<void(Landmark&)>& change) {
    for (auto& [id, dormant] : landmarks_) change(dormant.landmark);
  }
  /// Asks the graph where its landmarks are now: only about those whose keyframe has changed since.
  /// Those that the graph has forgotten go.
  void Locate(const VersionOf& version, const Lookup& lookup);

  /// Of those located: landmarks that should be seen from here, about `wanted` of them, by the
  /// keyframes that saw them first; most promising keyframes first. `occupied`: pixels of what is
  /// in view already.
  std::vector<std::pair<KeyframeId, std::vector<FeatureId>>> InView(
      const CameraModel& camera, const Rigid3& world_from_camera, std::int64_t frame, int wanted,
      std::span<const Eigen::Vector2d> occupied) const;

 private:
  DormantOptions options_;
  std::map<FeatureId, DormantLandmark> landmarks_;
};

}  // namespace saccade
