#pragma once

#include <absl/strings/string_view.h>

#include <cstdint>
#include <string>

namespace saccade {

/// What somebody may do. Each may do what those before it may.
enum class AccessRole {
  kAnyone,     // no token
  kViewer,     // sees everything, changes nothing
  kAnnotator,  // places marks
  kPilot,      // turns the head, resets the map
  kWearer,     // takes the head away from a pilot, and stops it
  kOwner,      // who started the server: lets people in, and throws them out
};

/// "viewer"; of kAnyone "anyone".
absl::string_view Word(AccessRole role);
/// kAnyone where there is no such word.
AccessRole AccessRoleOf(absl::string_view word);

/// Who calls, as far as a token tells.
struct Access {
  /// Of the pass (see AccessBook); empty where the server lets in everybody. No secret.
  std::string id;
  AccessRole role = AccessRole::kWearer;
  std::int64_t expires_unix_s = 0;  // 0: never
  bool waiting = false;             // to be let in: may do nothing yet, and so has no role
  /// Of whom the pass came: an invite, or a person who signed in; empty: of neither. Whoever has
  /// many passes of one has no more than its allowance.
  std::string invite_id{};
  std::string person{};  // their name by the firm's provider; empty: did not sign in
};

}  // namespace saccade
