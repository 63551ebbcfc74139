#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/view.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade::tools {

using Features = std::map<FeatureId, FeatureSnapshot>;

/// How the depth of a click was guessed.
enum class How { kFeature, kPlane, kNearbyDepth, kUnknownDepth };

/// Where a click would land, as far as this client can tell before the server decides.
struct Landing {
  AnnotationTarget target;
  /// The same where the server no longer keeps the frame that `target` names.
  std::optional<AnnotationTarget> later;
  Eigen::Vector3d point_in_world = Eigen::Vector3d::Zero();  // [m]
  std::optional<double> sigma_m;                             // nothing: depth not known
  double depth_m = 0;
  How how = How::kUnknownDepth;
  std::optional<Eigen::Vector3d> normal_in_world{};  // unit, of the surface; nothing: not known
};

/// A click on the video: the pixel of the frame that is on the screen. Nothing outside the lens.
std::optional<Landing> LandingInVideo(const View& view, FrameId frame_id,
                                      const Eigen::Vector2d& pixel, const Features& features);

/// A click on the map: a feature where one is close enough, else the ray into the scene. Nothing
/// where only the depth of places elsewhere could be guessed: in an empty corner nothing is to be
/// seen. `pixels_per_point`: of the view's pixels to those that distances on the screen mean.
std::optional<Landing> LandingInMap(const View& view, const Eigen::Vector2d& pixel,
                                    const Features& features, double pixels_per_point = 1);

/// The ray of a pixel into the scene.
std::optional<RayTarget> RayThrough(const View& view, const Eigen::Vector2d& pixel);

/// Radius of the ring that stands for the uncertainty [px of the view]; nothing: not known.
std::optional<double> RingRadius(const View& view, const Landing& landing);

/// In words, for beside the ring; in pixels where the map has no metres.
std::string LandingWords(const View& view, const Landing& landing, bool metric);

/// The annotation whose anchor appears nearest to `pixel`, within `radius_px`; null: none.
const Annotation* PickNearest(const View& view, const Eigen::Vector2d& pixel,
                              const std::vector<Annotation>& annotations, double radius_px);

}  // namespace saccade::tools
