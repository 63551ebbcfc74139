#include "client/app/trace.hpp"

#include <absl/strings/str_cat.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

#include "client/tools/turn.hpp"
#include "client/tools/words.hpp"
#include "client/view/panels.hpp"

namespace saccade::app {
namespace {

using nlohmann::json;

json RectOf(const view::Rect& rect) { return {rect.x, rect.y, rect.width, rect.height}; }

json PictureOf(const view::Desk& desk, const view::DeskView& view, const view::Rect& pane) {
  const decode::Picture* picture = desk.shown();
  if (picture == nullptr) return nullptr;
  const view::Placement at = view.VideoIn(pane);
  json out = {{"frame", picture->facts->frame_id},
              {"captured_ns", picture->facts->stages.captured_ns},
              {"arrived_ns", picture->facts->arrived_ns},
              {"decoded_ns", picture->decoded_ns},
              {"left", at.left},
              {"top", at.top},
              {"scale", at.scale},
              {"width", picture->rgba.cols},
              {"height", picture->rgba.rows}};
  const CameraIntrinsics& lens = picture->facts->camera->intrinsics();
  out["camera"] = {{"widthPx", lens.width},
                   {"heightPx", lens.height},
                   {"fxPx", lens.fx},
                   {"fyPx", lens.fy},
                   {"cxPx", lens.cx},
                   {"cyPx", lens.cy},
                   {"distortion", lens.distortion}};
  if (const auto& still = desk.state().still) {
    out["frozen"] = true;
    out["lossless"] = still->lossless;
  }
  return out;
}

json MapOf(const view::Desk& desk, const view::Rect& pane) {
  const tools::View eye = desk.map_view(pane);
  const Eigen::Vector3d& p = eye.world_from_camera.translation;
  const Eigen::Quaterniond& q = eye.world_from_camera.rotation;
  return {{"pane", RectOf(pane)},
          {"eye", {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()}},
          {"focal", eye.camera->intrinsics().fx}};
}

}  // namespace

absl::StatusOr<std::unique_ptr<Trace>> Trace::Create(const std::string& name) {
  std::FILE* file = std::fopen(name.c_str(), "w");
  if (file == nullptr) {
    return absl::UnavailableError(
        absl::StrCat("--trace: cannot write ", name, ": ", std::strerror(errno)));
  }
  return std::unique_ptr<Trace>(new Trace(file));
}

Trace::~Trace() { std::fclose(file_); }

void Trace::Write(const std::string& line) {
  std::fputs((line + "\n").c_str(), file_);
  std::fflush(file_);
}

void Trace::Drawing() { Write(absl::StrCat(R"({"event":"drawing","seq":)", ++sequence_, "}")); }

void Trace::Shown(const view::Desk& desk, const view::DeskView& view, const view::Layout& layout,
                  std::size_t tab, Timestamp shown_ns) {
  const session::State& told = desk.session();
  const view::DeskState& state = desk.state();
  const bool map_main = state.main == view::Pane::kMap;
  const tools::StatusWords status = tools::StatusOf(told, shown_ns);
  json line = {{"event", "shown"},
               {"seq", sequence_},
               {"shown_ns", shown_ns},
               {"tab", tab},
               {"main", map_main ? "map" : "video"},
               {"inset", RectOf(layout.inset)},
               {"video", PictureOf(desk, view, map_main ? layout.inset : layout.main)},
               {"map", MapOf(desk, map_main ? layout.main : layout.inset)},
               {"status", status.text},
               {"live", told.link.live()},
               {"offset_ns", told.clock.offset_ns().value_or(0)},
               {"tool", tools::ControlOf(state.tool).label},
               {"selected", state.selection.last()},
               {"selection", state.selection.ids()},
               {"hidden", state.hidden.size()},
               {"lasers", told.pointers.lasers()},
               {"editing", state.editor.has_value() || state.dialog.has_value()},
               {"writing", state.talk.writing},
               {"said", told.chat.messages().size()},
               {"paused", told.pause.has_value()},
               {"voice", desk.voice().Words()},
               {"voice_problem", desk.voice().problem()},
               {"speaks", view::SpeakerWords(desk)},
               {"strokes", told.pointers.List().size() - told.pointers.lasers()},
               {"refused",
                {{"map", state.Refusal("map")},
                 {"video", state.Refusal("video")},
                 {"head", state.Refusal("head")},
                 {"laser", state.Refusal("Laser pointer")}}},
               {"gaze", told.gaze ? ToString(told.gaze->mode) : ""},
               {"arrived", told.gaze && told.gaze->arrived},
               {"lease", static_cast<int>(desk.pilot().kind())}};
  if (const auto& area = state.area) {
    line["area"] = {area->from.x(), area->from.y(), area->to.x(), area->to.y()};
  }
  // Where the handle of the selected mark is, in the video as it is shown.
  const std::optional<Annotation> turnable = desk.Turnable();
  if (const auto eye = desk.video_view(); turnable && eye) {
    const view::Placement at = view.VideoIn(map_main ? layout.inset : layout.main);
    if (const auto pixel = eye->Project(tools::HandlePoint(*turnable))) {
      line["handle"] = {at.left + (pixel->x() + 0.5) * at.scale,
                        at.top + (pixel->y() + 0.5) * at.scale};
    }
  }
  if (state.tool == tools::Action::kThings) {
    json buttons = json::object();
    for (const auto& [words, rect] : state.things.buttons) buttons[words] = RectOf(rect);
    line["things"] = {{"said", state.things.said},
                      {"tells", state.things.tells},
                      {"busy", state.things.busy},
                      {"selected", state.things.selected_id},
                      {"total", state.things.registering.Total()},
                      {"pairs", state.things.registering.pairs().size()},
                      {"count", told.scene.scene().objects.size()},
                      {"buttons", std::move(buttons)}};
  }
  if (told.statistics) line["tracked_hz"] = told.statistics->tracked_fps_hz;
  if (const auto& pressed = desk.pressed()) {
    line["pressed"] = {pressed->frame_id, pressed->pixel.x(), pressed->pixel.y()};
  }
  json marks = json::array();
  const tools::Scale scale = tools::ScaleOf(told);
  for (const Annotation& annotation : told.annotations.List()) {
    marks.push_back({{"id", annotation.id},
                     {"text", annotation.text},
                     {"points", annotation.ink_offset_m.size()},
                     {"words", tools::WordsOf(annotation, scale).text}});
  }
  line["marks"] = std::move(marks);
  Write(line.dump(-1, ' ', false, json::error_handler_t::replace));
}

}  // namespace saccade::app
