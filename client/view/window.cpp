#include "client/view/window.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/view/typesetter.hpp"

namespace saccade::view {
namespace {

constexpr int kLeastWidth = 640, kLeastHeight = 400;
std::string last_error;  // GLFW's own words; main thread

Window* Self(GLFWwindow* window) { return static_cast<Window*>(glfwGetWindowUserPointer(window)); }

}  // namespace

absl::StatusOr<std::unique_ptr<Window>> Window::Open(const std::string& title, const Place& place) {
  glfwSetErrorCallback([](int /*code*/, const char* words) { last_error = words; });
  if (glfwInit() != GLFW_TRUE) {
    return absl::UnavailableError(absl::StrCat(
        "no window can be opened (", last_error,
        "): run it in a graphical session, or with DISPLAY set; `saccade` works without"));
  }
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  glfwWindowHint(GLFW_MAXIMIZED, place.maximised ? GLFW_TRUE : GLFW_FALSE);
  glfwWindowHintString(GLFW_X11_CLASS_NAME, "saccade-client");
  glfwWindowHintString(GLFW_X11_INSTANCE_NAME, "saccade-client");
  GLFWwindow* made = glfwCreateWindow(place.width, place.height, title.c_str(), nullptr, nullptr);
  if (made == nullptr) {
    glfwTerminate();
    return absl::UnavailableError(absl::StrCat("no window with OpenGL 3.3 (", last_error,
                                               "): install the graphics driver, or "
                                               "libgl1-mesa-dri to draw in software"));
  }
  std::unique_ptr<Window> window(new Window(made));
  if (absl::Status started = window->Start(); !started.ok()) return started;
  return window;
}

absl::Status Window::Start() {
  glfwMakeContextCurrent(window_);
  glfwSwapInterval(0);  // the loop paces itself; waiting in the driver would hold input up
  glfwSetWindowSizeLimits(window_, kLeastWidth, kLeastHeight, GLFW_DONT_CARE, GLFW_DONT_CARE);
  absl::StatusOr<GlFunctions> gl = GlFunctions::Load([](const char* name) {
    return reinterpret_cast<GlFunctions::Procedure>(glfwGetProcAddress(name));
  });
  if (!gl.ok()) return gl.status();
  gl_ = *gl;
  Listen();
  ImGui::CreateContext();
  imgui_ = true;
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // where things stand is ours to keep
  io.ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
  ImGui_ImplGlfw_InitForOpenGL(window_, /*install_callbacks=*/true);  // and calls ours
  ListenToKeys();
  ShareClipboard();
  ImGui_ImplOpenGL3_Init("#version 330 core");
  return absl::OkStatus();
}

Window::~Window() {
  if (imgui_) {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
  }
  glfwDestroyWindow(window_);
  glfwTerminate();
}

void Window::Listen() {
  glfwSetWindowUserPointer(window_, this);
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int button, int action, int mods) {
    InputEvent event;
    event.kind = action == GLFW_PRESS ? InputEvent::Kind::kPress : InputEvent::Kind::kRelease;
    event.button = button;
    event.shift = (mods & GLFW_MOD_SHIFT) != 0;
    event.ctrl = (mods & (GLFW_MOD_CONTROL | GLFW_MOD_SUPER)) != 0;
    Self(w)->Add(event);
  });
  glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double /*x*/, double /*y*/) {
    Self(w)->Add({.kind = InputEvent::Kind::kMove});
  });
  glfwSetCursorEnterCallback(window_, [](GLFWwindow* w, int entered) {
    if (entered == 0) Self(w)->Add({.kind = InputEvent::Kind::kLeave});
  });
  glfwSetScrollCallback(window_, [](GLFWwindow* w, double /*dx*/, double dy) {
    Self(w)->Add({.kind = InputEvent::Kind::kScroll, .scroll = static_cast<float>(dy)});
  });
  glfwSetDropCallback(window_, [](GLFWwindow* w, int count, const char** files) {
    if (count > 0) Self(w)->Add({.kind = InputEvent::Kind::kDrop, .file = files[0]});
  });
  glfwSetWindowRefreshCallback(window_, [](GLFWwindow* w) { Self(w)->refresh_ = true; });
  glfwSetFramebufferSizeCallback(window_,
                                 [](GLFWwindow* w, int, int) { Self(w)->refresh_ = true; });
  glfwSetWindowFocusCallback(window_, [](GLFWwindow* w, int focused) {
    Self(w)->refresh_ = true;
    if (focused == 0) Self(w)->Add({.kind = InputEvent::Kind::kLet});
  });
}

