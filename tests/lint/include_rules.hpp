#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace saccade::lint {

/// One include or import that points against the arrows of the architecture.
struct Violation {
  std::string file;     // from the root, with '/'
  int line = 0;         // from 1
  std::string include;  // as written
  std::string rule;     // why not, in words
};

/// Checks one file's text. `file` is its path from the root ("server/filter/ekf.cpp") and decides
/// which rules hold: proto <- shared <- server | client; in server, client and shared a folder sees
/// only those listed above it (architecture, section 3); third-party headers that belong to one
/// folder stay there; web sees nothing outside web. Tests may include anything.
std::vector<Violation> CheckFile(std::string_view file, std::string_view text);

/// What `text` includes of shared/, server/ and client/, as written.
std::vector<std::string> ProjectIncludes(std::string_view text);
/// Every folder that the rules name, from the root.
std::vector<std::string> FoldersOfTheRules();

struct TreeReport {
  int files = 0;
  int includes = 0;
  std::vector<Violation> violations;
};

/// Checks every source file below shared/, server/, client/, examples/cpp/ and web/src/ of the tree
/// at `root`.
TreeReport CheckTree(const std::filesystem::path& root);

}  // namespace saccade::lint
