#include "server/team/merge/map_joiner.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace saccade {
namespace {

constexpr int kFewestKnown = 30;       // points of a view before it is looked for
constexpr double kMoreKnown = 1.5;     // then it is looked for again
constexpr double kMetreOff = 0.15;     // log scale between maps that both are metric
constexpr int kFewestExpected = 30;    // in a view before it can contradict
constexpr double kContradicts = 0.08;  // share found, within
constexpr double kTested_px = 25.0;    // of there, at 640 pixels: maps are bent
constexpr std::size_t kMostTested = 25;
constexpr std::size_t kNewest = 12;  // places, of which half must agree

MapSide Opposite(MapSide side) { return side == MapSide::kOwn ? MapSide::kOther : MapSide::kOwn; }

}  // namespace

MapJoiner::MapJoiner(const MapJoinerOptions& options)
    : options_(options), waiting_(options.hold_ns) {}

bool MapJoiner::Take(MapSide side, TeamKeyframe keyframe) {
  const Timestamp time_ns = keyframe.told_time_ns;
  // By content, not by arrival: what is told in one moment is worked off in one order.
  const std::size_t order = (keyframe.frame << 12) + keyframe.edition;
  return waiting_.Push(time_ns, static_cast<int>(side), order, {side, std::move(keyframe)});
}

bool MapJoiner::Work(bool all) {
  bool changed = false;
  for (Told& told : all ? waiting_.Rest() : waiting_.Ready()) {
    changed = WorkOn(std::move(told)) || changed;
  }
  return changed;
}

void MapJoiner::ForgetOther() {
  other_ = PlaceBook();
  places_.clear();
  looked_.clear();
  join_.reset();
}

bool MapJoiner::WorthLooking(MapSide side, const PlaceView& view) {
  if (view.known < kFewestKnown) return false;
  const auto [at, fresh] = looked_.try_emplace({side, view.told.frame}, view.known);
  if (fresh) return true;
  if (view.known < kMoreKnown * at->second) return false;
  at->second = view.known;
  return true;
}

void MapJoiner::Renew(MapSide side, const std::shared_ptr<const PlaceView>& view) {
  const auto same = [&](const PlaceView& known) {
    return known.told.frame == view->told.frame && known.described.size() == view->described.size();
  };
  for (JoinedPlace& place : places_) {
    if (place.mapped != side) {
      if (same(*place.place.query)) place.place.query = view;
      continue;
    }
    for (CommonPoint& point : place.place.points) {
      if (same(*point.mapped)) point.mapped = view;
    }
  }
}

bool MapJoiner::WorkOn(Told told) {
  PlaceBook& book = told.side == MapSide::kOwn ? own_ : other_;
  const Timestamp now_ns = told.keyframe.told_time_ns;
  bool changed = false;
  if (book.generation() && *book.generation() < told.keyframe.generation) {
    places_.clear();
    looked_.clear();
    changed = join_.has_value();
    join_.reset();
  }
  const auto view = book.Take(std::move(told.keyframe));
  if (!view) return changed;
  Renew(told.side, view);
  if (!WorthLooking(told.side, *view)) return changed;
  const MapSide in = Opposite(told.side);
  auto place = FindCommonPlace(view, this->book(in), options_.place);
  if (!place) return changed;
  ++places_found_;
  // One picture counts once.
  std::erase_if(places_, [&](const JoinedPlace& known) {
    return known.mapped == in && known.place.query->told.frame == view->told.frame;
  });
  places_.push_back({in, *std::move(place)});
  if (places_.size() > options_.places_kept) places_.pop_front();
  return Judge(now_ns) || changed;
}

std::optional<Similarity3> MapJoiner::Proposal(const JoinedPlace& place, bool metric) const {
  if (!place.place.scale) return std::nullopt;
  CommonPlace seen = place.place;
  if (metric) {
    if (std::abs(std::log(*seen.scale)) > kMetreOff) return std::nullopt;
    seen.scale = 1.0;
  }
  const Similarity3 mapped_from_query = seen.MappedFromQueryWorld();
  return place.mapped == MapSide::kOwn ? mapped_from_query : mapped_from_query.Inverse();
}

