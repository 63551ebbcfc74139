#include <absl/strings/str_format.h>

#include <iostream>

#include "server/eval/commands.hpp"
#include "server/eval/scene/figures.hpp"

namespace saccade {

absl::Status FiguresCommand(const std::filesystem::path& out) {
  const auto figures = RunFigures(out);
  if (!figures.ok()) return figures.status();
  for (const FigureResult& one : *figures) {
    std::cout << absl::StrFormat(
        "%-24s %d squares, camera off by %.1f mm and %.2f deg, light known to %.0f %%\n", one.file,
        one.squares, one.position_mm, one.angle_deg, 100.0 * one.light);
  }
  return absl::OkStatus();
}

}  // namespace saccade
