// What the server's log says of calls that come from the command line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <sstream>
#include <string>
#include <vector>

#include "tests/integration/support/process.hpp"

namespace saccade::testing::server_log_test {
namespace {

// Edits and refusals with who asked; of what only looks, and of heartbeats that are taken, nothing.
TEST(ServerLog, NamesEditsRefusalsAndWhoseTheyWere) {
  const TemporaryFolder folder;
  Server server({"--source", "sim:desk?motion=still&width=160&height=120&fps=10", "--mount", "sim",
                 "--data-dir", folder / "data"});
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(),
                     {SACCADE_PROGRAM, "--server", server.grpc(), "--name", "Ann"});
    return RunProgram(arguments, std::chrono::seconds(20),
                      {"XDG_STATE_HOME=" + (folder / "state")});
  };
  const auto lines = [&](const std::string& text) {
    int count = 0;
    std::stringstream log(server.process().err());
    for (std::string line; std::getline(log, line);) count += line.find(text) != std::string::npos;
    return count;
  };
  int placed = 1;
  for (int k = 0; k < 50 && placed != 0; ++k) {  // until a frame has been tracked
    if (k > 0) usleep(100'000);
    placed = run({"annotate", "--point", "0,0,1", "--shape", "cube"}).exit_code;
  }
  EXPECT_EQ(placed, 0);
  EXPECT_EQ(run({"annotate", "--point", "1e9,0,1"}).exit_code, 1);
  EXPECT_EQ(run({"annotations"}).exit_code, 0);
  EXPECT_EQ(run({"status"}).exit_code, 0);
  run({"fixate", "--point", "0,0,1", "--for", "1"});  // ten heartbeats
  EXPECT_EQ(run({"annotations", "undo"}).exit_code, 0);
  for (int k = 0; k < 200 && lines(" rpc Undo ") == 0; ++k) usleep(10'000);
  const std::string log = server.process().err();
  for (const char* ends : {"rpc Create participant=", "rpc Undo participant="}) {
    EXPECT_THAT(log, ::testing::ContainsRegex(std::string(ends) + "[0-9a-f-]+ ok")) << log;
  }
  EXPECT_THAT(log,
              ::testing::ContainsRegex("rpc Create participant=[0-9a-f-]+ INVALID_ARGUMENT: "));
  EXPECT_EQ(lines(" rpc AcquireLease "), 1) << log;
  EXPECT_EQ(lines(" rpc List ") + lines(" rpc GetStatus ") + lines(" rpc GetState "), 0) << log;
}

}  // namespace
}  // namespace saccade::testing::server_log_test
