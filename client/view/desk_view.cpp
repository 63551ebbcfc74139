#include "client/view/desk_view.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

#include "client/tools/turn.hpp"
#include "client/tools/words.hpp"
#include "client/view/theme.hpp"
#include "client/view/typesetter.hpp"

namespace saccade::view {
namespace {

constexpr double kFrustumShare = 0.14;  // of the distance looked from
constexpr Timestamp kStaleNs = 1'000'000'000;

ImTextureID IdOf(const Texture& texture) {
  return reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(texture.id()));
}

}  // namespace

absl::StatusOr<std::unique_ptr<DeskView>> DeskView::Create(const GlFunctions& gl, Desk& desk) {
  std::unique_ptr<DeskView> view(new DeskView(gl, desk));
  auto scene = MapScene::Create(gl);
  if (!scene.ok()) return scene.status();
  view->scene_ = *std::move(scene);
  auto things = ThingLayer::Create(gl);
  if (!things.ok()) return things.status();
  view->things_ = *std::move(things);
  return view;
}

void DeskView::Update() {
  const decode::Picture* picture = desk_.shown();
  scene_->Update(desk_.session());
  const auto markers = picture != nullptr ? std::span<const MarkerPose>(picture->facts->markers)
                                          : std::span<const MarkerPose>();
  things_->Update(desk_.session(), markers);
  if (picture == nullptr || desk_.picture_paused()) return scene_->Show(nullptr, nullptr);
  const cv::Mat& rgba = picture->rgba;
  if (rgba.data != on_card_) {
    const std::span<const std::uint8_t> pixels(rgba.data, rgba.total() * rgba.elemSize());
    if (texture_ == nullptr || texture_width_ != rgba.cols || texture_height_ != rgba.rows) {
      texture_ = std::make_unique<Texture>(gl_, rgba.cols, rgba.rows, PixelLayout::kRgba8, pixels,
                                           Texture::Options{.mipmaps = false, .repeat = false});
      texture_width_ = rgba.cols;
      texture_height_ = rgba.rows;
    } else {
      texture_->Replace(pixels);
    }
    on_card_ = rgba.data;
  }
  scene_->Show(desk_.same_map() ? picture->facts.get() : nullptr, texture_.get());
}

float DeskView::aspect() const {
  if (desk_.state().main == Pane::kVideo || texture_height_ == 0) return 4.0f / 3.0f;
  return static_cast<float>(texture_width_) / static_cast<float>(texture_height_);
}

Placement DeskView::VideoIn(const Rect& rect) const {
  const float width = static_cast<float>(std::max(texture_width_, 1));
  const float height = static_cast<float>(std::max(texture_height_, 1));
  Placement out;
  out.scale = std::min(rect.width / width, rect.height / height);
  out.left = rect.x + 0.5f * (rect.width - width * out.scale);
  out.top = rect.y + 0.5f * (rect.height - height * out.scale);
  return out;
}

void DeskView::Draw(Pane pane, const Rect& rect, const Canvas& canvas, ImDrawList* list,
                    Timestamp now_ns) {
  if (pane == Pane::kMap) {
    DrawMap(rect, canvas, list);
  } else {
    DrawVideo(rect, canvas, list);
  }
  const float wrap = std::max(rect.width - 48 * canvas.scale, 80.0f);
  const std::string note = Types().Set(Note(pane, now_ns), wrap);
  if (note.empty()) return;
  const ImVec2 size = ImGui::CalcTextSize(note.c_str(), nullptr, false, wrap);
  const ImVec2 at{rect.x + 0.5f * (rect.width - size.x), rect.y + 14 * canvas.scale};
  const float pad = 8 * canvas.scale;
  list->AddRectFilled({at.x - pad, at.y - 0.6f * pad},
                      {at.x + size.x + pad, at.y + size.y + 0.6f * pad}, IM_COL32(16, 17, 18, 230),
                      4 * canvas.scale);
  list->AddText(ImGui::GetFont(), ImGui::GetFontSize(), at, kWarn, note.c_str(), nullptr, wrap);
}

