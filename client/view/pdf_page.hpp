#pragma once

#include <absl/status/statusor.h>

#include <string>

namespace saccade::view {

/// One page of a PDF, from 1, as the bytes of a PNG whose longer side is 2000 px.
///
/// Drawn by `pdftoppm` (poppler-utils) in a process of its own: it is GPL, and a file that breaks
/// it breaks nothing else. Blocks, ten seconds at most.
///   FailedPrecondition  poppler-utils is not installed
///   InvalidArgument     no such page, a password, or no PDF; in words for a person
absl::StatusOr<std::string> DrawPdfPage(const std::string& file, int page);

}  // namespace saccade::view
