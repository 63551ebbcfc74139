#include "server/capture/image_list.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "server/capture/list_line.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxLine = 4096;
constexpr std::size_t kMaxListBytes = std::size_t{64} << 20;  // a million pictures: nine hours

absl::Status AtLine(const std::filesystem::path& file, int line, absl::string_view problem) {
  return absl::InvalidArgumentError(absl::StrCat(file.string(), ":", line, ": ", problem));
}

/// Text of an error's value, so that a binary file does not end on the terminal.
std::string Quoted(absl::string_view text) {
  std::string quoted = "'";
  for (const char c : text.substr(0, 40)) quoted += absl::ascii_isprint(c) ? c : '?';
  return quoted + (text.size() > 40 ? "...'" : "'");
}

/// "; it looks like microseconds, so divide by 1000000", by what would make `seconds` less than
/// `most`; empty if nothing would.
std::string UnitRemedy(double seconds, double most, absl::string_view what) {
  constexpr std::pair<absl::string_view, double> kUnits[] = {
      {"milliseconds", 1e3}, {"microseconds", 1e6}, {"nanoseconds", 1e9}};
  for (const auto& [unit, factor] : kUnits) {
    if (seconds / factor >= most) continue;
    return absl::StrCat("; ", what, " looks like ", unit, ": divide by ",
                        absl::StrFormat("%.0f", factor));
  }
  return "";
}

constexpr Timestamp kUnlikely_ns = 3'000'000'000;  // between pictures: 300 fps in milliseconds
constexpr double kYear2262_s = 9.2e9;

/// Median of the intervals [ns]; 0 if there are fewer than three, which say nothing.
Timestamp MedianInterval(const std::vector<ImageEntry>& entries) {
  if (entries.size() < 4) return 0;
  std::vector<Timestamp> intervals;
  for (std::size_t i = 1; i < entries.size(); ++i) {
    intervals.push_back(entries[i].time_ns - entries[i - 1].time_ns);
  }
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

/// The list as far as it was read, if its time stamps cannot be seconds.
absl::Status CheckUnit(const std::filesystem::path& file, const std::vector<ImageEntry>& entries) {
  const Timestamp median_ns = MedianInterval(entries);
  if (median_ns < kUnlikely_ns) return absl::OkStatus();
  return AtLine(file, entries[1].line,
                absl::StrCat("time stamps are in seconds, and these are ",
                             absl::StrFormat("%.6g", Seconds(median_ns)),
                             " s apart in the median, too far to follow a camera",
                             UnitRemedy(Seconds(median_ns), Seconds(kUnlikely_ns), "this")));
}

}  // namespace

absl::StatusOr<Timestamp> ParseSeconds(absl::string_view text) {
  const auto refuse = [text](absl::string_view why) {
    return absl::InvalidArgumentError(absl::StrCat("time stamp ", Quoted(text), " ", why));
  };
  const auto beyond = [&] {
    double seconds = 0;
    return refuse(absl::StrCat(
        "is beyond the year 2262 in seconds",
        absl::SimpleAtod(text, &seconds) ? UnitRemedy(seconds, kYear2262_s, "it") : std::string()));
  };
  constexpr Timestamp kMax = std::numeric_limits<Timestamp>::max();
  Timestamp value = 0;
  int decimals = -1;  // -1: no point yet
  bool digits = false;
  for (const char c : text) {
    if (c == '.' && decimals < 0) {
      decimals = 0;
      continue;
    }
    if (!absl::ascii_isdigit(c)) return refuse("is not a decimal number of seconds");
    digits = true;
    if (decimals >= 9) continue;  // below a nanosecond
    if (value > (kMax - 9) / 10) return beyond();
    value = 10 * value + (c - '0');
    if (decimals >= 0) ++decimals;
  }
  if (!digits) return refuse("is not a decimal number of seconds");
  for (int i = std::max(decimals, 0); i < 9; ++i) {
    if (value > kMax / 10) return beyond();
    value *= 10;
  }
  return value;
}

absl::StatusOr<std::vector<ImageEntry>> LoadImageList(const std::filesystem::path& file) {
  const absl::StatusOr<std::string> list =
      ReadRegularFile(file, kMaxListBytes, "a list of pictures");
  if (absl::IsNotFound(list.status())) {
    return absl::NotFoundError(absl::StrCat(
        file.string(), ": cannot be opened; a data set in TUM layout needs rgb.txt with ",
        "one line `SECONDS FILE` for each picture"));
  }
  if (!list.ok()) return list.status();
  if (const std::string wrong = WhatIsWrongWithList(*list); !wrong.empty()) {
    return AtLine(file, 1, wrong);
  }
  std::vector<ImageEntry> entries;
  int line = 0;
  for (const absl::string_view text : absl::StrSplit(*list, '\n')) {
    ++line;
    if (text.size() > kMaxLine) return AtLine(file, line, "is too long; is this a text file?");
    absl::string_view rest = text;
    if (line == 1) absl::ConsumePrefix(&rest, "\xEF\xBB\xBF");
    rest = absl::StripAsciiWhitespace(rest);
    if (rest.empty() || rest.front() == '#') continue;
    if (const std::string wrong = WhatIsWrongWithLine(rest); !wrong.empty()) {
      return AtLine(file, line, absl::StrCat(Quoted(rest), " ", wrong));
    }
    const std::size_t gap = rest.find_first_of(" \t");
    if (gap == absl::string_view::npos) {
      return AtLine(file, line,
                    absl::StrCat(Quoted(rest), " has no file name; write `SECONDS FILE`"));
    }
    ImageEntry entry;
    entry.timestamp = std::string(rest.substr(0, gap));
    entry.file = std::string(absl::StripAsciiWhitespace(rest.substr(gap)));
    entry.line = line;
    const absl::StatusOr<Timestamp> time = ParseSeconds(entry.timestamp);
    if (!time.ok()) {  // a count of nanoseconds from 0 ends in the year 2262 after nine seconds
      if (absl::Status unit = CheckUnit(file, entries); !unit.ok()) return unit;
      return AtLine(file, line, absl::StrCat(time.status().message(), "; write `SECONDS FILE`"));
    }
    entry.time_ns = *time;
    if (!entries.empty() && entry.time_ns <= entries.back().time_ns) {
      return AtLine(
          file, line,
          absl::StrCat("time stamp ", entry.timestamp, " is not after ", entries.back().timestamp,
                       " of line ", entries.back().line,
                       "; sort the lines by time and remove repeated ones, or, if the clock was "
                       "set back here, make two recordings of it"));
    }
    entries.push_back(std::move(entry));
  }
  if (entries.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(file.string(), ": lists no picture; write one line `SECONDS FILE` for each"));
  }
  if (absl::Status unit = CheckUnit(file, entries); !unit.ok()) return unit;
  return entries;
}

}  // namespace saccade
