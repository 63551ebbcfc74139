#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <vector>

#include "client/app/options.hpp"
#include "client/app/settings.hpp"
#include "client/app/trace.hpp"
#include "client/view/desk_view.hpp"
#include "client/view/pointer.hpp"
#include "client/view/window.hpp"

namespace saccade::app {

/// The window with a desk for each server. One thread, the main one: it draws when something has
/// changed, at most 60 times a second, and never waits for network or decoder.
class App {
 public:
  ///   errors of Window::Open and Trace::Create
  static absl::StatusOr<std::unique_ptr<App>> Create(const Options& options, Settings settings);
  /// Until the window is closed or a signal asks for the end.
  absl::Status Run();
  /// As they are now, to be kept.
  Settings settings() const;

 private:
  struct Tab {
    std::unique_ptr<view::Desk> desk;
    std::unique_ptr<view::DeskView> view;
  };
  explicit App(Settings settings) : settings_(std::move(settings)) {}
  absl::Status AddTab(const Options& options, const Address& address);
  Tab& tab() { return tabs_[shown_]; }
  const Tab& tab() const { return tabs_[shown_]; }

  void HandleInput(Timestamp now_ns);
  void HandleKey(const view::InputEvent& event, Timestamp now_ns);
  /// True if that action needs the pane that keys are about, and was done.
  bool RunInPane(tools::Action action, bool shift, Timestamp now_ns);
  absl::Status Draw(Timestamp now_ns);
  /// Where the wearer's camera appears in the map decides where the inset stands.
  void PlaceInset(Timestamp now_ns);
  void DrawPanes(const view::Canvas& canvas, Timestamp now_ns);
  void DrawPanels(Timestamp now_ns);

  Settings settings_;
  std::unique_ptr<view::Window> window_;  // outlives what draws in it
  std::vector<Tab> tabs_;
  std::size_t shown_ = 0;
  std::unique_ptr<Trace> trace_;
  view::Layout layout_;
  view::InsetCorner corner_;
  view::Pointer pointer_;
  bool help_ = false;
  bool leave_field_ = false;  // the one that has the keyboard
  int busy_frames_ = 3;       // ImGui settles some pictures after the last input
};

}  // namespace saccade::app
