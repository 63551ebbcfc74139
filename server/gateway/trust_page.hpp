#pragma once

#include <string>

#include "server/gateway/static_files.hpp"

namespace saccade {

/// Where the root is, for phones and for programs.
inline constexpr char kTrustPath[] = "/trust";
inline constexpr char kRootForPhones[] = "/trust/saccade-root.crt";
inline constexpr char kRootForPrograms[] = "/trust/saccade-root.pem";

/// Adds the root of the server's own authority, and a page that says how a phone or a computer is
/// made to trust it. `sha256`: its fingerprint.
void AddTrustPage(const std::string& root_pem, const std::string& sha256, StaticFiles& files);

}  // namespace saccade