bool MapJoiner::Agrees(const JoinedPlace& place, const Similarity3& own_from_other) const {
  const Similarity3 mapped_from_query =
      place.mapped == MapSide::kOwn ? own_from_other : own_from_other.Inverse();
  const Rigid3 there = mapped_from_query.Move(place.place.query->world_from_camera());
  const Rigid3& seen = place.place.mapped_from_camera;
  if ((there.translation - seen.translation).norm() > options_.agree_share * place.place.distance ||
      RotationAngle(there, seen) > options_.agree_rad) {
    return false;
  }
  return !place.place.scale || std::abs(std::log(*place.place.scale / mapped_from_query.scale)) <
                                   options_.agree_log_scale;
}

bool MapJoiner::FromDifferentPoses(const std::vector<const JoinedPlace*>& places) const {
  for (const JoinedPlace* a : places) {
    for (const JoinedPlace* b : places) {
      if (a->mapped != b->mapped) continue;
      const Rigid3 &from = a->place.mapped_from_camera, &to = b->place.mapped_from_camera;
      if ((from.translation - to.translation).norm() > options_.moved_share * a->place.distance ||
          RotationAngle(from, to) > options_.turned_rad) {
        return true;
      }
    }
  }
  return false;
}

void MapJoiner::TestViews(MapJoin& join) const {
  for (const MapSide side : {MapSide::kOwn, MapSide::kOther}) {
    const Similarity3 there_from_here =
        side == MapSide::kOwn ? join.fit.own_from_other.Inverse() : join.fit.own_from_other;
    const PlaceBook &here = book(side), &there = book(Opposite(side));
    const std::size_t every = std::max<std::size_t>(1, here.views().size() / kMostTested);
    std::size_t k = 0;
    for (const auto& [frame, view] : here.views()) {
      if (k++ % every != 0) continue;
      const Presence presence =
          PresentIn(*view, there_from_here.Move(view->world_from_camera()),
                    there_from_here.scale * view->distance, there, nullptr, kTested_px);
      if (presence.expected < kFewestExpected) continue;
      ++join.views_tested;
      join.cells += presence.cells;
      join.empty_cells += presence.empty_cells;
      join.views_contradicting += presence.share() < kContradicts ? 1 : 0;
    }
  }
}

bool MapJoiner::Judge(Timestamp now_ns) {
  const bool metric = own_.metric() && other_.metric();
  std::vector<const JoinedPlace*> best;
  Similarity3 proposal;
  for (const JoinedPlace& place : places_) {
    const auto proposed = Proposal(place, metric);
    if (!proposed) continue;
    std::vector<const JoinedPlace*> agreeing;
    for (const JoinedPlace& other : places_) {
      if (Agrees(other, *proposed)) agreeing.push_back(&other);
    }
    if (agreeing.size() < best.size()) continue;  // of equals the newest
    best = std::move(agreeing);
    proposal = *proposed;
  }
  const std::size_t newest = std::min(places_.size(), kNewest);
  const auto of_newest =
      std::count_if(places_.end() - static_cast<std::ptrdiff_t>(newest), places_.end(),
                    [&](const JoinedPlace& place) { return Agrees(place, proposal); });
  const auto give_up = [&] {
    const bool was = join_.has_value();
    join_.reset();
    return was;
  };
  if (std::ssize(best) < options_.places_needed ||
      2.0 * (join_ ? options_.reluctance : 1.0) * static_cast<double>(of_newest) <
          static_cast<double>(newest) ||
      !FromDifferentPoses(best)) {
    return give_up();
  }
  const auto fit = FitMaps(best, proposal, metric);
  if (!fit) return give_up();
  MapJoin join;
  join.fit = *fit;
  join.metric = metric;
  join.places = static_cast<int>(best.size());
  join.disagreeing = static_cast<int>(places_.size() - best.size());
  TestViews(join);
  const double patience = join_ ? options_.reluctance : 1.0;
  if (join.views_contradicting > patience * options_.most_contradicting * join.views_tested ||
      join.empty_cells > patience * options_.most_empty * join.cells) {
    return give_up();
  }
  join.since_ns = join_ ? join_->since_ns : now_ns;
  join.revision = ++revision_;
  join_ = join;
  return true;
}

}  // namespace saccade
