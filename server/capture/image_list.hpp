#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <filesystem>
#include <string>
#include <vector>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// Seconds in decimal ("1305031102.175304") to nanoseconds, exactly: no detour over floating point.
/// InvalidArgument: not digits with at most one point, or beyond int64 nanoseconds (year 2262);
/// then the message says in which unit the number would be a date.
absl::StatusOr<Timestamp> ParseSeconds(absl::string_view text);

/// One line of rgb.txt.
struct ImageEntry {
  std::string timestamp;  // the text as written
  Timestamp time_ns = 0;
  std::string file;  // relative to the data set's folder
  int line = 0;      // in rgb.txt, from 1
};

/// Reads rgb.txt: lines of `SECONDS FILE`, comments with #, CRLF and a byte order mark accepted.
/// At least one entry, times strictly increasing, and not in another unit than seconds: pictures
/// that are three seconds apart or more, in the median of three intervals or more, are refused.
/// Errors name file, line and remedy.
absl::StatusOr<std::vector<ImageEntry>> LoadImageList(const std::filesystem::path& file);

}  // namespace saccade
