#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "server/map/bundle_adjustment.hpp"
#include "server/map/lens_adjustment.hpp"
#include "shared/geometry/similarity3.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade {

using KeyframeId = std::int64_t;

/// What a keyframe saw.
struct GraphSighting {
  FeatureId id = 0;
  Eigen::Vector3d ray = Eigen::Vector3d::UnitZ();  // unit, in the camera at mid-exposure
  double sigma_rad = 1e-3;
  std::optional<Eigen::Vector3d> known_point;  // [m, world] of a target
};

/// A feature that a keyframe saw first.
struct GraphBirth {
  FeatureId id = 0;
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();  // unit, in the camera at mid-exposure
  double sigma_rad = 1e-3;
  double inverse_range = 1.0, inverse_range_sigma = 1.0;  // guessed [1/m]
};

/// An estimate of a feature, in its first keyframe.
struct GraphEstimate {
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();
  double inverse_range = 1.0;  // [1/m]
};

struct KeyframeGraphOptions {
  int dense_keyframes = 40;       // the newest are all kept; before them, only those that are apart
  double apart_share = 0.05;      // of the distance to what is in view
  double apart_rad = 0.12;        // 7 deg
  int max_keyframes = 600;        // then the oldest go that no feature in use was born in
  int adjusted_keyframes = 30;    // newest, and those that share most points with them
  int held_keyframes = 15;        // around them, fixed
  int max_points = 300;           // adjusted at once
  double parallax_sigmas = 10.0;  // of a sighting's noise: less tells nothing of depth
  int parallax_points = 15;  // with so much parallax in the newest keyframe, else no adjustment
  int least_points = 8;      // with so much parallax in a keyframe, else it is held
};

/// Keyframes and what they saw: the memory from which bundle adjustment draws (slam-spec 6).
/// Values only; the tracker's thread owns it, a Job is a copy for another thread.
class KeyframeGraph {
 public:
  explicit KeyframeGraph(const KeyframeGraphOptions& options) : options_(options) {}

  void Clear();
  std::size_t size() const { return keyframes_.size(); }
  /// What a feature still is to the tracker. What the graph forgets of those in the filter would
  /// tear them from the rest at the next adjustment; of those at rest, they are lost.
  enum class Life { kGone, kAtRest, kInFilter };
  using LifeOf = std::function<Life(FeatureId)>;
  /// `distance_m`: typical, to what is in view.
  KeyframeId Add(const Rigid3& world_from_camera, double distance_m,
                 std::span<const GraphSighting> sightings, std::span<const GraphBirth> births,
                 const LifeOf& life = {});
  /// The newest keyframe's pose; nothing if there is none.
  std::optional<Rigid3> Newest() const;
  std::optional<Rigid3> Pose(KeyframeId id) const;
  void SetPose(KeyframeId id, const Rigid3& world_from_camera);

