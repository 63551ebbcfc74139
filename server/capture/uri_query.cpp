#include "server/capture/uri_query.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cmath>

namespace saccade {

UriQuery::UriQuery(absl::string_view scheme, absl::string_view rest) : scheme_(scheme) {
  const std::pair<std::string, std::string> parts = absl::StrSplit(rest, absl::MaxSplits('?', 1));
  path_ = parts.first;
  for (const absl::string_view piece : absl::StrSplit(parts.second, '&', absl::SkipEmpty())) {
    std::pair<std::string, std::string> pair = absl::StrSplit(piece, absl::MaxSplits('=', 1));
    const auto same = [&](const auto& each) { return each.first == pair.first; };
    if (std::any_of(values_.begin(), values_.end(), same)) Fail(pair.first, "is there twice");
    if (pair.second.empty()) Fail(pair.first, "has no value; write key=value");
    values_.push_back(std::move(pair));
  }
}

bool UriQuery::Has(absl::string_view key) const {
  return std::any_of(values_.begin(), values_.end(),
                     [&](const auto& each) { return each.first == key; });
}

std::optional<std::string> UriQuery::Text(absl::string_view key) {
  const auto found = std::find_if(values_.begin(), values_.end(),
                                  [&](const auto& each) { return each.first == key; });
  if (found == values_.end()) return std::nullopt;
  std::string value = std::move(found->second);
  values_.erase(found);
  return value;
}

std::optional<double> UriQuery::Number(absl::string_view key, double least, double most) {
  const std::optional<std::string> text = Text(key);
  if (!text) return std::nullopt;
  double number = 0;
  if (absl::SimpleAtod(*text, &number) && number >= least && number <= most) return number;
  Fail(key, absl::StrCat("'", *text, "' is not a number from ", least, " to ", most));
  return std::nullopt;
}

std::optional<bool> UriQuery::Flag(absl::string_view key) {
  const std::optional<std::string> text = Text(key);
  if (!text) return std::nullopt;
  bool value = false;
  if (!absl::SimpleAtob(*text, &value)) Fail(key, absl::StrCat("'", *text, "': give 1 or 0"));
  return value;
}

void UriQuery::Fail(absl::string_view key, absl::string_view problem) {
  if (!status_.ok()) return;
  status_ =
      absl::InvalidArgumentError(absl::StrCat("source ", scheme_, path_, ": ", key, " ", problem));
}

absl::Status UriQuery::Finish(absl::string_view known) {
  if (!values_.empty()) {
    Fail(values_.front().first, absl::StrCat("is not known; there are ", known));
  }
  return status_;
}

}  // namespace saccade
