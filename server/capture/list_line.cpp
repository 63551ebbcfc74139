#include "server/capture/list_line.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <vector>

#include "server/capture/stray_file.hpp"

namespace saccade {
namespace {

constexpr absl::string_view kForm = "write `SECONDS FILE`";

bool IsNumber(absl::string_view text) {
  double number = 0;
  return absl::SimpleAtod(text, &number);
}

bool IsPictureName(absl::string_view text) {
  for (const char* ending :
       {".png", ".jpg", ".jpeg", ".pgm", ".ppm", ".pnm", ".bmp", ".tif", ".tiff", ".webp"}) {
    if (absl::EndsWithIgnoreCase(text, ending)) return true;
  }
  return false;
}

bool IsQuoted(absl::string_view text) {
  return text.size() > 1 && (text.front() == '"' || text.front() == '\'') &&
         text.back() == text.front();
}

std::string OfColumns(const std::vector<absl::string_view>& words) {
  const auto numbers = std::count_if(words.begin(), words.end(), IsNumber);
  if (words.size() == 8 && numbers == 8) {
    return absl::StrCat(
        "is a line of a trajectory (SECONDS tx ty tz qx qy qz qw), not of a list "
        "of pictures; ",
        kForm);
  }
  if (words.size() >= 4 && IsNumber(words[0]) && !IsNumber(words[1]) && IsNumber(words[2]) &&
      !IsNumber(words[3])) {
    return absl::StrCat(
        "associates two lists (SECONDS FILE SECONDS FILE); keep the pictures' columns: `cut -d' ' "
        "-f1,2`, or -f3,4 if ",
        words[3], " is the picture");
  }
  if (words.size() == 2 && IsPictureName(words[0]) && IsNumber(words[1])) {
    return absl::StrCat("has the file before the time; ", kForm);
  }
  return "";
}

std::string OfFirstWord(absl::string_view first, bool alone) {
  const std::size_t comma = first.find_first_of(",;");
  if (comma != absl::string_view::npos) {
    const absl::string_view before = first.substr(0, comma), after = first.substr(comma + 1);
    if (!alone && !after.empty() && IsNumber(before) && IsNumber(after)) {
      return absl::StrCat("has a decimal comma; write ", before, ".", after);
    }
    if (alone || after.empty()) {
      return absl::StrCat("is separated by '", first.substr(comma, 1), "'; ", kForm,
                          " with a space: `sed -i 's/", first.substr(comma, 1),
                          " */ /'`, and the time in seconds");
    }
  }
  if (alone && IsPictureName(first)) {
    return absl::StrCat("has no time; ", kForm, ", where the time is when the picture was taken");
  }
  if (absl::EqualsIgnoreCase(first, "timestamp") || absl::EqualsIgnoreCase(first, "time")) {
    return "is a heading; begin it with #";
  }
  return "";
}

}  // namespace

std::string WhatIsWrongWithList(absl::string_view text) {
  const bool marked = absl::StartsWith(text, "\xFF\xFE") || absl::StartsWith(text, "\xFE\xFF");
  const absl::string_view begin = text.substr(0, 64);
  const auto zeros = std::count(begin.begin(), begin.end(), '\0');
  if (marked || (begin.size() >= 8 && zeros * 3 > std::ssize(begin) && zeros < std::ssize(begin))) {
    return "is UTF-16; save it as UTF-8: `iconv -f UTF-16 -t UTF-8`";
  }
  return NameOfStray({text.data(), text.size()});
}

std::string WhatIsWrongWithLine(absl::string_view line) {
  const std::vector<absl::string_view> words =
      absl::StrSplit(line, absl::ByAnyChar(" \t"), absl::SkipEmpty());
  const absl::string_view rest =
      absl::StripAsciiWhitespace(line.substr(std::min(line.size(), line.find_first_of(" \t"))));
  if (absl::StartsWith(line, "\"") || absl::StartsWith(line, "'") || IsQuoted(rest)) {
    return absl::StrCat("has quotes; ", kForm, " without them");
  }
  if (std::string what = OfColumns(words); !what.empty()) return what;
  return OfFirstWord(words[0], words.size() == 1);
}

}  // namespace saccade