void Window::ListenToKeys() {
  glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int scancode, int action, int mods) {
    Self(w)->OnKey(key, scancode, action, mods);
    const auto tell = [=] { ImGui_ImplGlfw_KeyCallback(w, key, scancode, action, mods); };
    // Letters come as characters as well: their keys may be missed, and nobody who types waits.
    const bool modifier = key >= GLFW_KEY_LEFT_SHIFT && key <= GLFW_KEY_RIGHT_SUPER;
    const bool acts = (key >= GLFW_KEY_ESCAPE && !modifier) || (mods & GLFW_MOD_CONTROL) != 0;
    if (acts) {
      Self(w)->keys_.Key(key, action != GLFW_RELEASE, key == GLFW_KEY_TAB, tell);
    } else {
      Self(w)->keys_.Character(tell);
    }
  });
  glfwSetCharCallback(window_, [](GLFWwindow* w, unsigned codepoint) {
    Self(w)->OnCharacter(codepoint);
    // Not by the backend's, which knows nothing beyond U+FFFF.
    Self(w)->keys_.Character([codepoint] {
      ImGui::GetIO().AddInputCharacter(Types().ToField(static_cast<char32_t>(codepoint)));
    });
  });
}

void Window::Add(InputEvent event) {
  double x = 0, y = 0;
  glfwGetCursorPos(window_, &x, &y);
  event.x = static_cast<float>(x);
  event.y = static_cast<float>(y);
  input_.push_back(std::move(event));
}

void Window::OnKey(int key, int scancode, int action, int mods) {
  repeating_ = action == GLFW_REPEAT;
  if (action == GLFW_RELEASE) {
    refresh_ = true;
    if (key == GLFW_KEY_SPACE) Add({.kind = InputEvent::Kind::kLet});
    return;
  }
  static constexpr std::pair<int, const char*> kNames[] = {
      {GLFW_KEY_DELETE, "delete"}, {GLFW_KEY_BACKSPACE, "backspace"},
      {GLFW_KEY_ESCAPE, "escape"}, {GLFW_KEY_TAB, "tab"},
      {GLFW_KEY_ENTER, "enter"},   {GLFW_KEY_LEFT, "left"},
      {GLFW_KEY_RIGHT, "right"},   {GLFW_KEY_UP, "up"},
      {GLFW_KEY_DOWN, "down"},     {GLFW_KEY_F2, "f2"},
      {GLFW_KEY_F9, "f9"}};
  InputEvent event;
  event.kind = InputEvent::Kind::kKey;
  event.repeat = repeating_;
  event.shift = (mods & GLFW_MOD_SHIFT) != 0;
  event.key = {"", (mods & GLFW_MOD_CONTROL) != 0, (mods & GLFW_MOD_ALT) != 0,
               (mods & GLFW_MOD_SUPER) != 0, event.shift};
  for (const auto& [code, name] : kNames) {
    if (code == key) event.key.key = name;
  }
  // Letters come as characters, whatever the keyboard's layout; with Ctrl none comes.
  const char* name = glfwGetKeyName(key, scancode);
  if (event.key.key.empty() && (event.key.ctrl || event.key.super) && name != nullptr) {
    event.key.key = absl::AsciiStrToLower(name);
  }
  refresh_ = true;
  if (!event.key.key.empty()) Add(std::move(event));
}

