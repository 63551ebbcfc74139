#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace saccade::lint {

/// A target of a CMakeLists.txt, as far as link lines go.
struct Target {
  std::string folder;                // from the root, with '/'
  std::vector<std::string> sources;  // from the root
  std::set<std::string> links;
};

/// The targets that `text`, the CMakeLists.txt of `folder`, makes or links, added to `targets`.
void ReadTargets(std::string_view folder, std::string_view text,
                 std::map<std::string, Target>& targets);

/// Every CMakeLists.txt below shared/, server/, client/ and examples/.
std::map<std::string, Target> ReadTree(const std::filesystem::path& root);

/// What `target` includes from a folder of which it names no target in its own link lines: one line
/// a folder, in words with the remedy. A header stands for the target that its .cpp belongs to, or
/// for any of its folder's.
std::vector<std::string> MissingLinks(const std::filesystem::path& root,
                                      const std::map<std::string, Target>& targets);

/// The names between "foreach(folder" and ")" in `text`; each is to be a folder, and each folder
/// with a CMakeLists.txt to be named.
std::vector<std::string> FoldersListed(std::string_view text);

}  // namespace saccade::lint
