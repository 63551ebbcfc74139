#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>

#include "server/filter/filter_state.hpp"
#include "server/map/dormant_landmarks.hpp"
#include "server/map/keyframe_graph.hpp"
#include "server/map/landmark.hpp"
#include "server/map/place_graph.hpp"

namespace saccade {

struct StoredMap;

/// The one state that a landmark is in.
enum class LandmarkState {
  kGone,      // forgotten, or never there
  kKnown,     // a point of the target: where it is, is given
  kInFilter,  // the filter estimates it
  kAtRest,    // out of the filter; its keyframe knows where it is
};

/// Why a landmark leaves the filter for later.
struct RestNote {
  CloneId home = 0;              // clone that its covariance is counted from
  std::int64_t rests_until = 0;  // frame
  int failures = 0;              // times that it was woken and not seen
  bool learnt = true;            // the keyframes take the filter's last word on where it is
  bool forgiven = false;         // what it did since it was last woken does not count
};

/// A place as the tracker knows it: landmarks, each in one state, the keyframes that saw them, and
/// which pose clones of the filter stand for these. The one owner of all that; estimates of what is
/// in the filter are the filter's, which is therefore handed in.
///
/// Relocalisation, adjustment and loop closing read it. Values only; the tracker's thread owns it.
class Map {
 public:
  using Recalled = KeyframeGraph::Recalled;

  Map() : at_rest_(DormantOptions()), keyframes_(KeyframeGraphOptions()) {}

  /// Throws everything away but the next free id.
  void Clear();
  /// The same, but landmarks stay that are in the filter, or known: another start takes them over.
  void BeginAnew(const FilterState& filter);

  /// Landmarks that are searched for: known ones and those in the filter.
  LandmarkMap& in_use() { return in_use_; }
  const LandmarkMap& in_use() const { return in_use_; }
  const DormantLandmarks& at_rest() const { return at_rest_; }
  const KeyframeGraph& keyframes() const { return keyframes_; }

  LandmarkState StateOf(FeatureId id, const FilterState& filter) const;
  /// Where a landmark is now [m, world]; nothing if it is gone, or at infinity.
  std::optional<Eigen::Vector3d> Where(FeatureId id, const FilterState& filter) const;
  /// What its keyframe knows of one; nothing where none has seen it.
  std::optional<Recalled> Recall(FeatureId id) const { return keyframes_.Recall(id); }

  /// Whether there is more to keep of this frame than the newest keyframe has: births, or a camera
  /// that moved, by a share of `distance_m` (to what is in view).
  bool HasNews(const FilterState& filter, double distance_m) const;
  /// Keeps the camera's pose, what it saw, and what was born in it, each bearing known to
  /// `bearing_sigma_rad`. After the frame's births, before anything else happens to the filter.
  void AddKeyframe(const FilterState& filter, double distance_m, double bearing_sigma_rad,
                   std::span<const GraphSighting> sightings);
  /// A keyframe of a start that was solved elsewhere, and the clone that stands for it.
  void TakeKeyframe(const Rigid3& world_from_camera, double distance_m,
                    std::span<const GraphSighting> sightings, std::span<const GraphBirth> births,
                    std::optional<CloneId> clone);

  /// Takes landmarks out of the filter: those that get a note come to rest, the others are gone.
  using Judge = std::function<std::optional<RestNote>(const Landmark&)>;
  void Retire(std::span<const FeatureId> ids, const Judge& judge, FilterState& filter);
  /// Takes landmarks at rest, which must be there and of this keyframe, into the filter, at the
  /// clone that stands for it: put into the filter anew, with `covariance`, if it has left. What
  /// the filter does not take is gone. `frame`: the present one.
  void Wake(KeyframeId keyframe, std::span<const FeatureId> ids, const Matrix6d& covariance,
            std::int64_t frame, FilterState& filter);
  /// Asks the keyframes where landmarks at rest are now; those that none remembers are gone.
  void LocateAtRest();

  /// An adjustment around the newest keyframe; nothing while there is too little parallax.
  std::optional<KeyframeGraph::Job> MakeJob(const FilterState& filter) const;
  /// Takes an adjusted one over, into the filter as it was at its checkpoint.
  void Take(const KeyframeGraph::Job& job, FilterState& filter);
  /// The keyframes with the lens unknown; nothing while there are too few.
  std::optional<KeyframeGraph::LensJob> MakeLensJob(const CameraModel& lens,
                                                    const FilterState& filter) const;
  /// Takes an adjusted one over: keyframes, filter and looks are of the lens `after` from here on.
  void TakeLens(const KeyframeGraph::LensJob& job, const CameraModel& before,
                const std::shared_ptr<const CameraModel>& after, FilterState& filter);
  /// Moves all of it, and the filter with the newest keyframe (a closed loop). Landmarks that were
  /// woken where the two parts disagree by more than `torn_m` go back to rest.
  void Move(const MapCorrection& correction, double torn_m, FilterState& filter);

  /// What a relocalisation that is not confirmed is undone to. Keyframes only ever gain by one, and
  /// stay.
  struct Checkpoint {
    FilterState filter;
    LandmarkMap in_use;
    DormantLandmarks at_rest;
  };
  Checkpoint Save(const FilterState& filter) const { return {filter, in_use_, at_rest_}; }
  void Restore(const Checkpoint& checkpoint, FilterState& filter);

  /// What is left of it without the filter: its landmarks come to rest, as well known as they are.
  void StoreInto(StoredMap& stored, const FilterState& filter) const;
  /// In place of what it holds; nothing of it is in a filter yet. False, and all is gone: its parts
  /// do not agree (DecodeMap saw to it that they do).
  bool Load(const StoredMap& stored);

 private:
  CloneId CloneOf(KeyframeId id, const Matrix6d& covariance, FilterState& filter);
  void WakeOne(FeatureId id, CloneId clone, std::int64_t frame, FilterState& filter);
  void RestTorn(const MapCorrection& correction, double torn_m, FilterState& filter);
  /// Clones that have left the filter stand for nothing any more.
  void ForgetClones(const FilterState& filter);

  LandmarkMap in_use_;
  DormantLandmarks at_rest_;
  KeyframeGraph keyframes_;
  std::map<KeyframeId, CloneId> clones_;
  FeatureId newest_feature_ = 0;  // that the keyframes know
};

}  // namespace saccade
