#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>
#include <absl/strings/string_view.h>
#include <absl/types/span.h>

#include <cstdint>
#include <string>

namespace saccade {

/// InvalidArgument naming person_key, unless it is 32 to 64 of [A-Za-z0-9_-]. Never quotes it.
absl::Status CheckPersonKey(absl::string_view key);

/// The UUID (version 8) that others know the owner of `key` by: of its SHA-256, which tells nothing
/// of the key.
std::string PersonIdOf(absl::string_view key);

/// Colours of persons, 0xRRGGBBAA: none near the four that stand for sources of features (red,
/// blue, yellow, green).
absl::Span<const std::uint32_t> PersonColors();

/// The colour for a person who has none yet: of those that fewest of `in_use` have (colour by
/// person), one that is always the same for the same person.
std::uint32_t ChoosePersonColor(absl::string_view person_id,
                                const absl::flat_hash_map<std::string, std::uint32_t>& in_use);

}  // namespace saccade
