#include "client/app/settings.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_replace.h>

#include <cstdlib>
#include <system_error>

#include "shared/io/private_file.hpp"
#include "shared/io/toml_table.hpp"

namespace saccade::app {
namespace fs = std::filesystem;
namespace {

fs::path Folder(const char* variable, const char* under_home) {
  if (const char* folder = std::getenv(variable); folder != nullptr && *folder != 0) {
    return fs::path(folder) / "saccade";
  }
  const char* home = std::getenv("HOME");
  return home == nullptr || *home == 0 ? fs::path() : fs::path(home) / under_home / "saccade";
}

bool Write(const fs::path& file, const std::string& text) {
  std::error_code failed;
  fs::create_directories(file.parent_path(), failed);
  return !failed && WritePrivateFile(file, text) == 0;
}

/// A TOML string: names have no control characters, as the server refuses them.
std::string Quoted(const std::string& text) {
  return absl::StrCat("\"", absl::StrReplaceAll(text, {{"\\", "\\\\"}, {"\"", "\\\""}}), "\"");
}

void Read(TomlTable& table, Settings& settings) {
  double panel = settings.layout.panel_width, inset = settings.layout.inset_share;
  std::string main = settings.main == view::Pane::kMap ? "map" : "video";
  table.Text("name", settings.name);
  table.Integer("width", settings.window.width);
  table.Integer("height", settings.window.height);
  table.Boolean("maximised", settings.window.maximised);
  table.Number("panel_width", 1, panel);
  table.Number("inset_share", 1, inset);
  table.Text("main", main);
  if (main != "map" && main != "video") table.Say("main", "is map or video");
  std::string theme = settings.light ? "light" : "dark";
  table.Text("theme", theme);
  if (theme != "dark" && theme != "light") table.Say("theme", "is dark or light");
  settings.light = theme == "light";
  table.Boolean("talk_open", settings.layout.talk_open);
  table.Text("microphone", settings.voice.microphone);
  table.Text("loudspeaker", settings.voice.loudspeaker);
  settings.layout.panel_width = static_cast<float>(panel);
  settings.layout.inset_share = static_cast<float>(inset);
  settings.main = main == "map" ? view::Pane::kMap : view::Pane::kVideo;
}

}  // namespace

absl::Status Settings::Validate() const {
  if (name.size() > 60) return absl::InvalidArgumentError("name is longer than 60 bytes");
  if (window.width < 100 || window.width > 32768 || window.height < 100 || window.height > 32768) {
    return absl::InvalidArgumentError("width and height must be from 100 to 32768");
  }
  using view::LayoutSettings;
  if (!(layout.panel_width >= LayoutSettings::kLeastPanel &&
        layout.panel_width <= LayoutSettings::kMostPanel)) {
    return absl::InvalidArgumentError(absl::StrCat("panel_width must be from ",
                                                   LayoutSettings::kLeastPanel, " to ",
                                                   LayoutSettings::kMostPanel));
  }
  if (!(layout.inset_share >= LayoutSettings::kLeastInset &&
        layout.inset_share <= LayoutSettings::kMostInset)) {
    return absl::InvalidArgumentError(absl::StrCat("inset_share must be from ",
                                                   LayoutSettings::kLeastInset, " to ",
                                                   LayoutSettings::kMostInset));
  }
  return absl::OkStatus();
}

fs::path SettingsFile() {
  const fs::path folder = Folder("XDG_CONFIG_HOME", ".config");
  return folder.empty() ? folder : folder / "client.toml";
}

absl::Status LoadSettings(const fs::path& file, Settings& settings) {
  std::error_code ignored;
  if (file.empty() || !fs::exists(file, ignored)) return absl::OkStatus();
  return LoadTomlTable(file, "client", &Read, settings);
}

absl::Status SaveSettings(const fs::path& file, const Settings& settings) {
  if (file.empty()) return absl::OkStatus();
  const std::string text = absl::StrFormat(
      "# What saccade-client keeps between two runs.\n[client]\nname = %s\nwidth = %d\nheight = "
      "%d\nmaximised = %s\npanel_width = %.1f\ninset_share = %.3f\nmain = \"%s\"\ntheme = "
      "\"%s\"\ntalk_open = %s\nmicrophone = %s\nloudspeaker = %s\n",
      Quoted(settings.name), settings.window.width, settings.window.height,
      settings.window.maximised ? "true" : "false", settings.layout.panel_width,
      settings.layout.inset_share, settings.main == view::Pane::kMap ? "map" : "video",
      settings.light ? "light" : "dark", settings.layout.talk_open ? "true" : "false",
      Quoted(settings.voice.microphone), Quoted(settings.voice.loudspeaker));
  if (Write(file, text)) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat("cannot keep the settings in ", file.string(), ": make that folder writable"));
}

}  // namespace saccade::app
