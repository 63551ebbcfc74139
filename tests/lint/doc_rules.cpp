#include "tests/lint/doc_rules.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>

namespace saccade::lint {
namespace {

namespace fs = std::filesystem;
using std::string_view;

constexpr std::size_t kLineLength = 110;
constexpr int kReadmeLines = 40;
// Made by a build, and named all the same.
const std::set<std::string> kBuilt = {"web/dist", "web/src/gen", "web/node_modules"};
const char* const kStems[] = {".hpp", ".cpp", ".ts", ".h", ".proto", ".md"};

struct Line {
  int number = 0;
  std::string text;
  bool code = false;  // within a fence
};

std::vector<Line> LinesOf(string_view text) {
  std::vector<Line> lines;
  bool code = false;
  int number = 0;
  std::istringstream in{std::string(text)};
  for (std::string line; std::getline(in, line);) {
    const bool fence = line.starts_with("```");
    lines.push_back({++number, line, code || fence});
    if (fence) code = !code;
  }
  return lines;
}

std::size_t Characters(string_view utf8) {
  return static_cast<std::size_t>(
      std::count_if(utf8.begin(), utf8.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

/// Every match of `pattern`, by its group `group`.
std::vector<std::string> Matches(const std::string& text, const std::regex& pattern, int group) {
  std::vector<std::string> found;
  for (std::sregex_iterator at(text.begin(), text.end(), pattern), end; at != end; ++at) {
    found.push_back(at->str(static_cast<std::size_t>(group)));
  }
  return found;
}

std::vector<std::string> CodeSpans(const std::string& line) {
  static const std::regex pattern("`([^`]+)`");
  return Matches(line, pattern, 1);
}

std::string WithoutCodeSpans(const std::string& line) {
  static const std::regex pattern("`[^`]*`");
  return std::regex_replace(line, pattern, "`");
}

bool BeginsWith(const std::set<std::string>& names, const std::string& prefix) {
  const auto at = names.lower_bound(prefix);
  return at != names.end() && at->starts_with(prefix);
}

/// A file, a folder, a file without its ending, or with '*' the beginning of some.
bool LeadsSomewhere(const DocTree& tree, std::string path) {
  if (path.ends_with('*')) return BeginsWith(tree.files, path.substr(0, path.find('*')));
  while (path.ends_with('/') || path.ends_with('.')) path.pop_back();
  if (tree.files.contains(path) || kBuilt.contains(path)) return true;
  return std::any_of(std::begin(kStems), std::end(kStems),
                     [&](const char* end) { return tree.files.contains(path + end); });
}

class Checker {
 public:
  Checker(const DocTree& tree, string_view file) : tree_(tree), file_(file) {}

  void LineLength(const Line& line) {
    const bool table = line.text.starts_with("|");
    if (!table && Characters(line.text) > kLineLength) {
      Add(line, line.text.substr(0, 40) + "...", "longer than 110 characters");
    }
  }

  void Links(const Line& line) {
    static const std::regex pattern(R"(\]\(([^)\s]+)\))");
    for (const std::string& link : Matches(line.text, pattern, 1)) {
      if (link.starts_with("http") || link.starts_with("#") || link.starts_with("mailto:")) {
        continue;
      }
      const fs::path target = fs::path(file_).parent_path() / link.substr(0, link.find('#'));
      std::string path = target.lexically_normal().generic_string();
      while (path.ends_with('/')) path.pop_back();
      if (!tree_.files.contains(path)) Add(line, link, "the link leads nowhere");
    }
  }

  void Paths(const Line& line) {
    static const std::regex path(
        R"(^(server|shared|client|web|tests|deploy|proto|docs)/[\w./*-]+$)");
    for (const std::string& span : CodeSpans(line.text)) {
      std::istringstream words(span);
      for (std::string word; words >> word;) {
        while (!word.empty() && (word.ends_with(',') || word.ends_with(';'))) word.pop_back();
        if (std::regex_match(word, path) && !LeadsSomewhere(tree_, word)) {
          Add(line, word, "there is no such file or folder");
        }
      }
    }
  }

  void CommentPaths(const Line& line) {
    static const std::regex path(
        R"(\b((?:server|shared|client|web|tests|docs)/[\w./-]+\.(?:hpp|cpp|ts|md))\b)");
    const auto comment = line.text.find("//");
    if (comment == std::string::npos) return;
    for (const std::string& each : Matches(line.text.substr(comment), path, 1)) {
      if (!LeadsSomewhere(tree_, each)) Add(line, each, "there is no such file");
    }
    static const std::regex readme(R"(README(?:\.md)?[:,] \w+)");
    for (const std::string& each : Matches(line.text, readme, 0)) {
      Add(line, each, "READMEs hold no reasons: name the page of docs");
    }
  }

  void Sections(const Line& line) {
    static const std::regex spec(
        R"(\b(?:slam-)?spec(?:ification)?,? (?:section )?(\d+(?:\.\d+)?(?:, \d+(?:\.\d+)?)*))",
        std::regex::icase);
    static const std::regex architecture(R"(\barchitecture,? section (\d+))", std::regex::icase);
    static const std::regex number(R"(\d+(?:\.\d+)?)");
    for (const std::string& list : Matches(line.text, spec, 1)) {
      for (const std::string& each : Matches(list, number, 0)) {
        if (!tree_.spec_sections.contains(each)) {
          Add(line, each, "docs/spec.md has no such section");
        }
      }
    }
    for (const std::string& each : Matches(line.text, architecture, 1)) {
      if (!tree_.architecture_sections.contains(each)) {
        Add(line, each, "docs/architecture.md has no such section");
      }
    }
  }

  void SpecTests(const Line& line) {
    static const std::regex pattern(R"(\bT[0-9]{1,2}\b)");
    for (const std::string& each : Matches(line.text, pattern, 0)) {
      if (!tree_.spec_tests.contains(each)) Add(line, each, "docs/spec.md knows no such test");
    }
  }

  /// `Suite.Name` or `Suite.Begin*`: in docs/spec.md any, elsewhere those of suites that exist.
  void TestNames(const Line& line) {
    static const std::regex pattern(R"(^([A-Z]\w+)\.(?:([A-Z]\w*)(\*?)|\*)$)");
    for (const std::string& span : CodeSpans(line.text)) {
      std::smatch name;
      if (!std::regex_match(span, name, pattern)) continue;
      const bool known = BeginsWith(tree_.tests, name.str(1) + ".");
      if (!known && file_ != "docs/spec.md") continue;
      const std::string whole = span.substr(0, span.find('*'));
      const bool there =
          span.ends_with('*') ? BeginsWith(tree_.tests, whole) : tree_.tests.contains(whole);
      if (!there) Add(line, span, "there is no such test");
    }
  }

  void Figures(const Line& line) {
    static const std::regex pattern(R"([0-9] ?(?:ms|cm|mm|px|%|deg|[KMG]B|dB)(?![\w]))");
    if (line.code || MayHoldFigures()) return;
    for (const std::string& each : Matches(WithoutCodeSpans(line.text), pattern, 0)) {
      Add(line, each, "figures belong to docs/measurements; limits stand in backticks");
    }
  }

  void ReadmeLength(int lines) {
    if (file_.ends_with("/README.md") && lines > kReadmeLines) {
      Add({lines, "", false}, std::to_string(lines) + " lines", "a folder's README has at most 40");
    }
  }

  std::vector<DocViolation> Take() { return std::move(violations_); }

 private:
  bool MayHoldFigures() const {
    return file_.starts_with("docs/measurements/") || file_ == "docs/spec.md" ||
           file_ == "README.md" || file_ == "CHANGELOG.md";
  }
  void Add(const Line& line, std::string what, std::string rule) {
    violations_.push_back({file_, line.number, std::move(what), std::move(rule)});
  }

  const DocTree& tree_;
  const std::string file_;
  std::vector<DocViolation> violations_;
};

std::string ReadFile(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

bool IsLeftOut(const fs::path& folder) {
  static const std::set<std::string> names = {"node_modules", "build", "dist", "gen", "Testing"};
  const std::string name = folder.filename().string();
  return names.contains(name) || (name.starts_with('.') && name != ".ci");
}

bool IsSource(string_view file) {
  static constexpr string_view kEndings[] = {".hpp", ".cpp",   ".h",   ".ts",
                                             ".mjs", ".proto", ".txt", ".cmake"};
  return std::any_of(std::begin(kEndings), std::end(kEndings),
                     [&](string_view end) { return file.ends_with(end); });
}

void ReadSections(const std::string& text, const std::regex& heading, std::set<std::string>& into) {
  for (const Line& line : LinesOf(text)) {
    std::smatch found;
    if (!line.code && std::regex_search(line.text, found, heading)) into.insert(found.str(1));
  }
}

}  // namespace

DocTree ReadDocTree(const fs::path& root) {
  static const std::regex section(R"(^#{2,3} (\d+(?:\.\d+)?) )");
  static const std::regex row(R"(^- \*\*(T\d{1,2})\*\* )");
  static const std::regex test(R"(TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\))");
  DocTree tree;
  for (auto at = fs::recursive_directory_iterator(root); at != fs::end(at); ++at) {
    if (at->is_directory() && IsLeftOut(at->path())) {
      at.disable_recursion_pending();
      continue;
    }
    const std::string file = fs::relative(at->path(), root).generic_string();
    tree.files.insert(file);
    if (!file.starts_with("tests/") || !file.ends_with(".cpp")) continue;
    const std::string text = ReadFile(at->path());
    for (std::sregex_iterator each(text.begin(), text.end(), test), end; each != end; ++each) {
      tree.tests.insert(each->str(1) + "." + each->str(2));
    }
  }
  const std::string spec = ReadFile(root / "docs/spec.md");
  ReadSections(spec, section, tree.spec_sections);
  ReadSections(spec, row, tree.spec_tests);
  ReadSections(ReadFile(root / "docs/architecture.md"), section, tree.architecture_sections);
  return tree;
}

std::vector<DocViolation> CheckDocument(const DocTree& tree, string_view file, string_view text) {
  Checker checker(tree, file);
  const std::vector<Line> lines = LinesOf(text);
  for (const Line& line : lines) {
    checker.LineLength(line);
    checker.Links(line);
    checker.Paths(line);
    checker.Sections(line);
    checker.SpecTests(line);
    checker.TestNames(line);
    checker.Figures(line);
  }
  checker.ReadmeLength(static_cast<int>(lines.size()));
  return checker.Take();
}

std::vector<DocViolation> CheckSource(const DocTree& tree, string_view file, string_view text) {
  Checker checker(tree, file);
  for (const Line& line : LinesOf(text)) {
    checker.Sections(line);
    checker.SpecTests(line);
    checker.CommentPaths(line);
  }
  return checker.Take();
}

DocReport CheckDocuments(const fs::path& root) {
  DocReport report;
  const DocTree tree = ReadDocTree(root);
  for (const std::string& file : tree.files) {
    const bool document = file.ends_with(".md");
    // The sources of this folder are full of what is wrong.
    if (!document && (!IsSource(file) || file.starts_with("tests/lint/"))) continue;
    if (!fs::is_regular_file(root / file)) continue;
    const std::string text = ReadFile(root / file);
    std::vector<DocViolation> found =
        document ? CheckDocument(tree, file, text) : CheckSource(tree, file, text);
    ++(document ? report.documents : report.sources);
    std::move(found.begin(), found.end(), std::back_inserter(report.violations));
  }
  return report;
}

}  // namespace saccade::lint
