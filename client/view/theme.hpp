#pragma once

#include <absl/status/status.h>
#include <imgui.h>

#include <cstdint>

#include "shared/scene/map_snapshot.hpp"

/// Colours and type, as the page's (web/src/ui/base.css). Red, blue, yellow and green belong to
/// features.
namespace saccade::view {

inline constexpr ImU32 kGround = IM_COL32(0x13, 0x14, 0x15, 255);
inline constexpr ImU32 kBar = IM_COL32(0x1b, 0x1c, 0x1e, 255);
inline constexpr ImU32 kPanel = IM_COL32(0x20, 0x22, 0x24, 255);
inline constexpr ImU32 kRaised = IM_COL32(0x2a, 0x2d, 0x30, 255);
inline constexpr ImU32 kLine = IM_COL32(0x34, 0x37, 0x3b, 255);
inline constexpr ImU32 kText = IM_COL32(0xe9, 0xea, 0xeb, 255);
inline constexpr ImU32 kDim = IM_COL32(0xa9, 0xae, 0xb4, 255);
inline constexpr ImU32 kAccent = IM_COL32(0xc4, 0xb0, 0xff, 255);
inline constexpr ImU32 kOnAccent = IM_COL32(0x17, 0x13, 0x1f, 255);
inline constexpr ImU32 kWarn = IM_COL32(0xff, 0xab, 0x66, 255);
inline constexpr ImU32 kHalo = IM_COL32(0, 0, 0, 166);
inline constexpr ImU32 kWhite = IM_COL32_WHITE;
inline constexpr ImU32 kAxis = IM_COL32(0xc9, 0xcc, 0xd0, 255);
inline constexpr ImU32 kTarget = IM_COL32(0x57, 0xd9, 0x77, 255);

/// Of what stands round the panes; those stay dark, as a picture's own light is what counts there.
struct Palette {
  ImU32 bar, panel, raised, line, text, dim, accent, on_accent, warn;
};
inline constexpr Palette kDark = {kBar, kPanel,  kRaised,   kLine, kText,
                                  kDim, kAccent, kOnAccent, kWarn};
inline constexpr Palette kLight = {IM_COL32(0xe4, 0xe6, 0xe8, 255), IM_COL32(0xf4, 0xf5, 0xf6, 255),
                                   IM_COL32(0xff, 0xff, 0xff, 255), IM_COL32(0xc6, 0xca, 0xce, 255),
                                   IM_COL32(0x17, 0x18, 0x1a, 255), IM_COL32(0x4c, 0x52, 0x58, 255),
                                   IM_COL32(0x5a, 0x3f, 0xb3, 255), IM_COL32(0xff, 0xff, 0xff, 255),
                                   IM_COL32(0x8f, 0x40, 0x00, 255)};
/// As ApplyTheme was told last. The main thread, as ImGui's own style.
const Palette& Colours();

ImU32 ColorOf(FeatureState state);
/// 0xRRGGBBAA, drawn opaque.
inline ImU32 ColorOf(std::uint32_t rgba) {
  return IM_COL32(rgba >> 24 & 0xff, rgba >> 16 & 0xff, rgba >> 8 & 0xff, 255);
}

struct Fonts {
  ImFont* text = nullptr;
  ImFont* bold = nullptr;
};

/// Whether every font here has that character.
bool IsAlwaysThere(unsigned character);

/// Sets ImGui's style and makes its fonts at this scale, with the glyphs that Types() has; may be
/// called again when either changes. The font texture has to be made anew then.
///   NotFound  no font of DejaVu is installed, with the package's name
absl::Status ApplyTheme(float scale, bool light, Fonts& fonts);

}  // namespace saccade::view
