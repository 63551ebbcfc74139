#include "server/rpc/persons.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <limits>

#include "server/identity/secret.hpp"

namespace saccade {
namespace {

constexpr std::size_t kLeastKey = 32, kLongestKey = 64;
// Orange, pink, pale cyan, violet, tan, magenta, silver, white.
constexpr std::array<std::uint32_t, 8> kColors = {0xff9a3dff, 0xff8ad8ff, 0x9fe7e7ff, 0xb79bffff,
                                                  0xd9b38cff, 0xd264ffff, 0xb4bcc6ff, 0xffffffff};

}  // namespace

absl::Status CheckPersonKey(absl::string_view key) {
  const auto allowed = [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_';
  };
  if (key.size() >= kLeastKey && key.size() <= kLongestKey &&
      std::all_of(key.begin(), key.end(), allowed)) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat("person_key: must be ", kLeastKey, " to ",
                                                 kLongestKey, " characters of [A-Za-z0-9_-]"));
}

std::string PersonIdOf(absl::string_view key) {
  const std::string hex = Sha256Hex(absl::StrCat("saccade person\n", key));
  const absl::string_view h = hex;
  // RFC 9562: version 8, variant 10.
  const char variant = "89ab"[(h[16] >= 'a' ? h[16] - 'a' + 10 : h[16] - '0') & 3];
  return absl::StrCat(h.substr(0, 8), "-", h.substr(8, 4), "-8", h.substr(13, 3), "-",
                      absl::string_view(&variant, 1), h.substr(17, 3), "-", h.substr(20, 12));
}

absl::Span<const std::uint32_t> PersonColors() { return kColors; }

std::uint32_t ChoosePersonColor(absl::string_view person_id,
                                const absl::flat_hash_map<std::string, std::uint32_t>& in_use) {
  const std::string hash = Sha256Hex(person_id);
  const std::size_t begin = static_cast<std::size_t>(hash[0] + 7 * hash[1]);
  std::uint32_t chosen = 0;
  auto fewest = std::numeric_limits<std::ptrdiff_t>::max();
  for (std::size_t i = 0; i < kColors.size(); ++i) {
    const std::uint32_t color = kColors[(begin + i) % kColors.size()];
    const auto users = std::count_if(in_use.begin(), in_use.end(),
                                     [color](const auto& one) { return one.second == color; });
    if (users >= fewest) continue;
    fewest = users;
    chosen = color;
  }
  return chosen;
}

}  // namespace saccade
