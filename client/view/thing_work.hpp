#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/session/marker_fixing.hpp"
#include "client/session/session.hpp"
#include "client/session/thing_edits.hpp"
#include "client/view/desk_state.hpp"

namespace saccade::view {

/// Where a pane was clicked.
struct ThingSpot {
  tools::View view;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  RayTarget ray;
  std::optional<tools::Landing> landing;
  double near_px = 0;  // how far away something may be that is meant [px of the view]
};

/// What is made of things by several clicks: measured, laid over a room, registered; and what is
/// fixed to markers. The thread that draws.
class ThingWork {
 public:
  ThingWork(session::Session& session, session::ThingEdits& edits, DeskState& state)
      : session_(session), edits_(edits), desk_(state), markers_(edits) {}

  void Say(const std::string& words, bool warn = false);
  void Refuse(const Where& where, const std::string& why);
  /// For the answer to one change: selects the thing, and says what came of it.
  session::ThingEdits::Done Tell(const Where& where = "");

  /// Another click was chosen, or another thing: what was begun is given up, and the next click
  /// said.
  void Begin();
  /// Gives up what was begun; false: that is nothing.
  bool Cancel();
  void Click(const Where& where, const ThingSpot& spot);
  /// True while points of a way are clicked, which Finish() ends.
  bool has_way() const { return !things().overlaying.points().empty(); }
  void Finish(const Where& where);
  /// Moves the thing to where its pairs of points put it.
  void Accept();
  void DropPair(std::size_t index);
  /// A picture or a cabinet's inside, drawn through the surface that was clicked. `file`: GLB;
  /// empty: `model` is on the server.
  void ShowInside(const Where& where, const ThingSpot& spot, const std::string& model,
                  const std::string& file);

  /// The selected thing, to the marker of the panel's fields. `markers`: of the picture shown.
  void FixToMarker(std::span<const MarkerPose> markers);
  void LetGo(std::span<const MarkerPose> markers);
  void Check(Timestamp now_ns, std::span<const MarkerPose> markers) {
    markers_.Check(now_ns, markers);
  }

 private:
  ThingDesk& things() const { return desk_.things; }
  const Scene& scene() const { return session_.state().scene.scene(); }
  std::string Hint() const;
  void Measure(const Where& where, const ThingSpot& spot);
  void Lay(const Where& where, const ThingSpot& spot);
  void Laid(const tools::Overlay& overlay, const Where& where);
  void Pair(const Where& where, const ThingSpot& spot);
  void Solve();
  /// Only a map without metres can tell a model's size.
  bool WithScale() const;
  std::optional<tools::OverlayPoint> PointOf(const ThingSpot& spot) const;
  std::optional<Rigid3> PlaceOf(const SceneObject& thing,
                                std::span<const MarkerPose> markers) const;
  /// Numbers what was clicked so far, in both panes.
  void ShowPoints();

  session::Session& session_;
  session::ThingEdits& edits_;
  DeskState& desk_;
  session::MarkerFixing markers_;
  std::vector<std::string> pins_;  // ids of the marks that number the points
};

/// "box: 0.300 × 0.200 × 0.100 m".
std::string SizeWords(const SceneObject& thing);

}  // namespace saccade::view