std::string DeskView::Note(Pane pane, Timestamp now_ns) const {
  const DeskState& state = desk_.state();
  const session::State& told = desk_.session();
  const std::string refusal = state.Refusal(pane == Pane::kMap ? "map" : "video");
  if (!refusal.empty() || pane == Pane::kMap) return refusal;
  if (const std::string problem = desk_.video_problem(); !problem.empty()) {
    return absl::StrCat("No video. ", problem);
  }
  if (state.still) {
    return absl::StrCat("frozen, ", tools::SpanWords(now_ns - state.still->since_ns), ": P goes on",
                        desk_.same_map() ? ""
                                         : ". The map has changed since: marks are not where they "
                                           "were");
  }
  if (told.pause) return tools::PauseWords(*told.pause);
  if (!things_->problem().empty()) {
    return absl::StrCat("The scene is not drawn: ", things_->problem());
  }
  if (!desk_.live())
    return told.link.live() ? "waiting for the first picture" : "no picture: not connected";
  const Timestamp age = now_ns - desk_.live()->decoded_ns;
  if (age > kStaleNs && !told.source_ended) {
    return absl::StrCat("picture is ", tools::SpanWords(age), " old");
  }
  return told.link.live() ? tools::LostWords(told) : "";
}

std::vector<std::string> DeskView::Accented() const {
  std::vector<std::string> ids = desk_.state().selection.ids();
  ids.push_back(desk_.state().pointed_id);
  return ids;
}

Marks DeskView::MarksIn(const tools::View& view) const {
  const tools::Scale scale = tools::ScaleOf(desk_.session());
  std::vector<Annotation> drawn = desk_.session().annotations.List();
  std::erase_if(drawn, [this](const Annotation& each) { return !desk_.state().Draws(each); });
  for (Annotation& each : drawn) {
    const bool hollow = tools::DoNotTrust(each.anchor, scale);
    if (each.anchor.state != AnchorState::kStopped) {
      each.anchor.state = hollow ? AnchorState::kPaused : AnchorState::kTracking;
    }
  }
  std::vector<std::string> pending;
  for (Annotation& guess : desk_.session().annotations.Pending()) {
    pending.push_back(guess.id);
    drawn.push_back(std::move(guess));
  }
  Marks marks =
      AnnotationMarks(*view.camera, view.world_from_camera, drawn, desk_.session().metric());
  // Not answered is not the same as not to be trusted.
  for (Label& label : marks.labels) {
    if (std::find(pending.begin(), pending.end(), label.annotation_id) != pending.end()) {
      label.text = label.words;
    }
  }
  return marks;
}

void DeskView::OnMap(const ImDrawList* /*list*/, const ImDrawCmd* command) {
  auto* self = static_cast<DeskView*>(command->UserCallbackData);
  self->scene_->Draw(self->eye_, self->viewport_, kFrustumShare * self->desk_.orbit().distance_m(),
                     self->point_px_, self->desk_.state().shows, *self->things_);
}

void DeskView::DrawMap(const Rect& rect, const Canvas& canvas, ImDrawList* list) {
  const float ratio = canvas.pixel_ratio;
  eye_ = desk_.map_view(rect);
  viewport_ = {static_cast<int>(std::lround(rect.x * ratio)),
               static_cast<int>(std::lround((canvas.window_height - rect.bottom()) * ratio)),
               static_cast<int>(std::lround(rect.width * ratio)),
               static_cast<int>(std::lround(rect.height * ratio))};
  point_px_ = 7 * canvas.scale * ratio;
  list->AddCallback(&DeskView::OnMap, this);
  list->AddCallback(ImDrawCallback_ResetRenderState, nullptr);
  Painter painter(list, rect, rect.x, rect.y, 1, canvas.scale);
  painter.Axes(WorldAxes(*eye_.camera, eye_.world_from_camera));
  pictures_.Draw(eye_, painter);
  painter.Draw(MarksIn(eye_), Accented());
  DrawGrips(Pane::kMap, eye_, painter);
  const auto& gaze = desk_.session().gaze;
  const auto& pose = desk_.session().pose;
  if (gaze && gaze->target_in_world && session::IsPlaced(pose)) {
    for (const Polyline2& piece :
         ProjectPolyline(*eye_.camera, eye_.camera_from_world,
                         {pose->world_from_camera.translation, *gaze->target_in_world})) {
      painter.Line(piece, kTarget, true);
    }
    if (const auto at = eye_.Project(*gaze->target_in_world)) {
      painter.Target(*at, gaze->arrived, tools::TargetLabel(*gaze));
    }
  }
  DrawLanding(Pane::kMap, eye_, painter);
}

