#pragma once

#include <string>

#include "server/identity/certificate.hpp"

namespace saccade {

/// What an authority for `names` may vouch for, in the words of OpenSSL's configuration
/// ("critical,permitted;DNS:box,..."); see MakeAuthority.
std::string NameConstraints(const ServerNames& names);

}  // namespace saccade
