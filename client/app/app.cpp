#include "client/app/app.hpp"

#include <absl/strings/str_cat.h>
#include <imgui.h>

#include <algorithm>
#include <utility>

#include "client/app/entrance.hpp"
#include "client/app/library.hpp"
#include "client/app/snapshot.hpp"
#include "client/cli/interrupt.hpp"
#include "client/cli/session_file.hpp"
#include "client/view/panels.hpp"
#include "client/view/typesetter.hpp"

namespace saccade::app {
namespace {

constexpr Timestamp kFrameNs = 16'000'000;
constexpr Timestamp kStateNs = 50'000'000;    // what comes without a picture waits for one so long
constexpr Timestamp kIdleNs = 1'000'000'000;  // ages in words grow by themselves
constexpr double kLongestWaitS = 0.5;         // a signal is noticed within this
constexpr int kSettle = 3;

}  // namespace

absl::StatusOr<std::unique_ptr<App>> App::Create(const Options& options, Settings settings) {
  std::unique_ptr<App> app(new App(std::move(settings)));
  if (!options.trace.empty()) {
    auto trace = Trace::Create(options.trace);
    if (!trace.ok()) return trace.status();
    app->trace_ = *std::move(trace);
  }
  auto window = view::Window::Open("Saccade", app->settings_.window);
  if (!window.ok()) return window.status();
  app->window_ = *std::move(window);
  app->window_->SetLight(app->settings_.light);
  for (const Address& address : options.servers) {
    if (absl::Status added = app->AddTab(options, address); !added.ok()) return added;
  }
  return app;
}

absl::Status App::AddTab(const Options& options, const Address& address) {
  session::SessionOptions session;
  session.connection.server = address.server;
  session.connection.display_name = settings_.name;
  session.connection.person_key = cli::PersonKey(address.server, settings_.name);
  session.enter = MakeEntrance(options, address);
  Tab tab;
  tab.desk = std::make_unique<view::Desk>(std::move(session), address.server, settings_.voice,
                                          &view::Window::Wake);
  tab.desk->state().main = settings_.main;
  tab.desk->state().talk.open = settings_.layout.talk_open;
  tab.desk->state().my_name = settings_.name;
  tab.desk->keep_snapshot = [](const net::Still& still, const view::Desk& desk) {
    const auto file =
        KeepSnapshot(still, desk.session().annotations.List(), desk.session().joined.source,
                     desk.state().my_name, PicturesFolder());
    return file.ok() ? absl::StrCat("Kept as ", file->string())
                     : absl::StrCat("No snapshot: ", file.status().message());
  };
  tab.desk->library = LibraryModels();
  auto view = view::DeskView::Create(window_->gl(), *tab.desk);
  if (!view.ok()) return view.status();
  tab.view = *std::move(view);
  tabs_.push_back(std::move(tab));
  return absl::OkStatus();
}

Settings App::settings() const {
  Settings now = settings_;
  now.window = window_->place();
  now.light = window_->light();
  now.main = tabs_.front().desk->state().main;
  return now;
}

absl::Status App::Run() {
  Timestamp drawn_ns = 0, stepped_ns = MonotonicNow();
  Timestamp within_ns = 0;  // of the last drawing the next is due
  while (!window_->closing() && !cli::Interrupted()) {
    const double rest_s = Seconds(drawn_ns + within_ns - MonotonicNow());
    window_->Wait(std::clamp(rest_s, 0.0, kLongestWaitS));
    Timestamp now_ns = MonotonicNow();
    // Before a new picture is taken: what was done was done to what is on the screen.
    HandleInput(now_ns);
    if (window_->TakeRefresh()) busy_frames_ = kSettle;
    if (busy_frames_ > 0) within_ns = kFrameNs;
    for (const Tab& each : tabs_) {
      const view::Desk::News news = each.desk->Poll(now_ns);
      if (news == view::Desk::News::kPicture) within_ns = std::min(within_ns, kFrameNs);
      if (news == view::Desk::News::kState) within_ns = std::min(within_ns, kStateNs);
    }
    now_ns = MonotonicNow();
    if (now_ns - drawn_ns < within_ns) continue;
    const bool moving = tab().desk->StepMap(1e-6 * static_cast<double>(now_ns - stepped_ns));
    stepped_ns = now_ns;
    if (absl::Status drawn = Draw(now_ns); !drawn.ok()) return drawn;
    drawn_ns = now_ns;
    busy_frames_ = std::max(busy_frames_ - 1, 0);
    within_ns = moving || busy_frames_ > 0 ? kFrameNs : kIdleNs;
  }
  return absl::OkStatus();
}

void App::HandleInput(Timestamp now_ns) {
  for (const view::InputEvent& event : window_->TakeInput()) {
    busy_frames_ = kSettle;
    if (event.kind == view::InputEvent::Kind::kKey) {
      HandleKey(event, now_ns);
      continue;
    }
    if (event.kind == view::InputEvent::Kind::kLet) {
      for (const Tab& each : tabs_) each.desk->PressToTalk(false);
      continue;
    }
    const std::vector<view::Rect>& above = tab().desk->state().above;
    const bool covered = std::any_of(above.begin(), above.end(), [&event](const view::Rect& rect) {
      return rect.Contains(event.x, event.y);
    });
    pointer_.Handle(event, layout_, *tab().desk, *tab().view, !help_ && !covered, settings_.layout,
                    now_ns);
  }
}

void App::HandleKey(const view::InputEvent& event, Timestamp now_ns) {
  view::Desk& desk = *tab().desk;
  const ImGuiIO& io = ImGui::GetIO();
  const std::optional<tools::Action> action = tools::ActionOf(event.key);
  if (action == tools::Action::kEscape && help_) {
    help_ = false;
    return;
  }
  const bool enters = event.key.key == "enter" && !event.repeat;
  if (action == tools::Action::kEscape && desk.state().talk.writing) {
    leave_field_ = true;
    return;
  }
  // A key pressed and let go between two pictures is none to ImGui.
  if (enters && desk.state().dialog) {
    const bool list = desk.state().dialog->shape == AnnotationShape::kCheckList;
    desk.state().dialog->finish = event.key.ctrl || !list;  // else it is a new line
    return;
  }
  if (enters && desk.state().talk.writing) {
    desk.state().talk.finish = true;
    return;
  }
  if (enters && desk.state().editor) {
    desk.state().editor->finish = desk.state().editor->opened;
    return;
  }
  // Letters are tools only where nobody writes.
  if ((io.WantTextInput || desk.state().editor || desk.state().dialog || help_) &&
      action != tools::Action::kEscape) {
    if (help_ && action == tools::Action::kHelp) help_ = false;
    return;
  }
  if (event.key.key == " " && desk.voice().push_to_talk() && !io.NavVisible) {
    return desk.PressToTalk(true);
  }
  if (!action) {
    if (!io.NavVisible) pointer_.HandleKey(event, layout_, desk, *tab().view, now_ns);
    return;
  }
  if (event.repeat && tools::ControlOf(*action).group == tools::Group::kHead) return;
  if (action == tools::Action::kHelp) {
    help_ = true;
  } else if (action == tools::Action::kNextTab) {
    shown_ = (shown_ + 1) % tabs_.size();
  } else if (*action == tools::Action::kTheme) {
    window_->SetLight(!window_->light());
  } else if (!RunInPane(*action, event.shift, now_ns)) {
    if (*action == tools::Action::kEscape) pointer_.LetGo();
    desk.Run(*action, now_ns);
  }
}

bool App::RunInPane(tools::Action action, bool shift, Timestamp now_ns) {
  view::Desk& desk = *tab().desk;
  const view::Rect& main = layout_.main;
  switch (action) {
    case tools::Action::kPaste:
      pointer_.Paste(layout_, desk, *tab().view, now_ns);
      return true;
    case tools::Action::kTurnLeft:
    case tools::Action::kTurnRight: {
      const std::optional<tools::View> view = desk.state().main == view::Pane::kMap
                                                  ? std::optional(desk.map_view(main))
                                                  : desk.video_view();
      desk.Turn(action == tools::Action::kTurnLeft ? -1 : 1, shift, view ? &*view : nullptr,
                now_ns);
      return true;
    }
    case tools::Action::kEditText:
      if (!desk.state().selection.empty()) {
        desk.EditText(desk.state().selection.last(), main.x + 0.4f * main.width,
                      main.y + 0.4f * main.height);
      }
      return true;
    default:
      return false;
  }
}

absl::Status App::Draw(Timestamp now_ns) {
  if (absl::Status begun = window_->Begin(); !begun.ok()) return begun;
  if (trace_) trace_->Drawing();
  if (std::exchange(leave_field_, false)) ImGui::SetWindowFocus(nullptr);
  tab().view->Update();
  settings_.layout.talk_open = tab().desk->state().talk.open;
  layout_ = view::LayOut(window_->width(), window_->height(), window_->scale(), tabs_.size() > 1,
                         tab().view->aspect(), settings_.layout, corner_.corner());
  PlaceInset(now_ns);
  tab().desk->state().above.clear();
  DrawPanes({layout_.scale, window_->pixel_ratio(), window_->height()}, now_ns);
  DrawPanels(now_ns);
  if (pointer_.over_edge()) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
  const std::size_t drawn = shown_;
  window_->End();
  if (view::Types().stale()) busy_frames_ = kSettle;  // words wait for it
  const Timestamp shown_ns = MonotonicNow();
  tabs_[drawn].desk->Shown(shown_ns);
  if (trace_) trace_->Shown(*tabs_[drawn].desk, *tabs_[drawn].view, layout_, drawn, shown_ns);
  return absl::OkStatus();
}

void App::PlaceInset(Timestamp now_ns) {
  const view::Desk& desk = *tab().desk;
  const decode::Picture* picture = desk.shown();
  std::optional<Eigen::Vector2d> at;
  if (desk.state().main == view::Pane::kMap && picture != nullptr &&
      session::IsPlaced(picture->facts->pose)) {
    at = desk.map_view(layout_.main).Project(picture->facts->pose->world_from_camera.translation);
  }
  const Eigen::Vector2d pixel = at.value_or(Eigen::Vector2d::Zero());
  corner_.Update(layout_, at.has_value(), layout_.main.x + static_cast<float>(pixel.x()),
                 layout_.main.y + static_cast<float>(pixel.y()), now_ns);
}

void App::DrawPanes(const view::Canvas& canvas, Timestamp now_ns) {
  using view::Pane;
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const Pane main = tab().desk->state().main;
  const Pane other = main == Pane::kMap ? Pane::kVideo : Pane::kMap;
  tab().view->Draw(main, layout_.main, canvas, list, now_ns);
  tab().view->Draw(other, layout_.inset, canvas, list, now_ns);
  const view::Rect& inset = layout_.inset;
  list->AddRect({inset.x - 1, inset.y - 1}, {inset.right() + 1, inset.bottom() + 1}, view::kLine, 0,
                0, 2 * layout_.scale);
}

void App::DrawPanels(Timestamp now_ns) {
  const view::PanelContext context{*tab().desk, window_->fonts(), now_ns, layout_.scale};
  if (view::DrawHeader(context, layout_.header)) help_ = !help_;
  std::vector<view::Desk*> desks;
  for (const Tab& each : tabs_) desks.push_back(each.desk.get());
  view::DrawTools(context, layout_.tools);
  if (tab().desk->state().tool == tools::Action::kThings) {
    view::DrawThings(context, layout_.panel);
  } else {
    view::DrawAnnotations(context, layout_.panel);
  }
  view::DrawTalk(context, layout_.talk);
  view::DrawGaze(context, layout_.gaze);
  view::DrawStrip(context, layout_.strip);
  view::DrawEditor(context, layout_.main);
  view::DrawDialog(context, layout_.main);
  view::DrawHelp(context, help_);
  if (tabs_.size() > 1) shown_ = view::DrawTabs(desks, shown_, layout_.tabs, now_ns);
}

}  // namespace saccade::app
