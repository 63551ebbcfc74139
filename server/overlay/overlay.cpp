#include "server/overlay/overlay.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "server/overlay/label_painter.hpp"
#include "server/overlay/painter.hpp"
#include "server/overlay/picture_painter.hpp"
#include "server/scene/scene_view.hpp"
#include "shared/marks/strokes.hpp"

namespace saccade {
namespace {

constexpr double kLinePx = 2.0;
constexpr double kHaloPx = 5.0;
const cv::Scalar kAxisColor{208, 204, 201};  // #c9ccd0

cv::Scalar ColorOf(std::uint32_t rgba) {
  return {static_cast<double>(rgba >> 8 & 0xff), static_cast<double>(rgba >> 16 & 0xff),
          static_cast<double>(rgba >> 24 & 0xff)};
}

void DrawAxes(const CameraModel& camera, const MapSnapshot& snapshot, Painter& painter) {
  const std::array<AxisStroke, 3> axes = WorldAxes(camera, snapshot.world_from_camera);
  for (const AxisStroke& axis : axes) {
    painter.HaloUnder(axis.pieces, 4.0);
    painter.Lines(axis.pieces, kAxisColor, 2.0, false);
  }
  for (const AxisStroke& axis : axes) {
    if (!axis.end_px || !camera.InImage(*axis.end_px, -32.0)) continue;
    painter.Text(*axis.end_px + Eigen::Vector2d(5, 4), std::string(1, axis.name), kAxisColor);
  }
}

void DrawFeatures(const CameraModel& camera, const MapSnapshot& snapshot,
                  const OverlayOptions& options, Painter& painter) {
  const auto draw = [&](const FeatureSnapshot& feature, bool fixated) {
    if (!feature.pixel || !feature.pixel->allFinite() || !camera.InImage(*feature.pixel, -8.0)) {
      return;
    }
    painter.Feature(*feature.pixel, feature.state, fixated);
  };
  const FeatureSnapshot* fixated = nullptr;
  for (const FeatureSnapshot& feature : snapshot.features) {
    if (options.fixated_feature == feature.id) {
      fixated = &feature;
    } else {
      draw(feature, false);
    }
  }
  if (fixated) draw(*fixated, true);  // on top
}

/// Under every stroke. One that is not to be trusted shows its outline alone.
void DrawPictures(const CameraModel& camera, const MapSnapshot& snapshot,
                  const std::vector<Annotation>& annotations, const OverlayOptions& options,
                  cv::Mat& picture) {
  if (!options.picture) return;
  for (const Annotation& annotation : annotations) {
    const Anchor& anchor = annotation.anchor;
    const bool trusted =
        anchor.state == AnchorState::kTracking || anchor.state == AnchorState::kProvisional;
    if (!annotation.picture || !anchor.place_known || !trusted) continue;
    const cv::Mat pixels = options.picture(annotation.picture);
    if (pixels.empty()) continue;
    DrawPinnedPicture(camera, snapshot.world_from_camera, annotation, pixels, picture);
  }
}

/// What others point at or draw now.
void DrawPointers(const CameraModel& camera, const MapSnapshot& snapshot,
                  const PointerList& pointers, Painter& painter) {
  const Rigid3 camera_from_world = snapshot.world_from_camera.Inverse();
  for (const LivePointer& pointer : pointers) {
    if (pointer.released || pointer.points->empty()) continue;
    if (pointer.kind == PointerKind::kSketch) {
      const std::vector<Polyline2> pieces =
          ProjectPolyline(camera, camera_from_world, *pointer.points);
      painter.HaloUnder(pieces, kHaloPx);
      painter.Lines(pieces, ColorOf(pointer.color_rgba), kLinePx, false);
      continue;
    }
    const std::optional<Eigen::Vector2d> at =
        camera.Project(camera_from_world * pointer.points->back());
    if (!at || !at->allFinite() || !camera.InImage(*at, -8.0)) continue;
    painter.Laser(*at, ColorOf(pointer.color_rgba));
    painter.Text(*at + painter.scale() * Eigen::Vector2d(10, 5), pointer.display_name,
                 ColorOf(pointer.color_rgba));
  }
}

void DrawAnnotations(const CameraModel& camera, const MapSnapshot& snapshot,
                     const std::vector<Annotation>& annotations, const OverlayOptions& options,
                     cv::Mat& picture, Painter& painter) {
  DrawPictures(camera, snapshot, annotations, options, picture);
  const Marks marks =
      AnnotationMarks(camera, snapshot.world_from_camera, annotations, snapshot.metric);
  const auto color = [&options](const std::string& id, std::uint32_t rgba) {
    return options.fixated_annotation == id ? kFixatedColor : ColorOf(rgba);
  };
  for (const Stroke& stroke : marks.strokes) painter.HaloUnder({stroke.points_px}, kHaloPx);
  for (const Stroke& stroke : marks.strokes) {
    painter.Lines({stroke.points_px}, color(stroke.annotation_id, stroke.color_rgba), kLinePx,
                  stroke.hollow);
  }
  std::vector<ColoredLabel> labels;
  for (const Label& label : marks.labels) {
    labels.push_back({&label, color(label.annotation_id, label.color_rgba)});
  }
  DrawLabels(std::move(labels), picture, painter);
  if (!options.edge_arrows) return;
  for (const EdgeArrow& arrow : marks.edge_arrows) {
    painter.EdgeArrow(arrow.tip_px, arrow.direction, color(arrow.annotation_id, arrow.color_rgba),
                      arrow.hollow);
  }
}

bool HasPose(const MapSnapshot& snapshot) {
  const Rigid3& pose = snapshot.world_from_camera;
  return (snapshot.status == TrackingStatus::kTracking ||
          snapshot.status == TrackingStatus::kCoasting) &&
         pose.translation.allFinite() && pose.rotation.coeffs().allFinite();
}

}  // namespace

std::string StatusLine(const MapSnapshot& snapshot) {
  const auto with = [&snapshot](const char* words, const char* advice) {
    const std::string& own = snapshot.advice;
    return absl::StrCat(words, own.empty() && *advice == '\0' ? "" : ": ",
                        own.empty() ? advice : own);
  };
  switch (snapshot.status) {
    case TrackingStatus::kInitialising:
      return with("starting", "move the camera sideways, slowly");
    case TrackingStatus::kTracking:
      switch (snapshot.quality) {
        case TrackingQuality::kGood:
          return with("tracking good", "");
        case TrackingQuality::kPoor:
          return with("tracking poor", "");
        case TrackingQuality::kBad:
          return with("tracking bad", "");
        case TrackingQuality::kUnknown:
          return with("tracking", "");
      }
      break;
    case TrackingStatus::kCoasting:
      return with("coasting", "too little is recognised");
    case TrackingStatus::kLost:
      return with("lost", "show a place seen before");
    case TrackingStatus::kRelocalising:
      return with("recovering", "hold still");
  }
  return "tracking";
}

cv::Mat Augment(const Frame& frame, const MapSnapshot& snapshot,
                const std::vector<Annotation>& annotations, const OverlayOptions& options) {
  cv::Mat picture;
  if (frame.color.empty()) {
    cv::cvtColor(frame.grey, picture, cv::COLOR_GRAY2BGR);
  } else {
    frame.color.copyTo(picture);
  }
  Painter painter(picture);
  const CameraModel& camera = *frame.camera;
  // Without a pose nothing can be registered: better no mark than one in the wrong place.
  if (HasPose(snapshot)) {
    if (options.scene) {
      const cv::Mat scene = options.scene(camera, snapshot.world_from_camera);
      if (scene.size() == picture.size()) Blend(scene, picture);
    }
    if (options.world_axes) DrawAxes(camera, snapshot, painter);
    if (options.features) DrawFeatures(camera, snapshot, options, painter);
    if (options.annotations)
      DrawAnnotations(camera, snapshot, annotations, options, picture, painter);
    if (options.pointers) DrawPointers(camera, snapshot, *options.pointers, painter);
  }
  if (options.status_line) {
    painter.Status(StatusLine(snapshot), snapshot.status != TrackingStatus::kTracking);
  }
  return picture;
}

}  // namespace saccade
