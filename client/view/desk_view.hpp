#pragma once

#include <absl/status/statusor.h>
#include <imgui.h>

#include <memory>

#include "client/view/desk.hpp"
#include "client/view/map_scene.hpp"
#include "client/view/painter.hpp"
#include "client/view/picture_layer.hpp"
#include "client/view/thing_layer.hpp"
#include "shared/render/texture.hpp"

namespace saccade::view {

/// How the window's units relate to what is drawn.
struct Canvas {
  float scale = 1;        // of the interface
  float pixel_ratio = 1;  // framebuffer pixels by screen coordinate
  float window_height = 0;
};

/// Draws one desk's two panes: the map and the video, each with the marks of exactly what it shows.
/// Lives on the thread of its OpenGL context.
class DeskView {
 public:
  static absl::StatusOr<std::unique_ptr<DeskView>> Create(const GlFunctions& gl, Desk& desk);

  /// Puts the newest picture and map on the graphics card.
  void Update();
  /// Draws a pane into `list`, over whatever stands there.
  void Draw(Pane pane, const Rect& rect, const Canvas& canvas, ImDrawList* list, Timestamp now_ns);
  /// Where the video's picture stands in a pane.
  Placement VideoIn(const Rect& rect) const;
  /// Width by height of the picture.
  float aspect() const;

 private:
  DeskView(const GlFunctions& gl, Desk& desk) : gl_(gl), desk_(desk), pictures_(gl, desk) {}

  void DrawMap(const Rect& rect, const Canvas& canvas, ImDrawList* list);
  void DrawVideo(const Rect& rect, const Canvas& canvas, ImDrawList* list);
  void DrawFeatures(const net::FrameFacts& facts, const tools::View& view, Painter& painter) const;
  Marks MarksIn(const tools::View& view) const;
  std::vector<std::string> Accented() const;
  void DrawLanding(Pane pane, const tools::View& view, Painter& painter) const;
  /// What is under way with the selected marks: a handle, a rectangle, the place that keys point
  /// at.
  void DrawGrips(Pane pane, const tools::View& view, Painter& painter) const;
  void DrawSelectedThing(const tools::View& view, Painter& painter) const;
  void DrawSight(const tools::View& view, Painter& painter) const;
  std::string Note(Pane pane, Timestamp now_ns) const;
  static void OnMap(const ImDrawList* list, const ImDrawCmd* command);

  const GlFunctions& gl_;
  Desk& desk_;
  std::unique_ptr<MapScene> scene_;
  PictureLayer pictures_;
  std::unique_ptr<ThingLayer> things_;
  std::unique_ptr<Texture> texture_;
  int texture_width_ = 0, texture_height_ = 0;
  const void* on_card_ = nullptr;  // the pixels that the texture has
  // What the callback in ImGui's list draws.
  tools::View eye_;
  Eigen::Vector4i viewport_ = Eigen::Vector4i::Zero();
  float point_px_ = 7;
};

}  // namespace saccade::view
