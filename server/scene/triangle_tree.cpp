#include "server/scene/triangle_tree.hpp"

#include <algorithm>
#include <limits>

namespace saccade {
namespace {

using Eigen::Array3d;
using Eigen::Vector3d;

constexpr std::uint32_t kLeaf = 4;
constexpr double kEdge = 1e-9;       // a hit so far beyond an edge, of its length, is one
constexpr double kParallel = 1e-12;  // sine below which directions are parallel
constexpr double kSlack_m = 1e-9;    // boxes are taken larger, against rounding

struct Touch {
  double distance_m;
  Vector3d point, normal;  // normal of any length and sign
};

/// When a corner at `from` that moves along `direction` meets the face.
std::optional<Touch> CornerOnFace(const Vector3d& from, const Vector3d& direction,
                                  const std::array<Vector3d, 3>& face) {
  const Vector3d e1 = face[1] - face[0], e2 = face[2] - face[0];
  const Vector3d p = direction.cross(e2);
  const double det = e1.dot(p);
  if (std::abs(det) <= kParallel * e1.norm() * e2.norm()) return std::nullopt;
  const Vector3d s = from - face[0];
  const double u = s.dot(p) / det;
  if (!(u >= -kEdge && u <= 1 + kEdge)) return std::nullopt;
  const Vector3d q = s.cross(e1);
  const double v = direction.dot(q) / det;
  if (!(v >= -kEdge && u + v <= 1 + kEdge)) return std::nullopt;
  const double t = e2.dot(q) / det;
  if (!(t >= 0)) return std::nullopt;
  return Touch{t, from + t * direction, e1.cross(e2)};
}

/// When edge a0 a1, moving along `direction`, meets edge b0 b1.
std::optional<Touch> EdgeOnEdge(const Vector3d& a0, const Vector3d& a1, const Vector3d& direction,
                                const Vector3d& b0, const Vector3d& b1) {
  const Vector3d ea = a1 - a0, eb = b1 - b0, normal = ea.cross(eb);
  const double det = normal.dot(direction);
  if (std::abs(det) <= kParallel * ea.norm() * eb.norm()) return std::nullopt;
  // a0 + u ea + t direction = b0 + w eb
  const Vector3d between = b0 - a0;
  const double t = normal.dot(between) / det;
  if (!(t >= 0)) return std::nullopt;
  const double u = between.dot(eb.cross(direction)) / det;
  if (!(u >= -kEdge && u <= 1 + kEdge)) return std::nullopt;
  const double w = between.dot(ea.cross(direction)) / det;
  if (!(w >= -kEdge && w <= 1 + kEdge)) return std::nullopt;
  return Touch{t, b0 + w * eb, normal};
}

}  // namespace

struct TriangleTree::Search {
  Vector3d direction;
  SweepHit best;
  bool found = false;

