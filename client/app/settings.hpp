#pragma once

#include <absl/status/status.h>

#include <filesystem>
#include <string>

#include "client/talk/voice_room.hpp"
#include "client/view/desk_state.hpp"
#include "client/view/layout.hpp"
#include "client/view/window.hpp"

namespace saccade::app {

/// What is kept between two runs, in $XDG_CONFIG_HOME/saccade/client.toml. No secrets.
struct Settings {
  std::string name;  // empty: not asked yet
  view::Window::Place window;
  view::LayoutSettings layout;
  view::Pane main = view::Pane::kMap;
  talk::VoiceOptions voice;
  bool light = false;  // what stands round the panes

  absl::Status Validate() const;
};

/// $XDG_CONFIG_HOME/saccade/client.toml, else under ~/.config; empty: nowhere.
std::filesystem::path SettingsFile();

/// Takes over what the file says; without one nothing. Errors as TomlTable.
absl::Status LoadSettings(const std::filesystem::path& file, Settings& settings);
/// For its owner alone (0600), whole or not at all. Unavailable: cannot be written, with the
/// remedy.
absl::Status SaveSettings(const std::filesystem::path& file, const Settings& settings);

}  // namespace saccade::app
