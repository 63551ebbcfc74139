#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace saccade::lint {

/// A line of a document, or a comment, that breaks a rule.
struct DocViolation {
  std::string file;  // from the root, with '/'
  int line = 0;      // from 1
  std::string what;  // as written
  std::string rule;  // why not, in words
};

/// What references may lead to.
struct DocTree {
  std::set<std::string> files;                  // from the root; of folders, too
  std::set<std::string> spec_sections;          // "5", "5.3": headings of docs/spec.md
  std::set<std::string> spec_tests;             // "T13": rows of its table
  std::set<std::string> architecture_sections;  // headings of docs/architecture.md
  std::set<std::string> tests;                  // "Suite.Name"
};

/// Reads what there is below `root`; leaves out what is built or installed.
DocTree ReadDocTree(const std::filesystem::path& root);

/// Checks one Markdown file: lines of 110 characters at most (tables excepted), links and paths
/// that lead somewhere, sections and tests of the specification that exist, tests that exist,
/// folder READMEs of 40 lines at most, and no figures outside docs/measurements, docs/spec.md, the
/// root README and the changelog. A number in backticks is no figure: a limit or a constant that
/// stands in the source.
std::vector<DocViolation> CheckDocument(const DocTree& tree, std::string_view file,
                                        std::string_view text);

/// Checks what a source file says of documents: sections of the specification and the architecture,
/// its tests, and in comments paths of files.
std::vector<DocViolation> CheckSource(const DocTree& tree, std::string_view file,
                                      std::string_view text);

struct DocReport {
  int documents = 0;
  int sources = 0;
  std::vector<DocViolation> violations;
};

/// Checks every document and source file of the tree at `root`.
DocReport CheckDocuments(const std::filesystem::path& root);

}  // namespace saccade::lint
