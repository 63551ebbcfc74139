#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <vector>

namespace saccade {

/// A line of a text file of numbers.
struct NumberRow {
  int line = 0;  // from 1
  std::vector<double> values;
};

/// Reads lines of `columns` finite numbers apart by blanks or commas; lines that are empty or begin
/// with # are passed over. `what` says what the columns are, for example "subject x y".
/// Errors name file, line and remedy:
///   NotFound, PermissionDenied, DataLoss  as ReadRegularFile
///   InvalidArgument  another number of columns, not finite numbers, or no line at all
absl::StatusOr<std::vector<NumberRow>> LoadNumbers(const std::filesystem::path& file, int columns,
                                                   const char* what);

/// InvalidArgument: "FILE, line N: `problem`".
absl::Status BadLine(const std::filesystem::path& file, int line, const std::string& problem);

}  // namespace saccade
