#include "server/eval/scene/placement_judge.hpp"

#include <algorithm>
#include <cmath>

namespace saccade {
namespace {

using Eigen::Vector3d;
using Triangle = PlacementJudge::Triangle;

/// Six times the volume of a tetrahedron, signed.
double Volume(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  return (b - a).cross(c - a).dot(d - a);
}

/// The segment runs through the inside of the face.
bool Pierces(const Vector3d& p, const Vector3d& q, const Triangle& face) {
  const double from = Volume(face[0], face[1], face[2], p);
  const double to = Volume(face[0], face[1], face[2], q);
  if (from * to >= 0) return false;
  const double s0 = Volume(p, q, face[0], face[1]);
  const double s1 = Volume(p, q, face[1], face[2]);
  const double s2 = Volume(p, q, face[2], face[0]);
  return (s0 > 0 && s1 > 0 && s2 > 0) || (s0 < 0 && s1 < 0 && s2 < 0);
}

/// Ericson, Real-Time Collision Detection, 5.1.5.
Vector3d ClosestOnFace(const Vector3d& p, const Triangle& t) {
  const Vector3d ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return t[0];
  const Vector3d bp = p - t[1];
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return t[1];
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return t[0] + d1 / (d1 - d3) * ab;
  const Vector3d cp = p - t[2];
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return t[2];
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return t[0] + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return t[1] + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (t[2] - t[1]);
  }
  return t[0] + (vb * ab + vc * ac) / (va + vb + vc);
}

/// The same, 5.1.9.
double SegmentDistance(const Vector3d& p1, const Vector3d& q1, const Vector3d& p2,
                       const Vector3d& q2) {
  const Vector3d d1 = q1 - p1, d2 = q2 - p2, r = p1 - p2;
  const double a = d1.squaredNorm(), e = d2.squaredNorm(), f = d2.dot(r);
  if (a <= 0 || e <= 0) return std::min((p1 - p2).norm(), (q1 - q2).norm());
  const double c = d1.dot(r), b = d1.dot(d2), denominator = a * e - b * b;
  double s = denominator > 0 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
  double t = (b * s + f) / e;
  if (t < 0) {
    t = 0;
    s = std::clamp(-c / a, 0.0, 1.0);
  } else if (t > 1) {
    t = 1;
    s = std::clamp((b - c) / a, 0.0, 1.0);
  }
  return (p1 + s * d1 - p2 - t * d2).norm();
}

struct Box {
  Eigen::Array3d low, high;
  explicit Box(const Triangle& t)
      : low(t[0].cwiseMin(t[1]).cwiseMin(t[2]).array()),
        high(t[0].cwiseMax(t[1]).cwiseMax(t[2]).array()) {}
  void Add(const Box& other) {
    low = low.min(other.low);
    high = high.max(other.high);
  }
  bool Near(const Box& other, double margin) const {
    return (low <= other.high + margin).all() && (other.low <= high + margin).all();
  }
};

std::vector<Triangle> Triangles(const TriangleMesh& mesh, const Rigid3& pose) {
  std::vector<Triangle> triangles;
  for (const TriangleMesh::Triangle& t : mesh.triangles) {
    Triangle one;
    for (std::size_t k = 0; k < 3; ++k) one[k] = pose * mesh.positions[t[k]].cast<double>();
    triangles.push_back(one);
  }
  return triangles;
}

/// The solid angle of a mesh as seen from a point over 4 pi: 1 inside, 0 outside (Van Oosterom and
/// Strackee 1983).
double Winding(const Vector3d& point, const std::vector<Triangle>& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh) {
    const Vector3d a = t[0] - point, b = t[1] - point, c = t[2] - point;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)),
                          la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * M_PI);
}

template <typename Visit>
void ForNearPairs(const std::vector<Triangle>& body, const std::vector<Triangle>& mesh,
                  double margin, Visit visit) {
  Box around(body.front());
  for (const Triangle& t : body) around.Add(Box(t));
  for (const Triangle& still : mesh) {
    const Box box(still);
    if (!box.Near(around, margin)) continue;
    for (const Triangle& t : body) {
      if (box.Near(Box(t), margin) && !visit(t, still)) return;
    }
  }
}

}  // namespace

double TriangleDistance(const Triangle& a, const Triangle& b) {
  if (TrianglesCut(a, b)) return 0;
  double least = (a[0] - b[0]).norm();
  for (std::size_t i = 0; i < 3; ++i) {
    least = std::min(least, (a[i] - ClosestOnFace(a[i], b)).norm());
    least = std::min(least, (b[i] - ClosestOnFace(b[i], a)).norm());
    for (std::size_t k = 0; k < 3; ++k) {
      least = std::min(least, SegmentDistance(a[i], a[(i + 1) % 3], b[k], b[(k + 1) % 3]));
    }
  }
  return least;
}

bool TrianglesCut(const Triangle& a, const Triangle& b) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (Pierces(a[i], a[(i + 1) % 3], b) || Pierces(b[i], b[(i + 1) % 3], a)) return true;
  }
  return false;
}

PlacementJudge::PlacementJudge(const std::vector<TriangleMesh>& in_world,
                               const std::vector<bool>& solids)
    : solids_(solids) {
  for (const TriangleMesh& mesh : in_world) meshes_.push_back(Triangles(mesh, Rigid3()));
}

bool PlacementJudge::Cuts(const TriangleMesh& body, const Rigid3& world_from_body) const {
  const std::vector<Triangle> moved = Triangles(body, world_from_body);
  for (std::size_t i = 0; i < meshes_.size(); ++i) {
    bool cut = false;
    ForNearPairs(moved, meshes_[i], 0.0, [&cut](const Triangle& a, const Triangle& b) {
      cut = TrianglesCut(a, b);
      return !cut;
    });
    if (cut) return true;
    // Whole within the other: middles of faces, which lie on no face of the other.
    const auto middle = [](const Triangle& t) { return Vector3d((t[0] + t[1] + t[2]) / 3.0); };
    if (solids_[i] && Winding(middle(moved.front()), meshes_[i]) > 0.5) return true;
    if (Winding(middle(meshes_[i].front()), moved) > 0.5) return true;
  }
  return false;
}

double PlacementJudge::Distance(const TriangleMesh& body, const Rigid3& world_from_body,
                                double most_m) const {
  const std::vector<Triangle> moved = Triangles(body, world_from_body);
  double least = most_m;
  for (const std::vector<Triangle>& mesh : meshes_) {
    ForNearPairs(moved, mesh, most_m, [&least](const Triangle& a, const Triangle& b) {
      least = std::min(least, TriangleDistance(a, b));
      return true;
    });
  }
  return least;
}

double PlacementJudge::Gap(const TriangleMesh& body, const Rigid3& world_from_body,
                           const Vector3d& direction, double most_m) const {
  const auto cuts = [&](double way_m) {
    return Cuts(body, {world_from_body.rotation, world_from_body.translation + way_m * direction});
  };
  const bool now = cuts(0);
  if (now == cuts(now ? -most_m : most_m)) return now ? -most_m : most_m;
  double free = now ? -most_m : 0, cut = now ? 0 : most_m;
  while (cut - free > 1e-6) {
    const double middle = 0.5 * (free + cut);
    (cuts(middle) ? cut : free) = middle;
  }
  return 0.5 * (free + cut);
}

}  // namespace saccade
