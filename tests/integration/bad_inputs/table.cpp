#include "tests/integration/bad_inputs/table.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <vector>

namespace saccade::testing {
namespace {

struct Entry {
  std::string group, input, got;
};
std::vector<Entry>& Entries() {
  static std::vector<Entry> entries;
  return entries;
}

// A cell of a Markdown table: one line, no bars, not endless.
std::string Cell(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
    if (c == '|') c = '/';
  }
  if (text.size() > 240) text = text.substr(0, 237) + "...";
  return text;
}

class PrintTable : public ::testing::Environment {
 public:
  void TearDown() override {
    if (Entries().empty()) return;
    std::printf("\n| | bad input | what it got |\n|---|---|---|\n");
    for (const Entry& entry : Entries()) {
      std::printf("| %s | %s | %s |\n", entry.group.c_str(), Cell(entry.input).c_str(),
                  Cell(entry.got).c_str());
    }
    std::printf("\n");
    std::fflush(stdout);
  }
};
[[maybe_unused]] ::testing::Environment* const table =
    ::testing::AddGlobalTestEnvironment(new PrintTable);

}  // namespace

void Row(const std::string& group, const std::string& input, const std::string& got,
         bool expected) {
  Entries().push_back({group, input, got});
  EXPECT_TRUE(expected) << group << ": " << input << " got: " << got;
}

void ExpectRefusedStart(const std::string& input, const std::vector<std::string>& arguments,
                        int exit_code, const std::string& part) {
  std::vector<std::string> argv = {SACCADE_SERVER_PROGRAM};
  for (const char* option : {"--grpc", "--http"}) {
    if (std::find(arguments.begin(), arguments.end(), option) == arguments.end()) {
      argv.insert(argv.end(), {option, "127.0.0.1:0"});
    }
  }
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  const RunResult result = RunProgram(argv, std::chrono::seconds(10));
  const std::string end =
      result.exit_code < 0 ? "still ran after 10 s" : "exit " + std::to_string(result.exit_code);
  const auto lines = std::count(result.err.begin(), result.err.end(), '\n');
  Row("start", input, end + ": " + result.err,
      result.exit_code == exit_code && lines == 1 && result.err.find(part) != std::string::npos);
}

bool IsWell(Server& server) {
  const RunResult result =
      RunProgram({SACCADE_PROGRAM, "--server", server.grpc(), "status", "--json"});
  return result.exit_code == 0 && !server.process().Wait(std::chrono::milliseconds(0));
}

}  // namespace saccade::testing
