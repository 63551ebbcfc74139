#include "tests/lint/link_rules.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>

#include "tests/lint/include_rules.hpp"

namespace saccade::lint {
namespace {

namespace fs = std::filesystem;
using std::string_view;

std::string ReadText(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string WithoutComments(string_view text) {
  std::string out;
  bool comment = false;
  for (const char c : text) {
    if (c == '#') comment = true;
    if (c == '\n') comment = false;
    if (!comment) out.push_back(c);
  }
  return out;
}

std::vector<std::string> Words(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

std::string FolderOfFile(string_view path) {
  const auto slash = path.rfind('/');
  return std::string(slash == string_view::npos ? string_view() : path.substr(0, slash));
}

// One call's words: name, then sources and libraries by the keyword before them.
void ReadCall(const std::string& folder, const std::vector<std::string>& words, bool only_links,
              std::map<std::string, Target>& targets) {
  if (words.empty()) return;
  Target& target = targets[words[0]];
  if (!only_links) target.folder = folder;
  enum { kSources, kLinks, kOther } what = only_links ? kOther : kSources;
  for (auto word = words.begin() + 1; word != words.end(); ++word) {
    if (*word == "SOURCES" || *word == "STATIC") {
      what = kSources;
    } else if (*word == "PUBLIC" || *word == "PRIVATE" || *word == "LIBS") {
      what = kLinks;
    } else if (*word == "PCH") {
      what = kOther;
    } else if (what == kSources && word->ends_with(".cpp")) {
      target.sources.push_back(folder + "/" + *word);
    } else if (what == kLinks) {
      target.links.insert(*word);
    }
  }
}

}  // namespace

void ReadTargets(string_view folder, string_view text, std::map<std::string, Target>& targets) {
  const std::string plain = WithoutComments(text);
  for (const string_view call : {"saccade_library(", "saccade_executable(", "add_library(",
                                 "add_executable(", "target_link_libraries("}) {
    for (auto at = plain.find(call); at != std::string::npos; at = plain.find(call, at + 1)) {
      const auto begin = at + call.size();
      const auto end = std::min(plain.find(')', begin), plain.size());
      ReadCall(std::string(folder), Words(plain.substr(begin, end - begin)),
               call.starts_with("target_link"), targets);
    }
  }
}

std::map<std::string, Target> ReadTree(const fs::path& root) {
  std::map<std::string, Target> targets;
  for (const char* top : {"shared", "server", "client", "examples"}) {
    if (!fs::exists(root / top)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      if (entry.path().filename() != "CMakeLists.txt") continue;
      const fs::path folder = fs::relative(entry.path().parent_path(), root);
      ReadTargets(folder.generic_string(), ReadText(entry.path()), targets);
    }
  }
  return targets;
}

std::vector<std::string> MissingLinks(const fs::path& root,
                                      const std::map<std::string, Target>& targets) {
  std::map<std::string, std::set<std::string>> owners, homes;  // by .cpp, by folder
  for (const auto& [name, target] : targets) {
    for (const std::string& source : target.sources) owners[source].insert(name);
    // Header-only folders have a target too, an INTERFACE library without sources.
    if (!target.folder.empty()) homes[target.folder].insert(name);
  }
  const auto linked = [](const Target& target, const std::set<std::string>& any) {
    return std::any_of(any.begin(), any.end(),
                       [&](const std::string& name) { return target.links.contains(name); });
  };
  std::vector<std::string> problems;
  for (const auto& [name, target] : targets) {
    std::set<std::string> files, told;
    for (const std::string& source : target.sources) {
      files.insert(source);
      const std::string header = source.substr(0, source.size() - 4) + ".hpp";
      if (fs::exists(root / header)) files.insert(header);
    }
    for (const std::string& file : files) {
      for (const std::string& include : ProjectIncludes(ReadText(root / file))) {
        const std::string folder = FolderOfFile(include);
        if (folder == target.folder) continue;
        const auto owner = owners.find(include.substr(0, include.rfind('.')) + ".cpp");
        const std::set<std::string>& needed = owner == owners.end() ? homes[folder] : owner->second;
        if (needed.contains(name) || linked(target, needed)) continue;
        if (owner != owners.end() && linked(target, homes[folder])) continue;
        if (!told.insert(folder).second) continue;
        std::ostringstream words;
        words << file << " includes " << include << ", but " << target.folder
              << "/CMakeLists.txt links " << name << " to no target of " << folder << ": add "
              << (needed.empty() ? "it" : *needed.begin());
        problems.push_back(words.str());
      }
    }
  }
  return problems;
}

std::vector<std::string> FoldersListed(string_view text) {
  const std::string plain = WithoutComments(text);
  constexpr string_view kCall = "foreach(folder";
  const auto at = plain.find(kCall);
  if (at == std::string::npos) return {};
  const auto begin = at + kCall.size();
  return Words(plain.substr(begin, plain.find(')', begin) - begin));
}

}  // namespace saccade::lint
