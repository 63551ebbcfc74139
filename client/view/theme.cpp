#include "client/view/theme.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "client/view/typesetter.hpp"

namespace saccade::view {
namespace {

constexpr const char* kFolder = "/usr/share/fonts/truetype/dejavu/";
constexpr float kTextPx = 14;
constexpr float kLineOfEm = 1.164f;  // DejaVu's ascent and descent
// Latin, Greek, Cyrillic; punctuation; arrows, signs and geometric shapes.
constexpr ImWchar kRanges[] = {0x20,   0x24f,  0x370,  0x52f,  0x2010, 0x205e, 0x2190, 0x21ff,
                               0x2200, 0x22ff, 0x25a0, 0x2612, 0x2713, 0x2718, 0};

ImFont* Load(const char* name, float size_px) {
  const std::string file = std::string(kFolder) + name;
  if (!std::filesystem::exists(file)) return nullptr;
  ImFontConfig config;
  config.OversampleH = 2;
  config.PixelSnapH = true;
  return ImGui::GetIO().Fonts->AddFontFromFileTTF(file.c_str(), size_px, &config, kRanges);
}

const Palette* current = &kDark;  // main thread

void Colour(ImGuiCol which, ImU32 color) {
  ImGui::GetStyle().Colors[which] = ImGui::ColorConvertU32ToFloat4(color);
}

}  // namespace

const Palette& Colours() { return *current; }

ImU32 ColorOf(FeatureState state) {
  switch (state) {
    case FeatureState::kMeasured:
      return IM_COL32(0xff, 0x5a, 0x4d, 255);
    case FeatureState::kFailed:
      return IM_COL32(0x4d, 0xa3, 0xff, 255);
    case FeatureState::kNotAttempted:
      break;
  }
  return IM_COL32(0xff, 0xd8, 0x4d, 255);
}

bool IsAlwaysThere(unsigned character) {
  for (const ImWchar* range = kRanges; *range != 0; range += 2) {
    if (character >= range[0] && character <= range[1]) return true;
  }
  return false;
}

absl::Status ApplyTheme(float scale, bool light, Fonts& fonts) {
  current = light ? &kLight : &kDark;
  ImGuiStyle style;
  style.WindowRounding = style.ChildRounding = 0;
  style.FrameRounding = style.PopupRounding = style.GrabRounding = 4;
  style.WindowBorderSize = style.ChildBorderSize = 0;
  style.WindowPadding = {12, 8};
  style.FramePadding = {8, 5};
  style.ItemSpacing = {8, 6};
  style.ScrollbarSize = 10;
  style.ScaleAllSizes(scale);
  ImGui::GetStyle() = style;
  light ? ImGui::StyleColorsLight() : ImGui::StyleColorsDark();
  Colour(ImGuiCol_WindowBg, Colours().panel);
  Colour(ImGuiCol_PopupBg, Colours().raised);
  Colour(ImGuiCol_Text, Colours().text);
  Colour(ImGuiCol_TextDisabled, Colours().dim);
  Colour(ImGuiCol_Border, Colours().line);
  Colour(ImGuiCol_FrameBg, Colours().bar);
  Colour(ImGuiCol_FrameBgHovered, Colours().raised);
  Colour(ImGuiCol_FrameBgActive, Colours().raised);
  Colour(ImGuiCol_Button, Colours().raised);
  Colour(ImGuiCol_ButtonHovered, Colours().line);
  Colour(ImGuiCol_ButtonActive, Colours().line);
  Colour(ImGuiCol_Header, Colours().raised);
  Colour(ImGuiCol_HeaderHovered, Colours().raised);
  Colour(ImGuiCol_HeaderActive, Colours().line);
  Colour(ImGuiCol_ScrollbarBg, Colours().panel);
  Colour(ImGuiCol_ScrollbarGrab, Colours().line);
  Colour(ImGuiCol_CheckMark, Colours().accent);
  Colour(ImGuiCol_NavHighlight, Colours().accent);
  Colour(ImGuiCol_TextSelectedBg,
         light ? IM_COL32(0x5a, 0x3f, 0xb3, 70) : IM_COL32(0xc4, 0xb0, 0xff, 90));
  const float size_px = kTextPx * scale;
  ImFontAtlas& atlas = *ImGui::GetIO().Fonts;
  atlas.Clear();
  fonts.bold = Load("DejaVuSans-Bold.ttf", size_px);
  fonts.text = Load("DejaVuSans.ttf", size_px);
  if (fonts.text == nullptr || fonts.bold == nullptr) {
    return absl::NotFoundError(std::string("no fonts in ") + kFolder +
                               ": install fonts-dejavu-core");
  }
  ImGui::GetIO().FontDefault = fonts.text;
  Types().SetSize(static_cast<int>(std::lround(size_px / kLineOfEm)));
  Types().Reserve(atlas);
  atlas.Build();
  Types().Draw(atlas, {fonts.text, fonts.bold});
  return absl::OkStatus();
}

}  // namespace saccade::view
