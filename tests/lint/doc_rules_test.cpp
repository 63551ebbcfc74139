#include "tests/lint/doc_rules.hpp"

#include <gtest/gtest.h>

#include <ostream>
#include <string>

namespace saccade::lint::doc_rules_test {
namespace {

const DocTree& SmallTree() {
  static const DocTree tree = {
      .files = {"README.md", "docs", "docs/spec.md", "docs/measurements",
                "docs/measurements/2026-11-22-a.md", "server", "server/filter",
                "server/filter/README.md", "server/filter/update.cpp", "server/filter/update.hpp"},
      .spec_sections = {"5", "5.3", "9"},
      .spec_tests = {"T1", "T13"},
      .architecture_sections = {"3"},
      .tests = {"Refine.LateEqualsAtOnce"}};
  return tree;
}

TEST(Documents, KeepTheirRules) {
  const DocReport report = CheckDocuments(SACCADE_SOURCE_DIR);
  // A check that reads nothing passes always.
  EXPECT_GE(report.documents, 60);
  EXPECT_GE(report.sources, 500);
  for (const DocViolation& violation : report.violations) {
    ADD_FAILURE() << violation.file << ":" << violation.line << ": " << violation.what << ": "
                  << violation.rule;
  }
}

TEST(Documents, TheSpecificationHasAllItsTests) {
  const DocTree tree = ReadDocTree(SACCADE_SOURCE_DIR);
  for (int k = 1; k <= 46; ++k) EXPECT_TRUE(tree.spec_tests.contains("T" + std::to_string(k))) << k;
  EXPECT_EQ(tree.spec_tests.size(), 46);
  for (int k = 1; k <= 13; ++k) EXPECT_TRUE(tree.spec_sections.contains(std::to_string(k))) << k;
}

struct Case {
  const char* file;
  std::string line;
  bool allowed;
};
void PrintTo(const Case& one, std::ostream* out) { *out << one.file << ": " << one.line; }

class DocRule : public ::testing::TestWithParam<Case> {};

TEST_P(DocRule, IsEnforced) {
  const Case& one = GetParam();
  const bool document = std::string(one.file).ends_with(".md");
  const std::string text = "\n" + one.line + "\n";
  const auto found = document ? CheckDocument(SmallTree(), one.file, text)
                              : CheckSource(SmallTree(), one.file, text);
  EXPECT_EQ(found.empty(), one.allowed);
  for (const DocViolation& violation : found) EXPECT_EQ(violation.line, 2) << violation.rule;
}

constexpr const char* kReadme = "server/filter/README.md";

INSTANTIATE_TEST_SUITE_P(LineLength, DocRule,
                         ::testing::Values(Case{kReadme, std::string(110, 'a'), true},
                                           Case{kReadme, std::string(111, 'a'), false},
                                           Case{kReadme, "| " + std::string(120, 'a') + " |", true},
                                           Case{"CHANGELOG.md", std::string(111, 'a'), false}));

INSTANTIATE_TEST_SUITE_P(
    References, DocRule,
    ::testing::Values(Case{kReadme, "[spec](../../docs/spec.md)", true},
                      Case{kReadme, "[spec](../../docs/spec.md#5-features)", true},
                      Case{kReadme, "[spec](../docs/spec.md)", false},
                      Case{kReadme, "[field](https://example.org/a)", true},
                      Case{kReadme, "`server/filter/update.hpp` and `server/filter`", true},
                      Case{kReadme, "`server/filter/update`", true},
                      Case{kReadme, "`server/filter/upd*`", true},
                      Case{kReadme, "`server/filter/gone.hpp`", false},
                      Case{kReadme, "`server/FilterState`", false},
                      Case{kReadme, "`web/dist`", true},
                      Case{"server/a.cpp", "// See server/filter/update.hpp.", true},
                      Case{"server/a.cpp", "int a;  // server/filter/gone.hpp", false},
                      Case{"server/a.cpp", "// See README: scale.", false}));

INSTANTIATE_TEST_SUITE_P(
    Specification, DocRule,
    ::testing::Values(Case{"server/a.hpp", "/// As slam-spec 5.3 has it.", true},
                      Case{"server/a.hpp", "/// As slam-spec 5.4 has it.", false},
                      Case{"server/a.hpp", "/// As slam-spec section 9.", true},
                      Case{"server/a.hpp", "/// (slam-spec 5, 5.3, 7)", false},
                      Case{"server/a.hpp", "/// (spec 14)", false},
                      Case{"server/a.hpp", "/// (architecture, section 3)", true},
                      Case{"server/a.hpp", "/// (architecture section 4)", false},
                      Case{"server/a.hpp", "// T13: no depth from turning.", true},
                      Case{"server/a.hpp", "// T47: not there.", false},
                      Case{"docs/spec.md", "`Refine.LateEqualsAtOnce`", true},
                      Case{"docs/spec.md", "`Refine.Late*`", true},
                      Case{"docs/spec.md", "`Refine.Gone`", false},
                      Case{"docs/spec.md", "`Gone.Test`", false},
                      Case{kReadme, "`Refine.Gone`", false},
                      Case{kReadme, "`MapService.Reset`", true}));

INSTANTIATE_TEST_SUITE_P(Figures, DocRule,
                         ::testing::Values(Case{kReadme, "An update takes 3.4 ms.", false},
                                           Case{kReadme, "It was 12 % too small.", false},
                                           Case{kReadme, "Within 20px.", false},
                                           Case{kReadme, "A click within `20 px`.", true},
                                           Case{kReadme, "Six frames, 30 a second.", true},
                                           Case{"docs/measurements/2026-11-22-a.md", "3.4 ms",
                                                true},
                                           Case{"README.md", "3.4 ms", true},
                                           Case{"docs/architecture.md", "3.4 ms", false}));

TEST(DocRule, AFoldersReadmeHasFortyLines) {
  std::string text;
  for (int k = 0; k < 40; ++k) text += "a line\n";
  EXPECT_TRUE(CheckDocument(SmallTree(), kReadme, text).empty());
  EXPECT_EQ(CheckDocument(SmallTree(), kReadme, text + "one more\n").size(), 1);
  EXPECT_TRUE(CheckDocument(SmallTree(), "README.md", text + "one more\n").empty());
}

TEST(DocRule, WithinAFenceNumbersAreNoFigures) {
  EXPECT_TRUE(CheckDocument(SmallTree(), kReadme, "```\nsleep 20 ms\n```\n").empty());
}

}  // namespace
}  // namespace saccade::lint::doc_rules_test
