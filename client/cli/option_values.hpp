#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <CLI/CLI.hpp>
#include <cstdint>

namespace saccade::cli {

/// RRGGBB, as on the page, to 0xRRGGBBff.
absl::StatusOr<std::uint32_t> ParseColor(absl::string_view text);

/// As CLI::Range, which lets NaN through: no comparison with it holds.
CLI::Validator Number(double least, double most);

/// Digits alone: a sign or a dot would be read as another number.
CLI::Validator Id();

/// Text that the API can carry.
CLI::Validator Utf8();

}  // namespace saccade::cli
