#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "server/team/merge/map_fit.hpp"
#include "server/team/reorder_buffer.hpp"

namespace saccade {

struct MapJoinerOptions {
  CommonPlaceOptions place = {};
  Timestamp hold_ns = 100'000'000;  // how long a keyframe may be late (slam-spec 11, T37)
  int places_needed = 3;            // of different pictures, that agree
  std::size_t places_kept = 60;     // newest
  double agree_share = 0.1;         // of the distance: between where two places have a camera
  double agree_rad = 0.06;
  double agree_log_scale =
      0.4;                    // of maps without metres: one that turns on the spot has many units
  double moved_share = 0.05;  // of the distance, or
  double turned_rad = 0.1;    // between the pictures that agree: one view proves nothing
  double most_contradicting = 0.2;  // of views in which the other map should show
  double most_empty = 0.3;          // of the cells of all those pictures, in which it should show
  /// What is once a join is given up where it would not be half as good as it had to be.
  double reluctance = 2.0;
};

/// Two maps that are one.
struct MapJoin {
  MapFit fit;
  bool metric = false;  // both are: own_from_other is rigid
  int places = 0;       // that agree, and
  int disagreeing = 0;  // of those kept
  int views_tested = 0, views_contradicting = 0;
  int cells = 0, empty_cells = 0;  // of their pictures, as Presence has them
  Timestamp since_ns = 0;          // told_time_ns of the keyframe that made it one
  std::uint64_t revision = 0;      // rises with each new estimate
};

/// Finds out whether and how two maps show one place, from their keyframes alone.
///
/// Each keyframe is looked for in the other map. A join needs several pictures that agree, taken
/// from different poses, none of which could be a thing that two rooms share: what should be seen
/// around it is seen, too (CommonPlaceOptions), and the views that both maps have of the rest do
/// not contradict. It is estimated anew with each common place, and given up where most of the
/// newest places contradict it. The result depends on what was told and when, not on the order of
/// arrival within `hold_ns`. One thread; tens of ms a keyframe.
class MapJoiner {
 public:
  explicit MapJoiner(const MapJoinerOptions& options = {});

  /// `told_time_ns` on one clock for both. False: too late, or older than what is known.
  bool Take(MapSide side, TeamKeyframe keyframe);
  /// Works off what need not wait any longer; `all`: everything. True: join() has changed.
  bool Work(bool all = false);

  const std::optional<MapJoin>& join() const { return join_; }
  const PlaceBook& book(MapSide side) const { return side == MapSide::kOwn ? own_ : other_; }
  std::size_t late() const { return waiting_.late(); }
  int places_found() const { return places_found_; }
  /// Forgets the other map (its owner has left for good).
  void ForgetOther();

 private:
  struct Told {
    MapSide side;
    TeamKeyframe keyframe;
  };
  bool WorkOn(Told told);
  /// Places take a view of `side` as it is now.
  void Renew(MapSide side, const std::shared_ptr<const PlaceView>& view);
  /// Whether more is known of this view than when it was looked for last.
  bool WorthLooking(MapSide side, const PlaceView& view);
  bool Judge(Timestamp now_ns);
  /// Where `place`'s camera is in the map it was recognised in, by the join.
  bool Agrees(const JoinedPlace& place, const Similarity3& own_from_other) const;
  std::optional<Similarity3> Proposal(const JoinedPlace& place, bool metric) const;
  bool FromDifferentPoses(const std::vector<const JoinedPlace*>& places) const;
  void TestViews(MapJoin& join) const;

  MapJoinerOptions options_;
  PlaceBook own_, other_;
  ReorderBuffer<Told> waiting_;
  std::size_t sequence_ = 0;
  std::map<std::pair<MapSide, FrameId>, int> looked_;  // points known then
  std::deque<JoinedPlace> places_;
  std::optional<MapJoin> join_;
  std::uint64_t revision_ = 0;
  int places_found_ = 0;
};

}  // namespace saccade
