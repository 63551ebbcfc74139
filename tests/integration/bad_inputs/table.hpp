#pragma once

#include <string>

#include "tests/integration/support/process.hpp"

namespace saccade::testing {

/// Records one bad input and what it got, and fails the test if that was not what it should get.
/// The program prints all rows as a Markdown table at its end.
void Row(const std::string& group, const std::string& input, const std::string& got, bool expected);

/// Starts saccade-server with `arguments` (free ports are added) and waits for its end. A row that
/// is as expected if it ended with `exit_code` and one line on stderr that contains `part`.
void ExpectRefusedStart(const std::string& input, const std::vector<std::string>& arguments,
                        int exit_code, const std::string& part);

/// True if `server` answers `saccade status` and is still the same process.
bool IsWell(Server& server);

}  // namespace saccade::testing