  void Offer(const std::optional<Touch>& touch, std::uint32_t owner) {
    if (!touch || touch->distance_m > best.distance_m ||
        (found && touch->distance_m == best.distance_m)) {
      return;
    }
    found = true;
    const Vector3d normal = touch->normal.normalized();
    best = {touch->distance_m, touch->point, normal.dot(direction) > 0 ? Vector3d(-normal) : normal,
            owner};
  }
  void Compare(const OwnedTriangle& still, const OwnedTriangle& moving) {
    for (std::size_t i = 0; i < 3; ++i) {
      Offer(CornerOnFace(moving.corners[i], direction, still.corners), still.owner);
      std::optional<Touch> back = CornerOnFace(still.corners[i], -direction, moving.corners);
      if (back) back->point = still.corners[i];
      Offer(back, still.owner);
      for (std::size_t k = 0; k < 3; ++k) {
        Offer(EdgeOnEdge(moving.corners[i], moving.corners[(i + 1) % 3], direction,
                         still.corners[k], still.corners[(k + 1) % 3]),
              still.owner);
      }
    }
  }
  /// When the moving box enters the one that stands still; infinite if never.
  double Entry(const Node& still, const Node& moving) const {
    double enter = 0, leave = best.distance_m;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = still.low[axis] - moving.high[axis] - kSlack_m;
      const double high = still.high[axis] - moving.low[axis] + kSlack_m;
      const double speed = direction[axis];
      if (std::abs(speed) < 1e-15) {
        if (low > 0 || high < 0) return std::numeric_limits<double>::infinity();
        continue;
      }
      const double a = low / speed, b = high / speed;
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter <= leave + kSlack_m ? enter : std::numeric_limits<double>::infinity();
  }
};

TriangleTree::TriangleTree(std::vector<OwnedTriangle> triangles)
    : triangles_(std::move(triangles)) {
  if (triangles_.empty()) return;
  nodes_.reserve(triangles_.size());
  nodes_.emplace_back();
  Build(0, 0, static_cast<std::uint32_t>(triangles_.size()));
}

void TriangleTree::Build(std::size_t node, std::uint32_t first, std::uint32_t count) {
  Array3d low = Array3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  Array3d centre_low = low, centre_high = high;
  const auto centre = [](const OwnedTriangle& t) {
    return ((t.corners[0] + t.corners[1] + t.corners[2]) / 3.0).array().eval();
  };
  for (std::uint32_t i = first; i < first + count; ++i) {
    for (const Vector3d& corner : triangles_[i].corners) {
      low = low.min(corner.array());
      high = high.max(corner.array());
    }
    centre_low = centre_low.min(centre(triangles_[i]));
    centre_high = centre_high.max(centre(triangles_[i]));
  }
  nodes_[node].low = low;
  nodes_[node].high = high;
  if (count <= kLeaf) {
    nodes_[node].first = first;
    nodes_[node].count = count;
    return;
  }
  Eigen::Index axis = 0;
  (centre_high - centre_low).maxCoeff(&axis);
  const std::uint32_t half = count / 2;
  const auto begin = triangles_.begin() + first;
  std::nth_element(begin, begin + half, begin + count,
                   [&](const OwnedTriangle& a, const OwnedTriangle& b) {
                     return centre(a)[axis] < centre(b)[axis];
                   });
  const std::size_t left = nodes_.size();
  nodes_[node].first = static_cast<std::uint32_t>(left);
  nodes_.resize(left + 2);
  Build(left, first, half);
  Build(left + 1, first + half, count - half);
}

void TriangleTree::Visit(std::size_t node, const TriangleTree& moving, std::size_t moving_node,
                         Search& search) const {
  const Node& still = nodes_[node];
  const Node& other = moving.nodes_[moving_node];
  if (still.count > 0 && other.count > 0) {
    for (std::uint32_t i = still.first; i < still.first + still.count; ++i) {
      for (std::uint32_t k = other.first; k < other.first + other.count; ++k) {
        search.Compare(triangles_[i], moving.triangles_[k]);
      }
    }
    return;
  }
  // Into the larger one, nearest first.
  const double still_size = (still.high - still.low).sum();
  const double other_size = (other.high - other.low).sum();
  const bool open_still = still.count == 0 && (other.count > 0 || still_size >= other_size);
  std::array<std::pair<std::size_t, std::size_t>, 2> pairs;
  std::array<double, 2> entry{};
  for (std::size_t k = 0; k < 2; ++k) {
    pairs[k] =
        open_still ? std::pair(still.first + k, moving_node) : std::pair(node, other.first + k);
    entry[k] = search.Entry(nodes_[pairs[k].first], moving.nodes_[pairs[k].second]);
  }
  const std::size_t nearer = entry[1] < entry[0] ? 1 : 0;
  for (const std::size_t k : {nearer, 1 - nearer}) {
    if (entry[k] <= search.best.distance_m) {
      Visit(pairs[k].first, moving, pairs[k].second, search);
    }
  }
}

std::optional<SweepHit> TriangleTree::Sweep(const TriangleTree& moving, const Vector3d& direction,
                                            double most_m) const {
  if (triangles_.empty() || moving.triangles_.empty()) return std::nullopt;
  Search search;
  search.direction = direction;
  search.best.distance_m = most_m;
  if (search.Entry(nodes_[0], moving.nodes_[0]) <= most_m) Visit(0, moving, 0, search);
  if (!search.found) return std::nullopt;
  return search.best;
}

std::vector<int> TriangleTree::Crossings(const Vector3d& point, const Vector3d& direction,
                                         std::size_t owners) const {
  std::vector<int> crossings(owners, 0);
  if (triangles_.empty()) return crossings;
  Node from;
  from.low = from.high = point.array();
  Search search;
  search.direction = direction;
  search.best.distance_m = 1e9;
  std::vector<std::size_t> open = {0};
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    if (search.Entry(node, from) > search.best.distance_m) continue;
    if (node.count == 0) {
      open.push_back(node.first);
      open.push_back(node.first + 1);
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      if (CornerOnFace(point, direction, triangles_[i].corners)) {
        ++crossings[triangles_[i].owner];
      }
    }
  }
  return crossings;
}

std::optional<double> TriangleTree::FirstHit(const Vector3d& point, const Vector3d& direction,
                                             double most_m) const {
  if (triangles_.empty()) return std::nullopt;
  Node from;
  from.low = from.high = point.array();
  Search search;
  search.direction = direction;
  search.best.distance_m = most_m;
  bool hit = false;
  std::vector<std::size_t> open = {0};
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    if (search.Entry(node, from) > search.best.distance_m) continue;
    if (node.count == 0) {
      open.push_back(node.first);
      open.push_back(node.first + 1);
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const auto touch = CornerOnFace(point, direction, triangles_[i].corners);
      if (!touch || touch->distance_m > search.best.distance_m) continue;
      search.best.distance_m = touch->distance_m;
      hit = true;
    }
  }
  if (!hit) return std::nullopt;
  return search.best.distance_m;
}

}  // namespace saccade
