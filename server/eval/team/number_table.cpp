#include "server/eval/team/number_table.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <cmath>
#include <string>

#include "shared/io/regular_file.hpp"

namespace saccade {

namespace {
constexpr std::size_t kMaxBytes = std::size_t{256} << 20;
}

absl::Status BadLine(const std::filesystem::path& file, int line, const std::string& problem) {
  return absl::InvalidArgumentError(absl::StrCat(file.string(), ", line ", line, ": ", problem));
}

absl::StatusOr<std::vector<NumberRow>> LoadNumbers(const std::filesystem::path& file, int columns,
                                                   const char* what) {
  const absl::StatusOr<std::string> whole = ReadRegularFile(file, kMaxBytes, what);
  if (!whole.ok()) return whole.status();
  std::vector<NumberRow> rows;
  int line = 0;
  for (absl::string_view text : absl::StrSplit(*whole, '\n')) {
    ++line;
    text = absl::StripAsciiWhitespace(text);
    if (text.empty() || text.front() == '#') continue;
    NumberRow row{line, {}};
    row.values.reserve(static_cast<std::size_t>(columns));
    for (const absl::string_view field :
         absl::StrSplit(text, absl::ByAnyChar(" \t,"), absl::SkipEmpty())) {
      double value = 0;
      if (!absl::SimpleAtod(field, &value) || !std::isfinite(value)) {
        return BadLine(
            file, line,
            absl::StrCat("'", field.substr(0, 40), "' is not a finite number; a line is: ", what));
      }
      row.values.push_back(value);
    }
    if (row.values.size() != static_cast<std::size_t>(columns)) {
      return BadLine(file, line,
                     absl::StrCat("has ", row.values.size(), " numbers, not ", columns,
                                  "; a line is: ", what));
    }
    rows.push_back(std::move(row));
  }
  if (rows.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(file.string(), ": has no line of numbers; a line is: ", what));
  }
  return rows;
}

}  // namespace saccade
