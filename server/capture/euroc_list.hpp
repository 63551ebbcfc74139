#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <string>
#include <vector>

#include "server/capture/image_list.hpp"

namespace saccade {

/// Reads cam0/data.csv of the EuRoC layout: lines of `NANOSECONDS,FILE`. At least one entry, times
/// strictly increasing. Errors name file, line and remedy.
absl::StatusOr<std::vector<ImageEntry>> LoadEurocList(const std::filesystem::path& file);

/// "1403636579.763555584": nanoseconds as seconds, exactly.
std::string EurocSeconds(Timestamp time_ns);

}  // namespace saccade
