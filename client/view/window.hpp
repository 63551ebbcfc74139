#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <vector>

#include "client/tools/controls.hpp"
#include "client/view/key_queue.hpp"
#include "client/view/theme.hpp"
#include "shared/render/gl_functions.hpp"

struct GLFWwindow;

namespace saccade::view {

/// Something a person did, in the order in which it happened, with the pointer where it was then.
struct InputEvent {
  enum class Kind { kPress, kRelease, kMove, kScroll, kKey, kLet, kLeave, kDrop };
  Kind kind = Kind::kMove;
  float x = 0, y = 0;  // in the window
  int button = 0;      // 0 left, 1 right, 2 middle
  float scroll = 0;    // notches; up is above 0
  bool shift = false, ctrl = false;
  std::string file{};   // kDrop
  bool repeat = false;  // kKey
  // kLet: Space was let go, or the keyboard went to another window.
  tools::KeyPress
      key{};  // kKey; besides the controls' keys "left" ... "down", "+", "-", "enter", " "
};

/// The window, its OpenGL 3.3 context and Dear ImGui in it. All of it on the main thread, but
/// Wake().
class Window {
 public:
  struct Place {
    int width = 1280, height = 720;
    bool maximised = false;
  };
  ///   Unavailable  no display, or no OpenGL 3.3 there; with the remedy
  static absl::StatusOr<std::unique_ptr<Window>> Open(const std::string& title, const Place& place);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  const GlFunctions& gl() const { return gl_; }
  const Fonts& fonts() const { return fonts_; }

  /// Sleeps until there is input, Wake() is called, or `timeout_s` have passed.
  void Wait(double timeout_s);
  /// Ends a Wait(), from any thread.
  static void Wake();
  void SetLight(bool light) { light_ = light; }
  bool light() const { return light_; }
  /// What happened since the last call.
  std::vector<InputEvent> TakeInput();
  /// True once after the system wants it drawn anew (resized, uncovered).
  bool TakeRefresh();
  bool closing() const;
  void Close();

  /// Begins a picture: makes fonts anew if the content's scale has changed.
  absl::Status Begin();
  /// Draws what ImGui was told, and shows it. Returns when it has been handed over.
  void End();

  float width() const;  // GLFW screen coordinates
  float height() const;
  /// Of the interface in them, as the monitor wants it: a window that moves to another one changes.
  float scale() const;
  /// Framebuffer pixels by screen coordinate.
  float pixel_ratio() const;
  Place place() const;

 private:
  explicit Window(GLFWwindow* window) : window_(window) {}
  absl::Status Start();
  void Listen();
  void Add(InputEvent event);
  void OnKey(int key, int scancode, int action, int mods);
  void OnCharacter(unsigned codepoint);
  /// In place of the backend's own, after it was set up.
  void ListenToKeys();
  void ShareClipboard();

  GLFWwindow* window_;
  GlFunctions gl_;
  Fonts fonts_;
  float fonts_scale_ = 0;
  std::string pasted_;  // what ImGui was last given from the clipboard
  bool light_ = false, light_shown_ = false;
  bool imgui_ = false, refresh_ = true, repeating_ = false;
  std::vector<InputEvent> input_;
  KeyQueue keys_;  // to ImGui
};

}  // namespace saccade::view
