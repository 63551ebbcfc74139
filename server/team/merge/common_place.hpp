#pragma once

#include <optional>
#include <vector>

#include "server/team/merge/place_view.hpp"
#include "shared/geometry/similarity3.hpp"

namespace saccade {

/// One thing seen by both: a point of a view of one map, a point of a view of the other.
struct CommonPoint {
  std::shared_ptr<const PlaceView> mapped;  // of the map that was searched
  std::size_t mapped_point = 0;             // its range is known
  std::size_t query_point = 0;
};

/// How much of what should be seen is seen.
struct Presence {
  int expected = 0, found = 0;
  int cells = 0, empty_cells = 0;  // of the picture, where enough is expected; nothing is found
  double share() const { return expected == 0 ? 0.0 : static_cast<double>(found) / expected; }
};

/// A view of one map recognised in the other: where it was taken, and what proves it.
struct CommonPlace {
  std::shared_ptr<const PlaceView> query;
  Rigid3 mapped_from_camera;        // pose of `query` in the other map
  std::optional<double> scale;      // lengths of the other map / of query's
  std::vector<CommonPoint> points;  // that agree
  Presence there, back;             // the map's points in the query's picture, and the reverse
  double distance = 1.0;            // to what was recognised, in the other map's units

  /// mapped_from_query's world; `scale` must be known.
  Similarity3 MappedFromQueryWorld() const;
};

struct CommonPlaceOptions {
  std::size_t candidates = 4;  // views compared in full
  double ratio = 0.8;          // best / second-best descriptor distance
  int max_hamming = 64;        // of 256
  int by_descriptor = 12;      // that must agree wherever they are in the picture
  int guided = 24;             // and near where the pose has them
  double inlier_px = 3.0;      // at 640 pixels
  double least_share = 0.25;   // of what should be seen
  double most_empty = 0.34;    // of the picture's cells where something should be
  double off_plane = 0.02;     // of the distance, rms: what is in one plane may be a poster
  double spread_px = 45.0;     // at 640 pixels: smaller standard deviation over the picture
  std::uint64_t seed = 1;
};

/// Looks for `query` in the other map; nothing unless everything of the above holds, both ways.
/// Tens of ms.
std::optional<CommonPlace> FindCommonPlace(const std::shared_ptr<const PlaceView>& query,
                                           const PlaceBook& map, const CommonPlaceOptions& options);

/// What of `map` should be in a picture taken from `mapped_from_camera`, and what of it `query`
/// shows within `radius_px` (at 640 pixels) of there. `found`, if given, receives the pairs, each
/// point of `query` once.
Presence PresentIn(const PlaceView& query, const Rigid3& mapped_from_camera, double distance,
                   const PlaceBook& map, std::vector<CommonPoint>* found = nullptr,
                   double radius_px = 6.0);

}  // namespace saccade
