#include "client/view/pointer.hpp"

#include <cmath>
#include <utility>

namespace saccade::view {
namespace {

constexpr double kPick = 22;       // a fingertip's half, at scale 1
constexpr float kClick = 4;        // farther than this it is a drag
constexpr double kTurnRad = 0.12;  // by a key
constexpr double kRadPerWidth = 4;

}  // namespace

std::optional<Pointer::Target> Pointer::PaneAt(float x, float y, const Layout& layout,
                                               const Desk& desk) {
  const Pane main = desk.state().main;
  const Pane other = main == Pane::kMap ? Pane::kVideo : Pane::kMap;
  if (layout.inset.Contains(x, y)) return Target{other, layout.inset};
  if (layout.main.Contains(x, y)) return Target{main, layout.main};
  return std::nullopt;
}

Pointer::Place Pointer::PlaceAt(float x, float y, const Target& target, const Desk& desk,
                                const DeskView& view, float scale) {
  Place place;
  if (target.pane == Pane::kMap) {
    place.view = desk.map_view(target.rect);
    place.pixel = {x - target.rect.x - 0.5, y - target.rect.y - 0.5};
    place.pick_px = kPick * scale;
    place.inside = true;
    return place;
  }
  const Placement at = view.VideoIn(target.rect);
  place.view = desk.video_view();
  place.pixel = at.PixelAt(x, y);
  place.pick_px = kPick * scale / at.scale;
  const decode::Picture* picture = desk.shown();
  place.inside = picture != nullptr && place.pixel.x() >= -0.5 && place.pixel.y() >= -0.5 &&
                 place.pixel.x() <= picture->rgba.cols - 0.5 &&
                 place.pixel.y() <= picture->rgba.rows - 0.5;
  return place;
}

void Pointer::Handle(const InputEvent& event, const Layout& layout, Desk& desk,
                     const DeskView& view, bool over_panes, LayoutSettings& settings,
                     Timestamp now_ns) {
  using Kind = InputEvent::Kind;
  switch (event.kind) {
    case Kind::kPress:
      if (over_panes && what_ == What::kNothing) Press(event, layout, desk, view);
      break;
    case Kind::kMove:
      Move(event, layout, desk, view, settings, over_panes);
      break;
    case Kind::kRelease:
      Release(event, layout, desk, view, now_ns);
      break;
    case Kind::kLeave:
      if (what_ == What::kNothing) {
        desk.HoverAt(Pane::kMap, std::nullopt, nullptr, 0);
        desk.HoverAt(Pane::kVideo, std::nullopt, nullptr, 0);
      }
      break;
    case Kind::kScroll: {
      const std::optional<Target> target = PaneAt(event.x, event.y, layout, desk);
      if (!over_panes || !target || target->pane != Pane::kMap) break;
      const tools::View eye = desk.map_view(target->rect);
      const double focal = eye.camera->intrinsics().fx;
      const Rect& rect = target->rect;
      desk.orbit().Zoom(std::pow(0.85, event.scroll),
                        (event.x - rect.x - 0.5f * rect.width) / focal,
                        (event.y - rect.y - 0.5f * rect.height) / focal);
      desk.Hold();
      break;
    }
    case Kind::kDrop: {
      const std::optional<Target> target = PaneAt(event.x, event.y, layout, desk);
      if (!over_panes || !target) break;
      const Place place = PlaceAt(event.x, event.y, *target, desk, view, layout.scale);
      desk.DropFile(event.file, target->pane, place.pixel, place.view ? &*place.view : nullptr,
                    now_ns);
      break;
    }
    case Kind::kKey:
    case Kind::kLet:
      break;
  }
  last_x_ = event.x;
  last_y_ = event.y;
}

void Pointer::Press(const InputEvent& event, const Layout& layout, Desk& desk,
                    const DeskView& view) {
  start_x_ = event.x;
  start_y_ = event.y;
  moved_ = false;
  if (layout.panel_edge.Contains(event.x, event.y)) {
    what_ = What::kPanelEdge;
    return;
  }
  if (layout.inset_edge.Contains(event.x, event.y)) {
    what_ = What::kInsetEdge;
    return;
  }
  const std::optional<Target> target = PaneAt(event.x, event.y, layout, desk);
  if (!target) return;
  target_ = *target;
  const bool area = event.ctrl || desk.state().tool == tools::Action::kArea;
  if (target->pane == Pane::kMap && (event.button != 0 || (event.shift && !area))) {
    what_ = What::kPan;
    return;
  }
  if (event.button != 0) return;
  const Place place = PlaceAt(event.x, event.y, target_, desk, view, layout.scale);
  if (!place.inside) return;
  what_ = What::kPane;
  desk.Press(target_.pane, place.pixel, place.view ? &*place.view : nullptr, place.pick_px,
             {.shift = event.shift, .ctrl = event.ctrl});
}

void Pointer::Move(const InputEvent& event, const Layout& layout, Desk& desk, const DeskView& view,
                   LayoutSettings& settings, bool over_panes) {
  const float dx = event.x - last_x_, dy = event.y - last_y_;
  desk.state().key_place.reset();
  moved_ = moved_ || std::hypot(event.x - start_x_, event.y - start_y_) > kClick * layout.scale;
  over_edge_ = what_ == What::kPanelEdge || what_ == What::kInsetEdge;
  switch (what_) {
    case What::kPanelEdge:
      return DragPanelEdge(layout, event.x, layout.header.width, settings);
    case What::kInsetEdge:
      return DragInsetEdge(layout, event.x, settings);
    case What::kPan:
      if (!moved_) return;
      desk.orbit().Pan(-dx / target_.rect.height, -dy / target_.rect.height);
      return desk.Hold();
    case What::kOrbit:
      desk.orbit().Rotate(kRadPerWidth * dx / target_.rect.width,
                          kRadPerWidth * dy / target_.rect.width);
      return desk.Hold();
    case What::kPane: {
      const bool turns = target_.pane == Pane::kMap && !desk.dragging_mark();
      if (turns && moved_) {
        what_ = What::kOrbit;
        return;
      }
      const Place place = PlaceAt(event.x, event.y, target_, desk, view, layout.scale);
      return desk.Drag(target_.pane, place.pixel, place.view ? &*place.view : nullptr);
    }
    case What::kNothing:
      break;
  }
  if (!over_panes) {
    desk.HoverAt(Pane::kMap, std::nullopt, nullptr, 0);
    return desk.HoverAt(Pane::kVideo, std::nullopt, nullptr, 0);
  }
  over_edge_ =
      layout.panel_edge.Contains(event.x, event.y) || layout.inset_edge.Contains(event.x, event.y);
  const std::optional<Target> target = PaneAt(event.x, event.y, layout, desk);
  for (const Pane pane : {Pane::kMap, Pane::kVideo}) {
    if (!target || target->pane != pane) desk.HoverAt(pane, std::nullopt, nullptr, 0);
  }
  if (!target) return;
  const Place place = PlaceAt(event.x, event.y, *target, desk, view, layout.scale);
  std::optional<Eigen::Vector2d> pixel;
  if (place.inside) pixel = place.pixel;
  desk.HoverAt(target->pane, pixel, place.view ? &*place.view : nullptr, place.pick_px);
}

void Pointer::Release(const InputEvent& event, const Layout& layout, Desk& desk,
                      const DeskView& view, Timestamp now_ns) {
  const What what = std::exchange(what_, What::kNothing);
  // With Shift and without moving it is a click.
  const bool adds = what == What::kPan && !moved_ && event.button == 0;
  if (what != What::kPane && !adds) return;
  const Place place = PlaceAt(event.x, event.y, target_, desk, view, layout.scale);
  if (adds) {
    desk.Press(target_.pane, place.pixel, place.view ? &*place.view : nullptr, place.pick_px,
               {.shift = true});
  }
  desk.Release(target_.pane, place.pixel, place.view ? &*place.view : nullptr,
               {moved_, event.x, event.y, event.shift || adds}, now_ns);
}

void Pointer::Paste(const Layout& layout, Desk& desk, const DeskView& view, Timestamp now_ns) {
  std::optional<Target> target = PaneAt(last_x_, last_y_, layout, desk);
  float x = last_x_, y = last_y_;
  if (!target) {
    target = Target{desk.state().main, layout.main};
    x = layout.main.x + 0.5f * layout.main.width;
    y = layout.main.y + 0.5f * layout.main.height;
  }
  const Place place = PlaceAt(x, y, *target, desk, view, layout.scale);
  std::optional<Eigen::Vector2d> pixel;
  if (place.inside) pixel = place.pixel;
  desk.Paste(target->pane, pixel, place.view ? &*place.view : nullptr, now_ns);
}

Pointer::KeyPlace Pointer::KeyPlaceOf(const Layout& layout, const Desk& desk,
                                      const DeskView& view) {
  const Rect& main = layout.main;
  KeyPlace at{{desk.state().main, main}, main.x + 0.5f * main.width, main.y + 0.5f * main.height};
  const decode::Picture* picture = desk.shown();
  const auto& place = desk.state().key_place;
  if (at.target.pane == Pane::kVideo && place && picture != nullptr) {
    const Placement video = view.VideoIn(main);
    at.x = video.left + video.scale * static_cast<float>(place->x() * picture->rgba.cols);
    at.y = video.top + video.scale * static_cast<float>(place->y() * picture->rgba.rows);
  }
  return at;
}

void Pointer::Enter(const InputEvent& event, const KeyPlace& at, float scale, Desk& desk,
                    const DeskView& view, Timestamp now_ns) {
  const Place place = PlaceAt(at.x, at.y, at.target, desk, view, scale);
  const tools::View* eye = place.view ? &*place.view : nullptr;
  const Pane pane = at.target.pane;
  if (held_by_key_) {
    desk.Release(*std::exchange(held_by_key_, std::nullopt), place.pixel, eye,
                 {true, at.x, at.y, event.shift}, now_ns);
    return;
  }
  if (!place.inside) return;
  desk.Press(pane, place.pixel, eye, place.pick_px,
             {.shift = event.shift, .ctrl = false, .by_key = true});
  if (desk.holding()) {
    held_by_key_ = pane;
    return desk.state().Refuse(pane == Pane::kMap ? "map" : "video",
                               "Held: move, then Enter lets go; Esc gives up.", now_ns);
  }
  desk.Release(pane, place.pixel, eye, {false, at.x, at.y, event.shift}, now_ns);
}

bool Pointer::MoveKeyPlace(const std::string& key, bool far, Desk& desk) {
  const double step = far ? 0.06 : 0.01;  // of the picture
  Eigen::Vector2d by = Eigen::Vector2d::Zero();
  if (key == "left") by.x() = -step;
  if (key == "right") by.x() = step;
  if (key == "up") by.y() = -step;
  if (key == "down") by.y() = step;
  if (by.isZero()) return false;
  auto& place = desk.state().key_place;
  const Eigen::Vector2d to = place.value_or(Eigen::Vector2d(0.5, 0.5)) + by;
  place = Eigen::Vector2d(to.cwiseMax(0.01).cwiseMin(0.99));
  return true;
}

bool Pointer::MoveEye(const std::string& key, bool pans, Desk& desk) {
  const auto arrow = [&](double right, double down) {
    if (pans) {
      desk.orbit().Pan(0.05 * right, 0.05 * down);
    } else {
      desk.orbit().Rotate(kTurnRad * right, -kTurnRad * down);
    }
  };
  if (key == "left") {
    arrow(-1, 0);
  } else if (key == "right") {
    arrow(1, 0);
  } else if (key == "up") {
    arrow(0, -1);
  } else if (key == "down") {
    arrow(0, 1);
  } else if (key == "+") {
    desk.orbit().Zoom(0.85);
  } else if (key == "-") {
    desk.orbit().Zoom(1 / 0.85);
  } else {
    return false;
  }
  desk.Hold();
  return true;
}

bool Pointer::HandleKey(const InputEvent& event, const Layout& layout, Desk& desk,
                        const DeskView& view, Timestamp now_ns) {
  const std::string& key = event.key.key;
  if (event.key.ctrl || event.key.alt || event.key.super) return false;
  if (key == "enter") {
    if (!event.repeat) {
      Enter(event, KeyPlaceOf(layout, desk, view), layout.scale, desk, view, now_ns);
    }
    return true;
  }
  const bool video = desk.state().main == Pane::kVideo;
  const bool moved = video && MoveKeyPlace(key, event.shift, desk);
  if (!moved && !MoveEye(key, event.shift, desk)) return false;
  const KeyPlace at = KeyPlaceOf(layout, desk, view);
  const Place place = PlaceAt(at.x, at.y, at.target, desk, view, layout.scale);
  const tools::View* eye = place.view ? &*place.view : nullptr;
  if (held_by_key_ == at.target.pane) {
    desk.Drag(at.target.pane, place.pixel, eye);
  } else if (moved && place.inside) {
    desk.HoverAt(at.target.pane, place.pixel, eye, place.pick_px);
  }
  return true;
}

}  // namespace saccade::view
