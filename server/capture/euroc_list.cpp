#include "server/capture/euroc_list.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>

#include <utility>

#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{64} << 20;
constexpr Timestamp kSecond_ns = 1'000'000'000;

absl::Status At(const std::filesystem::path& file, int line, absl::string_view problem) {
  return absl::InvalidArgumentError(
      absl::StrCat(file.string(), ":", line, ": ", problem, "; write `NANOSECONDS,FILE`"));
}

}  // namespace

std::string EurocSeconds(Timestamp time_ns) {
  return absl::StrFormat("%d.%09d", time_ns / kSecond_ns, time_ns % kSecond_ns);
}

absl::StatusOr<std::vector<ImageEntry>> LoadEurocList(const std::filesystem::path& file) {
  const absl::StatusOr<std::string> list = ReadRegularFile(file, kMaxBytes, "a list of pictures");
  if (absl::IsNotFound(list.status())) {
    return absl::NotFoundError(absl::StrCat(file.string(),
                                            ": cannot be opened; a data set in EuRoC layout has "
                                            "its pictures listed there, `NANOSECONDS,FILE`"));
  }
  if (!list.ok()) return list.status();
  std::vector<ImageEntry> entries;
  int line = 0;
  for (const absl::string_view text : absl::StrSplit(*list, '\n')) {
    ++line;
    const absl::string_view rest = absl::StripAsciiWhitespace(text);
    if (rest.empty() || rest.front() == '#') continue;
    const std::pair<absl::string_view, absl::string_view> pair =
        absl::StrSplit(rest, absl::MaxSplits(',', 1));
    ImageEntry entry;
    entry.file = std::string(absl::StripAsciiWhitespace(pair.second));
    entry.line = line;
    if (!absl::SimpleAtoi(absl::StripAsciiWhitespace(pair.first), &entry.time_ns) ||
        entry.time_ns < 0) {
      return At(file, line, "the time stamp is not a whole number of nanoseconds");
    }
    if (entry.file.empty()) return At(file, line, "has no file name");
    entry.timestamp = EurocSeconds(entry.time_ns);
    if (!entries.empty() && entry.time_ns <= entries.back().time_ns) {
      return At(file, line,
                absl::StrCat("time stamp ", entry.time_ns, " is not after ", entries.back().time_ns,
                             " of line ", entries.back().line));
    }
    entries.push_back(std::move(entry));
  }
  if (entries.empty()) return At(file, line, "lists no picture");
  return entries;
}

}  // namespace saccade