  /// A problem around the newest keyframe, and what its indices mean.
  struct Job {
    BundleProblem problem;
    std::vector<KeyframeId> keyframes;  // rising
    std::vector<FeatureId> points;
    KeyframeId newest = -1;
    /// Index of the first keyframe of the newest stretch that is in it without a gap; what lies
    /// before is the old part, met again.
    std::size_t first_recent = 0;
    std::vector<double> distances_m;  // of the keyframes, to what was in view
  };
  using Lookup = std::function<std::optional<GraphEstimate>(FeatureId)>;
  /// `estimate`: a feature as the filter has it now, if it still does. Nothing while too few points
  /// show parallax: a camera that only turns has nothing to adjust.
  std::optional<Job> MakeJob(const Lookup& estimate) const;
  /// A problem over the whole graph, or what stands for it, with the lens unknown.
  struct LensJob {
    LensBundle problem;
    std::vector<KeyframeId> keyframes;  // rising
    std::vector<FeatureId> points;
  };
  /// `lens`: what the rays were made with. The lens's guess and prior are left to the caller.
  LensJob MakeLensJob(const CameraModel& lens, const Lookup& estimate) const;
  /// How a change of lens moves the rest: rays by `reray`, what the job left out along with what is
  /// next to it.
  struct LensChange {
    std::function<Eigen::Vector3d(const Eigen::Vector3d&)> reray;  // unit to unit
    double sigma_factor = 1.0;                                     // of angles
  };
  /// Takes an adjusted job over, and writes all rays anew.
  void TakeLens(const LensJob& job, const LensChange& change);
  /// A point as the graph has it, and the pose that it was first seen from.
  struct Recalled {
    KeyframeId anchor = 0;
    Rigid3 world_from_anchor;
    GraphEstimate estimate;
    double bearing_sigma_rad = 1e-3;
    /// [m]; the inverse range must be above 0.
    Eigen::Vector3d PointInWorld() const {
      return world_from_anchor * (estimate.bearing / estimate.inverse_range);
    }
  };
  std::optional<Recalled> Recall(FeatureId id) const;
  /// Changes whenever the keyframe or a point that it saw first does; 0: there is no such keyframe.
  /// So who remembers a large map need not ask for all of it in every frame.
  std::uint64_t Version(KeyframeId id) const;
  /// Rises whenever any keyframe does.
  std::uint64_t changes() const { return changes_; }
  /// The filter's last word on a feature that leaves it.
  void SetEstimate(FeatureId id, const GraphEstimate& estimate);
  /// Keyframes by rising id, and how many points tie two of them: born in one, seen from the other.
  struct Outline {
    struct Member {
      KeyframeId id = 0;
      Rigid3 world_from_camera;
      double distance_m = 1.0;   // to what was in view
      bool sees_target = false;  // its place in the world is known
    };
    struct Tie {
      int from = 0, to = 0;  // indices, rising
      int points = 0;
    };
    std::vector<Member> keyframes;
    std::vector<Tie> ties;
  };
  Outline MakeOutline() const;
  /// Moves every keyframe, and lengths of what was seen first from it along with its scale.
  void Move(const std::function<const Similarity3&(KeyframeId)>& world_from_before);
  /// Takes an adjusted job over; keyframes added meanwhile move along with the newest of the job.
  void Take(const Job& job);

  struct Keyframe {
    Rigid3 world_from_camera;
    double distance_m = 1.0;
    std::vector<GraphSighting> sightings;
    std::vector<FeatureId> births;
    std::uint64_t version = 0;
  };
  struct Point {
    KeyframeId anchor = 0;
    GraphBirth birth;
    GraphEstimate estimate;
    std::vector<KeyframeId> seen_from;  // rising
  };
  const std::map<KeyframeId, Keyframe>& all() const { return keyframes_; }
  /// All of it, for a file.
  struct Contents {
    std::map<KeyframeId, Keyframe> keyframes;
    std::unordered_map<FeatureId, Point> points;
  };
  Contents Save() const { return {keyframes_, points_}; }
  /// In place of what it holds. False, and nothing is changed: they name what is not there.
  bool Load(Contents contents);

 private:
  using Ranked = std::vector<std::pair<int, KeyframeId>>;

  void Thin(const LifeOf& life);
  /// The oldest of those whose births are worth least now.
  KeyframeId LeastWorth(const LifeOf& life) const;
  void Erase(KeyframeId id);
  /// Keyframes that see these points, most of them first.
  Ranked WhoSees(std::span<const FeatureId> points) const;
  std::vector<KeyframeId> Adjusted() const;
  /// Of what they see, the points that two keyframes at least saw besides the first one.
  std::vector<FeatureId> PointsOf(const std::vector<KeyframeId>& adjusted) const;
  /// `adjusted`, the first keyframes of `points`, and others that see most of them.
  void ChooseKeyframes(const std::vector<KeyframeId>& adjusted, Job& job) const;
  void ChoosePoints(const Lookup& estimate, Job& job) const;
  void AddSightings(Job& job) const;
  /// Says which of the job's keyframes are recent.
  void FindRecent(Job& job) const;
  /// Whether enough points of the newest keyframe show parallax; keyframes that see few of those
  /// are held: where depth is only guessed, a turn and a sideways step look alike.
  bool ShowsParallax(Job& job) const;

  KeyframeGraphOptions options_;
  std::map<KeyframeId, Keyframe> keyframes_;
  std::unordered_map<FeatureId, Point> points_;
  KeyframeId next_ = 0;
  std::uint64_t changes_ = 0;  // never counted back: versions of a cleared graph mean nothing now
};

/// AdjustBundle for a job. The old part of a map is right by more looks than the new one; where the
/// two do not meet (drift), an adjustment that is free to would bend the old to the new, and tear
/// it where its view ends. So if it moves an old keyframe further than that may be wrong, it is
/// done again with the old part held. False: as AdjustBundle.
bool AdjustJob(KeyframeGraph::Job& job, const std::atomic<bool>& stop);

}  // namespace saccade
