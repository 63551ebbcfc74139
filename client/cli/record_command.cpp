#include "client/cli/record_command.hpp"

#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

namespace saccade::cli {

absl::Status RunRecord(const Options& options) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string program = (self.parent_path() / "saccade-eval").string();
  std::vector<std::string> words = {"saccade-eval",        "record", "--source",
                                    options.record.source, "--out",  options.out};
  for (const auto& [flag, value] :
       {std::pair("--frames", &options.record.frames), std::pair("--for", &options.record.seconds),
        std::pair("--camera", &options.record.camera)}) {
    if (!value->empty()) words.insert(words.end(), {flag, *value});
  }
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execv(program.c_str(), argv.data());
  return absl::NotFoundError(absl::StrCat(program, ": cannot be started (", std::strerror(errno),
                                          "); sources are recorded by it: install it beside "
                                          "saccade"));
}

}  // namespace saccade::cli
