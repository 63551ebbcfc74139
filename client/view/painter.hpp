#pragma once

#include <imgui.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "client/view/layout.hpp"
#include "shared/marks/strokes.hpp"
#include "shared/scene/map_snapshot.hpp"

namespace saccade::view {

/// Draws pixels of a view where its picture stands in the window, as the page's painter does.
class Painter {
 public:
  /// `pane`: what is drawn in, and clipped to; pixel (0, 0)'s centre stands half a picture pixel
  /// from (`left`, `top`), a picture pixel is `scale` wide; `unit`: of lines and words.
  Painter(ImDrawList* list, const Rect& pane, float left, float top, float scale, float unit);
  ~Painter();
  Painter(const Painter&) = delete;
  Painter& operator=(const Painter&) = delete;

  /// Lines with a dark halo, a hollow one dashed; accented ones in that colour and above the rest.
  void Draw(const Marks& marks, const std::vector<std::string>& accented);
  /// Towards marks outside the picture: filled, or an outline where not to be trusted.
  void EdgeArrows(const std::vector<EdgeArrow>& arrows, const std::vector<std::string>& accented);
  /// Colour and shape by state: disc measured, cross failed, ring not attempted.
  void Feature(const Eigen::Vector2d& at, FeatureState state);
  /// The fixation target: a ring with four ticks, solid once it is held, and few words beside it.
  void Target(const Eigen::Vector2d& at, bool held, const std::string& words);
  /// The optic axis: what is held appears here.
  void Centre(const Eigen::Vector2d& at);
  void Axes(const std::array<AxisStroke, 3>& axes);
  /// Where a click lands: a ring as large as its uncertainty [px of the view].
  void Ring(const Eigen::Vector2d& at, std::optional<double> radius_px, const std::string& words);
  /// Where somebody points: a disc over a halo, the name beside it.
  void Laser(const Eigen::Vector2d& at, ImU32 color, const std::string& name);
  /// What turns the selected mark: a ring with an arc round it.
  void Handle(const Eigen::Vector2d& at);
  /// A rectangle that is drawn round marks.
  void Area(const Eigen::Vector2d& from, const Eigen::Vector2d& to);
  /// A part of a texture, from its corner `first` to `last` (0 to 1), onto four pixels: upper left,
  /// upper right, lower right, lower left.
  void Image(unsigned texture, const std::array<Eigen::Vector2d, 4>& corners, ImVec2 first,
             ImVec2 last);
  void Line(const Polyline2& line, ImU32 color, bool dashed = false);
  void Words(ImVec2 at, const std::string& words, ImU32 color);

  ImVec2 At(const Eigen::Vector2d& pixel) const;

 private:
  void Stroke(const std::vector<ImVec2>& points, ImU32 color, float width, bool closed = false);
  void Dashes(const std::vector<ImVec2>& points, ImU32 color, float width, float dash);
  void Tag(const Label& label, ImU32 color, bool whole, std::vector<Rect>* taken);
  /// Signs are smaller on a small picture, where they lie closer together.
  float thinning() const;

  ImDrawList* list_;
  Rect pane_;
  float left_, top_, scale_, unit_;
};

}  // namespace saccade::view
