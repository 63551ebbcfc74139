#pragma once

#include <string>
#include <vector>

#include "client/session/state.hpp"

namespace saccade::tools {

/// What lengths mean now.
struct Scale {
  bool metric = false;
  std::optional<Eigen::Vector3d> eye_in_world;  // the wearer's camera
};
Scale ScaleOf(const session::State& state);

/// Which of its expected errors is above its limit; without scale there are no millimetres.
struct Excess {
  bool mm = false, px = false;
};
Excess ExcessOf(const Anchor& anchor, const Scale& scale);

/// An anchor whose place is not to be relied upon (drawn hollow and named so): as the server judges
/// it, and while it is provisional and not judged yet, by its expected error.
bool DoNotTrust(const Anchor& anchor, const Scale& scale);

/// Which marks are listed and drawn.
struct MarkFilter {
  std::string text;
  bool mine = false;
  bool active() const { return mine || !text.empty(); }
};
/// True if every word of `filter.text` is in its text, its shape or its author's name, whatever the
/// case; `me`: the name whose marks are mine.
bool Passes(const Annotation& annotation, const MarkFilter& filter, const std::string& me);

/// "cube", "note", "stroke", "check list".
const char* ShapeWord(AnnotationShape shape);
/// What a mark is called in a line: "note “oil”", "the cube".
std::string TitleOf(const Annotation& annotation);

/// A stroke while it is drawn, in the picture of one frame: points nearer than 2 px to the last one
/// are left out, each is smoothed with its neighbours, at most 2000 are kept.
class InkLine {
 public:
  void Begin(FrameId frame_id, const Eigen::Vector2d& pixel);
  void Add(const Eigen::Vector2d& pixel);
  void Cancel() { points_.clear(); }
  bool drawing() const { return !points_.empty(); }
  FrameId frame_id() const { return frame_id_; }
  const std::vector<Eigen::Vector2d>& points() const { return points_; }
  /// What is sent; empty if it is no stroke (fewer than two points). Ends it.
  std::vector<Eigen::Vector2d> Finish();

 private:
  FrameId frame_id_ = 0;
  std::vector<Eigen::Vector2d> points_;
};

}  // namespace saccade::tools
