#include "server/identity/access.hpp"

#include <array>
#include <cstddef>

namespace saccade {
namespace {

constexpr std::array<absl::string_view, 6> kWords = {"anyone", "viewer", "annotator",
                                                     "pilot",  "wearer", "owner"};

}  // namespace

absl::string_view Word(AccessRole role) { return kWords[static_cast<std::size_t>(role)]; }

AccessRole AccessRoleOf(absl::string_view word) {
  for (std::size_t i = 0; i < kWords.size(); ++i) {
    if (kWords[i] == word) return static_cast<AccessRole>(i);
  }
  return AccessRole::kAnyone;
}

}  // namespace saccade
