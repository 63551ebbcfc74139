// What clicks and keys do to marks.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "client/tools/words.hpp"
#include "client/tools/written.hpp"
#include "client/view/desk.hpp"
#include "client/view/patch.hpp"

namespace saccade::view {
namespace {

constexpr double kBoxM = 0.1;
constexpr Timestamp kPointNs = 25'000'000;  // between two words of a laser pointer

}  // namespace

std::vector<Annotation> Desk::Drawn() const {
  std::vector<Annotation> drawn = session().annotations.List();
  std::erase_if(drawn, [this](const Annotation& each) { return !state_.Draws(each); });
  return drawn;
}

std::optional<tools::Landing> Desk::LandingAt(Pane pane, const Eigen::Vector2d& pixel,
                                              const tools::View* view) const {
  if (view == nullptr) return std::nullopt;
  if (pane == Pane::kMap) return tools::LandingInMap(*view, pixel, session().features);
  const decode::Picture* picture = shown();
  if (picture == nullptr || !view->camera->InImage(pixel, -0.5)) return std::nullopt;
  auto landing = tools::LandingInVideo(*view, picture->facts->frame_id, pixel, session().features);
  // A frozen picture is clicked late, a note when its text is done.
  const std::optional<AnnotationShape> shape = tools::ShapeOf(state_.tool);
  const bool late = state_.still || shape == AnnotationShape::kNote ||
                    shape == AnnotationShape::kCheckList || shape == AnnotationShape::kPicture;
  if (landing && late && same_map()) {
    if (const auto ray = tools::RayThrough(*view, pixel)) landing->later = *ray;
  }
  return landing;
}

std::string Desk::WhyNoLanding(Pane pane) const {
  if (pane == Pane::kMap) return "nothing is mapped there.";
  if (picture_paused()) return absl::StrCat(tools::PauseWords(*session().pause), ".");
  if (shown() == nullptr) return "there is no picture yet.";
  return video_view() ? "that is outside the picture." : "where the camera is is not known now.";
}

void Desk::HoverAt(Pane pane, const std::optional<Eigen::Vector2d>& pixel, const tools::View* view,
                   double pick_px) {
  if (state_.tool == tools::Action::kSelect || state_.tool == tools::Action::kArea) {
    state_.hover.reset();
    const Annotation* picked = nullptr;
    const std::vector<Annotation> drawn = Drawn();
    if (pixel && view != nullptr) picked = tools::PickNearest(*view, *pixel, drawn, pick_px);
    state_.pointed_id = picked == nullptr ? "" : picked->id;
  } else if (pixel) {
    state_.hover = Hover{pane, *pixel, LandingAt(pane, *pixel, view)};
  } else if (state_.hover && state_.hover->pane == pane) {
    state_.hover.reset();
  }
}

void Desk::Press(Pane pane, const Eigen::Vector2d& pixel, const tools::View* view, double pick_px,
                 const Held& held) {
  pressed_ = Pressed{LandingAt(pane, pixel, view), "", std::nullopt};
  if (const auto ray = view != nullptr ? tools::RayThrough(*view, pixel) : std::nullopt) {
    pressed_->spot = ThingSpot{*view, pixel, *ray, pressed_->landing, pick_px};
  }
  const decode::Picture* picture = shown();
  if (pane == Pane::kVideo && picture != nullptr) {
    pressed_pixel_ = PixelTarget{picture->facts->frame_id, pixel};
  }
  const std::vector<Annotation> drawn = Drawn();
  if (view != nullptr) {
    if (const Annotation* picked = tools::PickNearest(*view, pixel, drawn, pick_px)) {
      pressed_->picked_id = picked->id;
    }
  }
  if (state_.tool == tools::Action::kInk && pane == Pane::kVideo && pressed_->landing) {
    // One stroke is of one picture: it stands still until the stroke is done.
    if (!state_.still) Freeze(MonotonicNow());
    state_.ink.Begin(picture->facts->frame_id, pixel);
    BeginSketch();
  }
  const bool draws = state_.tool == tools::Action::kBox ||
                     (state_.tool == tools::Action::kInk && pane == Pane::kMap);
  if (draws && !held.by_key && pressed_->landing && view != nullptr) {
    BeginDrawing(pane, pixel, *view);
  }
  if (state_.tool == tools::Action::kLaser && pressed_->landing && session().link.live()) {
    laser_id_ = net::RandomUuid();
    PointAt(pressed_->landing->target, false);
  }
  const bool selects = state_.tool == tools::Action::kSelect;
  if (state_.tool == tools::Action::kArea || (selects && held.ctrl)) {
    state_.area = Area{pane, pixel, pixel};
    return;
  }
  if (!selects || held.shift || view == nullptr) return;
  if (GripHandle(pixel, *view, pick_px)) return;
  if (state_.selection.Has(pressed_->picked_id)) {
    moving_ = pressed_->picked_id;
  } else if (pressed_->picked_id.empty() && pane == Pane::kVideo && !held.by_key) {
    state_.area = Area{pane, pixel, pixel};
  }
}

void Desk::Drag(Pane pane, const Eigen::Vector2d& pixel, const tools::View* view) {
  if (state_.ink.drawing() && pane == Pane::kVideo) {
    const std::size_t before = state_.ink.points().size();
    state_.ink.Add(pixel);
    if (sketch_ && state_.ink.points().size() > before) {
      sketch_->Add(PixelTarget{state_.ink.frame_id(), pixel});
    }
    TellSketches(MonotonicNow());
  }
  if (state_.area) state_.area->to = pixel;
  if (turning_ && view != nullptr) DragHandle(pixel, *view);
  if (drawing_ && view != nullptr) Draw(pane, pixel, *view);
  if (laser_id_.empty() || MonotonicNow() - pointed_ns_ < kPointNs) return;
  if (const auto landing = LandingAt(pane, pixel, view)) PointAt(landing->target, false);
}

/// Never stored; without a word for a second it is gone by itself.
void Desk::PointAt(const AnnotationTarget& target, bool released) {
  pointed_ns_ = MonotonicNow();
  pointed_at_ = target;
  edits_.Point({.stroke_id = laser_id_,
                .targets = {target},
                .released = released,
                .color_rgba = state_.color_rgba},
               Tell("Laser pointer"));
  if (released) laser_id_.clear();
}

void Desk::Release(Pane pane, const Eigen::Vector2d& pixel, const tools::View* view,
                   const Lift& lift, Timestamp now_ns) {
  if (!pressed_) return;
  const Pressed pressed = *std::exchange(pressed_, std::nullopt);
  const Where where = NameOf(pane);
  if (!laser_id_.empty()) {
    const std::optional<tools::Landing> landing = LandingAt(pane, pixel, view);
    return PointAt(landing ? landing->target : pressed.landing->target, true);
  }
  if (state_.tool == tools::Action::kLaser) return;
  if (state_.ink.drawing()) {
    std::vector<Eigen::Vector2d> ink = state_.ink.Finish();
    if (ink.empty()) {
      EndSketch();
      return state_.Refuse(where, "Nothing drawn: press, and move while you hold.", now_ns);
    }
    Place(AnnotationShape::kInk, *pressed.landing, "", std::move(ink), where);
    state_.still.reset();
    return;
  }
  if (drawing_ && (lift.moved || !drawing_->points.empty())) {
    return FinishDrawing(pane, pixel, view, where, now_ns);
  }
  if (drawing_) DropDrawing();
  if (turning_) {
    if (lift.moved && view != nullptr) DragHandle(pixel, *view);
    return DropHandle(lift.moved, where);
  }
  if (state_.area && lift.moved) {
    state_.area->to = pixel;
    return SelectArea(view, lift.adds, now_ns);
  }
  state_.area.reset();
  if (moving_ && lift.moved) {
    const std::string id = *std::exchange(moving_, std::nullopt);
    const std::optional<tools::Landing> landing = LandingAt(pane, pixel, view);
    if (!landing) {
      return state_.Refuse(where, absl::StrCat("Not moved: ", WhyNoLanding(pane)), now_ns);
    }
    return MoveSelected(id, *landing, where);
  }
  moving_.reset();
  if (lift.moved) return;
  const auto refuse = [&](const char* what) {
    state_.Refuse(where, absl::StrCat(what, WhyNoLanding(pane)), now_ns);
  };
  if (state_.tool == tools::Action::kThings) return UseThings(pane, pressed.spot);
  if (state_.tool == tools::Action::kGaze) {
    if (!pressed.picked_id.empty()) return LookAtMark(pressed.picked_id, where, now_ns);
    if (!pressed.landing) return refuse("Not turned: ");
    return Look(*pressed.landing, where, now_ns);
  }
  const std::optional<AnnotationShape> shape = tools::ShapeOf(state_.tool);
  if (!shape) {
    if (!lift.adds && state_.tool != tools::Action::kArea) state_.selection.Clear();
    if (!pressed.picked_id.empty()) state_.selection.Toggle(pressed.picked_id);
    return;
  }
  if (!session().link.live()) {
    return state_.Refuse(where, "Not placed: no connection to the server.", now_ns);
  }
  if (!pressed.landing) return refuse("Not placed: ");
  if (*shape == AnnotationShape::kInk) {
    return state_.Refuse(where, "Nothing drawn: press, and move while you hold.", now_ns);
  }
  if (*shape == AnnotationShape::kNote) {
    state_.editor = TextEditor{pressed.landing, "", pane, lift.x, lift.y, "", false};
    return;
  }
  if (*shape == AnnotationShape::kCheckList || *shape == AnnotationShape::kPicture) {
    state_.dialog.emplace();
    state_.dialog->shape = *shape;
    state_.dialog->landing = *pressed.landing;
    state_.dialog->pane = pane;
    return;
  }
  if (*shape == AnnotationShape::kMeasure && !state_.measure_from) {
    state_.measure_from = pressed.landing;
    return;
  }
  Place(*shape, *pressed.landing, "", {}, where);
}

void Desk::Place(AnnotationShape shape, const tools::Landing& landing, const std::string& text,
                 std::vector<Eigen::Vector2d> ink, const Where& where) {
  session::Edits::Placement placement;
  placement.draft.shape = shape;
  placement.draft.text = text;
  placement.draft.color_rgba = state_.color_rgba;
  placement.draft.target = landing.target;
  placement.draft.ink_px = std::move(ink);
  if (shape == AnnotationShape::kBox) {
    placement.draft.extent_m = Eigen::Vector3d::Constant(kBoxM);
    placement.draft.size_m = kBoxM;
  }
  if (shape == AnnotationShape::kMeasure) {
    const tools::Landing from = *std::exchange(state_.measure_from, std::nullopt);
    placement.draft.target = from.target;
    placement.draft.end_target = landing.target;
  } else if (shape != AnnotationShape::kInk) {
    placement.later = landing.later;
    placement.guess_in_world = landing.point_in_world;
  }
  const session::Edits::Done tell = Tell(where, "Not placed: ");
  const auto sketch = shape == AnnotationShape::kInk ? std::exchange(sketch_, nullptr) : nullptr;
  edits_.Place(std::move(placement), [this, tell, sketch](const absl::StatusOr<std::string>& id) {
    if (id.ok()) state_.selection.Only(*id);
    if (sketch) sketch->End();  // not before: nobody sees it go and come back
    tell(id);
  });
}

void Desk::EditText(const std::string& id, float x, float y) {
  const Annotation* annotation = session().annotations.Find(id);
  if (annotation == nullptr) return;
  state_.editor = TextEditor{std::nullopt, id, Pane::kMap, x, y, annotation->text, false};
}

void Desk::FinishEditor(bool keep, Timestamp now_ns) {
  if (!state_.editor) return;
  const TextEditor editor = *std::exchange(state_.editor, std::nullopt);
  const std::string text = tools::CleanText(editor.text);
  if (!keep) return;
  if (!editor.id.empty()) {
    return edits_.Update(PatchOf(editor.id, &AnnotationPatch::text, text),
                         Tell(absl::StrCat("annotation ", editor.id)));
  }
  if (text.empty()) {
    return state_.Refuse(NameOf(editor.pane), "Not placed: a note needs a text.", now_ns);
  }
  Place(AnnotationShape::kNote, *editor.landing, text, {}, NameOf(editor.pane));
}

}  // namespace saccade::view