void DeskView::DrawVideo(const Rect& rect, const Canvas& canvas, ImDrawList* list) {
  list->AddRectFilled({rect.x, rect.y}, {rect.right(), rect.bottom()}, IM_COL32(12, 13, 14, 255));
  const decode::Picture* picture = desk_.shown();
  if (picture == nullptr || texture_ == nullptr || desk_.picture_paused()) return;
  const Placement at = VideoIn(rect);
  const Rect inside{at.left, at.top, static_cast<float>(texture_width_) * at.scale,
                    static_cast<float>(texture_height_) * at.scale};
  list->AddImage(IdOf(*texture_), {inside.x, inside.y}, {inside.right(), inside.bottom()});
  const std::optional<tools::View> view = desk_.video_view();
  if (!view) return;
  if (desk_.same_map()) things_->DrawVideo(*view, at.left, at.top, at.scale, list);
  Painter painter(list, inside, at.left, at.top, at.scale, canvas.scale);
  DrawFeatures(*picture->facts, *view, painter);
  if (!desk_.same_map()) return;
  painter.Axes(WorldAxes(*view->camera, view->world_from_camera));
  pictures_.Draw(*view, painter);
  const Marks marks = MarksIn(*view);
  painter.Draw(marks, Accented());
  painter.EdgeArrows(marks.edge_arrows, Accented());
  DrawSight(*view, painter);
  const tools::InkLine& ink = desk_.state().ink;
  if (ink.drawing()) painter.Line(ink.points(), ColorOf(desk_.state().color_rgba));
  DrawLanding(Pane::kVideo, *view, painter);
  DrawGrips(Pane::kVideo, *view, painter);
}

void DeskView::DrawSelectedThing(const tools::View& view, Painter& painter) const {
  if (desk_.state().tool != tools::Action::kThings) return;
  const Scene& scene = desk_.session().scene.scene();
  const SceneObject* thing = scene.Find(desk_.state().things.selected_id);
  if (thing == nullptr || thing->parent != SceneParent::kWorld) return;
  for (const auto& [from, to] : tools::EdgesOfBox(scene, *thing)) {
    for (const Polyline2& piece :
         ProjectPolyline(*view.camera, view.camera_from_world, {from, to})) {
      painter.Line(piece, kAccent);
    }
  }
}

void DeskView::DrawGrips(Pane pane, const tools::View& view, Painter& painter) const {
  DrawSelectedThing(view, painter);
  if (const std::optional<Annotation> mark = desk_.Turnable()) {
    if (const auto handle = view.Project(tools::HandlePoint(*mark))) painter.Handle(*handle);
  }
  const DeskState& state = desk_.state();
  if (state.area && state.area->pane == pane) painter.Area(state.area->from, state.area->to);
  if (pane == Pane::kVideo && state.key_place && !state.hover) {
    const CameraIntrinsics& lens = view.camera->intrinsics();
    painter.Ring(
        {state.key_place->x() * lens.width - 0.5, state.key_place->y() * lens.height - 0.5}, 0, "");
  }
}