void Window::OnCharacter(unsigned codepoint) {
  refresh_ = true;
  if (codepoint >= 0x80) return;
  const char c = absl::ascii_tolower(static_cast<unsigned char>(codepoint));
  InputEvent event;
  event.kind = InputEvent::Kind::kKey;
  event.repeat = repeating_;
  event.shift = glfwGetKey(window_, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS ||
                glfwGetKey(window_, GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
  event.key.key = c == '=' ? "+" : std::string(1, c);
  Add(std::move(event));
}

void Window::Wait(double timeout_s) {
  if (timeout_s > 0) {
    glfwWaitEventsTimeout(timeout_s);
  } else {
    glfwPollEvents();
  }
}

/// What lies in the clipboard is as it is written, what is in a field as Types() has it there.
void Window::ShareClipboard() {
  ImGuiIO& io = ImGui::GetIO();
  io.ClipboardUserData = this;
  io.GetClipboardTextFn = [](void* self) -> const char* {
    auto& window = *static_cast<Window*>(self);
    const char* const text = glfwGetClipboardString(window.window_);
    window.pasted_ = Types().ToField(text == nullptr ? "" : text);
    return window.pasted_.c_str();
  };
  io.SetClipboardTextFn = [](void* self, const char* field) {
    glfwSetClipboardString(static_cast<Window*>(self)->window_, Types().FromField(field).c_str());
  };
}

void Window::Wake() { glfwPostEmptyEvent(); }

std::vector<InputEvent> Window::TakeInput() { return std::exchange(input_, {}); }
bool Window::TakeRefresh() { return std::exchange(refresh_, false); }
bool Window::closing() const { return glfwWindowShouldClose(window_) != 0; }
void Window::Close() { glfwSetWindowShouldClose(window_, GLFW_TRUE); }

absl::Status Window::Begin() {
  const float now = scale();
  if (std::abs(now - fonts_scale_) > 0.01f || light_ != light_shown_ || Types().stale()) {
    if (fonts_scale_ > 0) ImGui_ImplOpenGL3_DestroyFontsTexture();
    if (absl::Status themed = ApplyTheme(now, light_, fonts_); !themed.ok()) return themed;
    if (fonts_scale_ > 0) ImGui_ImplOpenGL3_CreateFontsTexture();
    fonts_scale_ = now;
    light_shown_ = light_;
  }
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  return absl::OkStatus();
}

void Window::End() {
  ImGui::Render();
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  gl_.Disable(GL_SCISSOR_TEST);
  gl_.Viewport(0, 0, width, height);
  const ImVec4 ground = ImGui::ColorConvertU32ToFloat4(kGround);
  gl_.ClearColor(ground.x, ground.y, ground.z, 1);
  gl_.Clear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  glfwSwapBuffers(window_);
  gl_.Finish();
  if (keys_.Next()) refresh_ = true;
}

float Window::width() const {
  int width = 0, height = 0;
  glfwGetWindowSize(window_, &width, &height);
  return static_cast<float>(width);
}

float Window::height() const {
  int width = 0, height = 0;
  glfwGetWindowSize(window_, &width, &height);
  return static_cast<float>(height);
}

float Window::pixel_ratio() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  return static_cast<float>(width) / std::max(this->width(), 1.0f);
}

float Window::scale() const {
  float x = 1, y = 1;
  glfwGetWindowContentScale(window_, &x, &y);
  return std::clamp(x / pixel_ratio(), 0.75f, 4.0f);
}

Window::Place Window::place() const {
  Place place;
  glfwGetWindowSize(window_, &place.width, &place.height);
  place.maximised = glfwGetWindowAttrib(window_, GLFW_MAXIMIZED) == GLFW_TRUE;
  return place;
}

}  // namespace saccade::view
