#include <absl/strings/str_format.h>

#include <iostream>

#include "server/eval/commands.hpp"
#include "server/markers/marker_sheet.hpp"

namespace saccade {

absl::Status PrintMarkersCommand(const PrintMarkersArguments& arguments) {
  absl::StatusOr<std::vector<int>> ids = ParseMarkerIds(arguments.ids);
  if (!ids.ok()) return ids.status();
  SheetOptions options;
  options.family = arguments.family;
  options.ids = *std::move(ids);
  options.side_m = arguments.side_m;
  options.paper = arguments.paper;
  const absl::StatusOr<SheetLayout> sheet = WriteMarkerSheet(options, arguments.out);
  if (!sheet.ok()) return sheet.status();
  std::cout << absl::StrFormat(
      "%d markers of %s, side %g mm, on %d pages of %s: %s; print at 100 %% and measure the "
      "ruler\n",
      sheet->places.size(), options.family, 1e3 * options.side_m, sheet->pages, options.paper,
      arguments.out.string());
  return absl::OkStatus();
}

}  // namespace saccade
