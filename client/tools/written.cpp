#include "client/tools/written.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

namespace saccade::tools {
namespace {

constexpr std::size_t kMaxItems = 30, kMaxItemBytes = 100;  // annotation.proto

}  // namespace

std::string CleanText(const std::string& text) {
  std::string clean;
  for (const char c : text) clean += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
  const auto first = clean.find_first_not_of(' ');
  if (first == std::string::npos) return "";
  return clean.substr(first, clean.find_last_not_of(' ') - first + 1);
}

absl::StatusOr<WrittenList> ReadList(const std::string& title, const std::string& lines) {
  WrittenList list{CleanText(title), {}};
  for (const absl::string_view line : absl::StrSplit(lines, '\n')) {
    std::string item = CleanText(std::string(line));
    if (item.size() > kMaxItemBytes) {
      return absl::InvalidArgumentError(absl::StrCat("Line ", list.items.size() + 1, " has ",
                                                     item.size(), " bytes, and at most ",
                                                     kMaxItemBytes, " are kept: shorten it."));
    }
    if (!item.empty()) list.items.push_back(std::move(item));
  }
  if (list.items.empty()) return absl::InvalidArgumentError("Write at least one line.");
  if (list.items.size() > kMaxItems) {
    return absl::InvalidArgumentError(
        absl::StrCat(list.items.size(), " lines, and at most ", kMaxItems, " are kept."));
  }
  if (list.title.size() > kMaxTextBytes) {
    return absl::InvalidArgumentError(absl::StrCat(
        "The title is ", list.title.size() - kMaxTextBytes, " bytes too long: shorten it."));
  }
  return list;
}

}  // namespace saccade::tools
