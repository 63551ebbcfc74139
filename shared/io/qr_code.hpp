#pragma once

#include <absl/strings/string_view.h>

#include <string>
#include <vector>

namespace saccade {

/// `text` as a QR code for a terminal, two rows of modules a line (half blocks), with its quiet
/// zone, dark on light whatever the terminal's colours. Empty: too long for one (2900 bytes).
std::vector<std::string> QrCodeLines(absl::string_view text);

}  // namespace saccade
