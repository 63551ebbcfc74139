// Boxes drawn from corner to corner, and strokes drawn in the map: both on the surface pressed.
#include <absl/strings/str_cat.h>

#include <utility>

#include "client/view/desk.hpp"

namespace saccade::view {
namespace {

constexpr double kStepPx = 2;

}  // namespace

void Desk::BeginDrawing(Pane pane, const Eigen::Vector2d& pixel, const tools::View& view) {
  const tools::Landing& landing = *pressed_->landing;
  drawing_ = Drawing{pane,         landing, tools::PlaneOf(view, landing), net::RandomUuid(), pixel,
                     std::nullopt, {}};
  if (state_.tool == tools::Action::kBox) return;
  drawing_->points = {landing.point_in_world};
  BeginSketch();
}

void Desk::Draw(Pane pane, const Eigen::Vector2d& pixel, const tools::View& view) {
  if (pane != drawing_->pane) return;
  const std::optional<Eigen::Vector3d> point = tools::OnPlane(view, drawing_->plane, pixel);
  if (!point) return;
  Annotation guess;
  guess.id = drawing_->pending_id;
  guess.color_rgba = state_.color_rgba;
  guess.anchor.state = AnchorState::kPaused;  // drawn hollow: it is no mark yet
  if (drawing_->points.empty()) {
    drawing_->box = tools::BoxBetween(view, drawing_->landing.point_in_world, *point);
    guess.shape = AnnotationShape::kBox;
    guess.anchor.point_in_world = drawing_->box->middle_in_world;
    guess.world_from_mark = drawing_->box->world_from_mark;
    guess.extent_m = drawing_->box->extent_m;
  } else {
    if ((pixel - drawing_->last_px).norm() < kStepPx) return;
    drawing_->last_px = pixel;
    drawing_->points.push_back(*point);
    if (sketch_) sketch_->Add(PointTarget{*point});
    TellSketches(MonotonicNow());
    guess.shape = AnnotationShape::kInk;
    guess.anchor.point_in_world = drawing_->points.front();
    guess.ink_offset_m = tools::StrokeOf(drawing_->points);
  }
  session().annotations.AddPending(std::move(guess));
}

void Desk::FinishDrawing(Pane pane, const Eigen::Vector2d& pixel, const tools::View* view,
                         const Where& where, Timestamp now_ns) {
  if (view != nullptr) Draw(pane, pixel, *view);
  const Drawing drawn = *std::exchange(drawing_, std::nullopt);
  session().annotations.RemovePending(drawn.pending_id);
  const auto refuse = [&](const std::string& why) {
    EndSketch();
    state_.Refuse(where, absl::StrCat("Not placed: ", why), now_ns);
  };
  if (!session().link.live()) return refuse("no connection to the server.");
  AnnotationDraft draft;
  if (drawn.box) {
    draft.shape = AnnotationShape::kBox;
    draft.world_from_mark = drawn.box->world_from_mark;
    draft.extent_m = drawn.box->extent_m;
    // Its middle is what it stands at, wherever that lies under the pointer now.
    const auto middle = view == nullptr ? std::nullopt : view->Project(drawn.box->middle_in_world);
    std::optional<tools::Landing> landing;
    if (middle) landing = LandingAt(pane, *middle, view);
    if (!landing) return refuse(WhyNoLanding(pane));
    landing->point_in_world = drawn.box->middle_in_world;
    return PlaceDraft(std::move(draft), *landing, where);
  }
  draft.shape = AnnotationShape::kInk;
  draft.ink_offset_m = tools::StrokeOf(drawn.points);
  if (draft.ink_offset_m.empty()) {
    EndSketch();
    return state_.Refuse(where, "Nothing drawn: press, and move while you hold.", now_ns);
  }
  // Not before it is answered: nobody sees it go and come back.
  PlaceDraft(std::move(draft), drawn.landing, where,
             [sketch = std::exchange(sketch_, nullptr)] { sketch->End(); });
}

void Desk::DropDrawing() {
  session().annotations.RemovePending(drawing_->pending_id);
  drawing_.reset();
  EndSketch();
}

void Desk::HideMarks() {
  if (!state_.selection.empty()) {
    for (const std::string& id : state_.selection.ids()) state_.hidden.insert(id);
    state_.selection.Clear();
  } else if (!state_.hidden.empty()) {
    state_.hidden.clear();
  } else {
    state_.hide_marks = !state_.hide_marks;
  }
}

}  // namespace saccade::view
