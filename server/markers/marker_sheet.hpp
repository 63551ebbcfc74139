#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <filesystem>
#include <string>
#include <vector>

namespace saccade {

/// Markers to be printed.
struct SheetOptions {
  std::string family = "koller";
  std::vector<int> ids;
  double side_m = 0.16;      // of the black border's outside
  std::string paper = "a4";  // or "letter"
};

/// Ids as they are typed: "0:8" (half open), "3", "1,4,9".
///   InvalidArgument  anything else, none, or one twice
absl::StatusOr<std::vector<int>> ParseMarkerIds(absl::string_view text);

/// How the markers of a sheet lie on its pages, in mm from a page's top left.
struct SheetLayout {
  double page_width_mm = 0, page_height_mm = 0;
  struct Place {
    int page = 0, id = 0;
    double left_mm = 0, top_mm = 0;
  };
  std::vector<Place> places;
  int pages = 0;
};
///   InvalidArgument  no such paper, or so large a marker does not fit on it: says how large may be
absl::StatusOr<SheetLayout> LayOutSheet(const SheetOptions& options);

/// Draws them to `file`, in vectors: PDF; or, if they fit on one page, SVG or PNG (300 dpi) by the
/// name's end. Each has its family, id and side in words below it; each page a ruler of 100 mm, by
/// which the printer is checked. Never writes over a file.
///   InvalidArgument  as above, no such family or id, another ending, too many for one page
///   AlreadyExists    there is such a file
///   Unavailable      it cannot be written
absl::StatusOr<SheetLayout> WriteMarkerSheet(const SheetOptions& options,
                                             const std::filesystem::path& file);

}  // namespace saccade
