#pragma once

#include <cstdio>
#include <string>

namespace saccade {

/// A length in words, in the unit that it is thought of in: "3 mm", "53 cm", "2.3 m". What is
/// beyond ten metres is said so, without a figure that nobody would believe. Only of metric maps.
inline std::string LengthText(double length_m) {
  if (!(length_m < 10.0)) return "more than 10 m";
  char text[32];
  if (length_m < 0.0995) {
    std::snprintf(text, sizeof text, "%.0f mm", 1e3 * length_m);
  } else if (length_m < 0.995) {
    std::snprintf(text, sizeof text, "%.0f cm", 1e2 * length_m);
  } else {
    std::snprintf(text, sizeof text, "%.1f m", length_m);
  }
  return text;
}

}  // namespace saccade
