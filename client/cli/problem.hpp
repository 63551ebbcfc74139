#pragma once

#include <absl/status/status.h>

#include <nlohmann/json.hpp>
#include <string>

#include "client/cli/options.hpp"

namespace saccade::cli {

/// What went wrong in the words of who typed the command: "--pixel: u 5000 is outside the picture
/// (-0.5 to 319.5)" where the server says "draft.target.frame_pixel.pixel.u: 5000 is ...". One
/// line, without control characters, at most 2000 bytes.
std::string ProblemText(const Options& options, const absl::Status& problem);

/// {"error": {"code": "NOT_FOUND", "message": "..."}}; codes are gRPC's names.
nlohmann::json ProblemJson(absl::StatusCode code, const std::string& message);

}  // namespace saccade::cli
