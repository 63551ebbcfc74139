#pragma once

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

namespace saccade::wire {

/// InvalidArgument "FIELD: PROBLEM", as every reader of a message says what is wrong with it.
inline absl::Status BadField(absl::string_view field, absl::string_view problem) {
  return absl::InvalidArgumentError(absl::StrCat(field, ": ", problem));
}

}  // namespace saccade::wire