/// As measured, or sought in vain, only what this very frame says so of, and where it says. All
/// others are where its own pose puts them, as not searched for.
void DeskView::DrawFeatures(const net::FrameFacts& facts, const tools::View& view,
                            Painter& painter) const {
  const auto& still = desk_.state().still;
  const tools::Features& features = still ? still->features : desk_.session().features;
  const bool same =
      still || (facts.pose && facts.pose->map_revision == desk_.session().map_revision);
  for (const auto& [id, feature] : features) {
    if (!same || (facts.features && facts.features->contains(id))) continue;
    const auto at = view.Project(feature.point_in_world);
    if (at && view.camera->InImage(*at)) painter.Feature(*at, FeatureState::kNotAttempted);
  }
  if (!facts.features) return;
  for (const auto& [id, seen] : *facts.features) {
    if (view.camera->InImage(seen.pixel)) painter.Feature(seen.pixel, seen.state);
  }
}

void DeskView::DrawLanding(Pane pane, const tools::View& view, Painter& painter) const {
  for (const session::OthersPointer& pointer : desk_.session().pointers.List()) {
    const ImU32 color = ColorOf(pointer.color_rgba);
    if (pointer.sketch) {
      for (const Polyline2& piece :
           ProjectPolyline(*view.camera, view.camera_from_world, pointer.points_in_world)) {
        painter.Line(piece, color);
      }
    }
    const auto at = view.Project(pointer.points_in_world.back());
    if (at && pointer.sketch) {
      const ImVec2 end = painter.At(*at);
      painter.Words({end.x + 0.8f * ImGui::GetFontSize(), end.y}, pointer.name, color);
    } else if (at) {
      painter.Laser(*at, color, pointer.name);
    }
  }
  const auto& from = desk_.state().measure_from;
  const std::optional<Eigen::Vector2d> start =
      from ? view.Project(from->point_in_world) : std::nullopt;
  if (start) painter.Ring(*start, 0, "from here");
  const std::optional<Hover>& hover = desk_.state().hover;
  if (!hover || !hover->landing) return;
  const tools::Landing& landing = *hover->landing;
  std::optional<Eigen::Vector2d> at = hover->pixel;
  if (pane != hover->pane) at = view.Project(landing.point_in_world);
  if (!at) return;
  if (start) painter.Line({*start, *at}, kAccent, true);
  std::optional<double> radius;
  if (landing.sigma_m && view.Depth(landing.point_in_world) > 0) {
    radius = *landing.sigma_m / view.Depth(landing.point_in_world) / view.camera->RadiansPerPixel();
  }
  const std::string words = tools::LandingWords(view, landing, desk_.session().metric());
  painter.Ring(*at, radius, pane == hover->pane ? words : "");
}

void DeskView::DrawSight(const tools::View& view, Painter& painter) const {
  const auto& gaze = desk_.session().gaze;
  if (!gaze || !gaze->target_in_world) return;
  const CameraIntrinsics& lens = view.camera->intrinsics();
  painter.Centre({lens.cx, lens.cy});
  Annotation target;  // an anchor without a shape: in the picture it gives no edge arrow
  target.id = "gaze";
  target.shape = AnnotationShape::kInk;
  target.color_rgba = 0x57d977ff;
  target.anchor.state = AnchorState::kTracking;
  target.anchor.point_in_world = *gaze->target_in_world;
  Marks marks = AnnotationMarks(*view.camera, view.world_from_camera, {target});
  if (marks.edge_arrows.empty()) {
    if (const auto at = view.Project(*gaze->target_in_world)) {
      painter.Target(*at, gaze->arrived, tools::TargetLabel(*gaze));
    }
    return;
  }
  painter.EdgeArrows(marks.edge_arrows, {});
  const EdgeArrow& arrow = marks.edge_arrows.front();
  const ImVec2 tip = painter.At(arrow.tip_px);
  const std::string words = tools::TargetLabel(*gaze);
  const float width = ImGui::CalcTextSize(Types().Set(words).c_str()).x;
  const float dx = static_cast<float>(arrow.direction.x()),
              dy = static_cast<float>(arrow.direction.y());
  const float away = 2.2f * ImGui::GetFontSize();
  const float shift = dx > 0.4f ? -width : dx < -0.4f ? 0.0f : -0.5f * width;
  painter.Words({tip.x - dx * away + shift, tip.y - dy * away}, words, kTarget);
}

}  // namespace saccade::view
