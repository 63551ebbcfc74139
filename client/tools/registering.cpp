#include "client/tools/registering.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <limits>

#include "client/tools/measured.hpp"

namespace saccade::tools {
namespace {

using Eigen::Vector3d;

std::vector<Vector3d> CornersOf(const Scene& scene, const SceneObject& thing) {
  std::vector<Vector3d> corners;
  if (thing.shape == SceneShape::kModel) {
    const std::shared_ptr<const SceneModel> model = scene.Model(thing.model);
    if (model == nullptr) return corners;
    for (const Eigen::Vector3f& each : model->mesh.positions)
      corners.emplace_back(each.cast<double>());
    return corners;
  }
  const int highest = thing.shape == SceneShape::kPlane ? 0 : 1;
  for (const double x : {-0.5, 0.5}) {
    for (const double z : {-0.5, 0.5}) {
      for (int y = 0; y <= highest; ++y) {
        corners.emplace_back(x * thing.size_m.x(), -y * thing.size_m.y(), z * thing.size_m.z());
      }
    }
  }
  return corners;
}

}  // namespace

std::optional<Vector3d> CornerAt(const Scene& scene, const SceneObject& thing, const View& view,
                                 const Eigen::Vector2d& pixel, double within_px) {
  const double scale = thing.shape == SceneShape::kModel ? thing.scale : 1;
  std::optional<Vector3d> best;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vector3d& corner : CornersOf(scene, thing)) {
    const auto at = view.Project(thing.parent_from_object * (scale * corner));
    const double away = at ? (*at - pixel).norm() : nearest;
    if (away > within_px || away >= nearest) continue;
    nearest = away;
    best = corner;
  }
  return best;
}

void Registering::Begin(const std::string& thing_id) {
  thing_id_ = thing_id;
  corner_.reset();
  pairs_.clear();
  result.reset();
  why.clear();
}

std::vector<Vector3d> Registering::points() const {
  std::vector<Vector3d> points;
  for (const net::PointPair& pair : pairs_) points.push_back(pair.in_world);
  return points;
}

std::string Registering::Step(const Scene& scene) const {
  const SceneObject* thing = scene.Find(thing_id_);
  if (thing == nullptr) return "Select the thing in the list first.";
  return absl::StrCat("Point ", pairs_.size() + 1, ": click ",
                      corner_ ? "the same point in the map or the video"
                              : absl::StrCat("a corner of ", thing->name),
                      ".");
}

absl::StatusOr<Registering::Took> Registering::Click(const Scene& scene, const View& view,
                                                     const Eigen::Vector2d& pixel,
                                                     const std::optional<Landing>& landing,
                                                     double within_px) {
  const SceneObject* thing = scene.Find(thing_id_);
  if (thing == nullptr) return absl::FailedPreconditionError("select the thing in the list first");
  if (!corner_) {
    corner_ = CornerAt(scene, *thing, view, pixel, within_px);
    if (corner_) return Took::kCorner;
    return absl::NotFoundError(absl::StrCat("no corner of ", thing->name, " is there"));
  }
  if (!IsMeasured(landing)) return absl::FailedPreconditionError(kUnmeasured);
  pairs_.push_back({*corner_, landing->point_in_world});
  corner_.reset();
  result.reset();
  why.clear();
  return Took::kPair;
}

void Registering::Drop(std::size_t index) {
  if (index >= pairs_.size()) return;
  pairs_.erase(pairs_.begin() + static_cast<std::ptrdiff_t>(index));
  result.reset();
  why.clear();
}

std::string Registering::Total() const {
  if (result) {
    return absl::StrFormat("error %.1f mm; to expect elsewhere %.1f mm", result->rms_mm,
                           result->left_out_rms_mm);
  }
  if (!why.empty()) return why;
  if (pairs_.size() >= kLeastPairs) return "asking the server";
  const std::size_t missing = kLeastPairs - pairs_.size();
  return absl::StrCat(missing, missing == 1 ? " more point" : " more points");
}

std::string Registering::PairWords(std::size_t index) const {
  const bool told =
      result && index < result->errors_mm.size() && index < result->left_out_errors_mm.size();
  if (!told) return "clicked";
  return absl::StrFormat("%.1f mm, by the others %.1f mm", result->errors_mm[index],
                         result->left_out_errors_mm[index]);
}

}  // namespace saccade::tools
