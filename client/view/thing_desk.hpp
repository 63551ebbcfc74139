#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "client/session/marker_fixing.hpp"
#include "client/tools/measured.hpp"
#include "client/tools/overlays.hpp"
#include "client/tools/registering.hpp"
#include "client/view/layout.hpp"

namespace saccade::view {

/// Things of the scene: what a click does with them, what was clicked so far, and what came of the
/// last one.
struct ThingDesk {
  enum class Click { kSelect, kMove, kPlace, kInside, kMeasure, kOverlay, kRegister };
  Click click = Click::kSelect;
  std::string model;  // kPlace, kInside: the name of a model of the server or of the library
  SceneShape shape = SceneShape::kPlane;                   // kMeasure
  tools::OverlayKind overlay = tools::OverlayKind::kGrid;  // kOverlay
  tools::Measuring measuring;
  tools::Overlaying overlaying;
  tools::Registering registering;
  session::Marker marker{"apriltag36h11", 0, 0.08};  // as the fields of the panel have it
  std::string selected_id;                           // empty: none
  std::string said;
  bool warn = false;
  std::uint32_t tells = 0;              // how often something was said
  bool busy = false;                    // the server is asked; what comes meanwhile is passed over
  std::map<std::string, Rect> buttons;  // where the panel's are now, by their words; for tests
};

}  // namespace saccade::view
