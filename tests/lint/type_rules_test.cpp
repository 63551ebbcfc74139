#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace saccade::lint::type_rules_test {
namespace {

namespace fs = std::filesystem;

/// "NAMESPACE::TYPE" of what a header defines outside classes; one namespace a file, as we write.
std::set<std::string> TypesOf(const std::string& header) {
  static const std::regex space(R"((?:^|\n)namespace ([\w:]+) \{)");
  static const std::regex type(
      R"((?:^|\n)(?:struct|class|enum class) (\w+)(?: final)?(?: :[^;{]*)? \{)");
  std::set<std::string> types;
  std::smatch in;
  if (!std::regex_search(header, in, space)) return types;
  for (std::sregex_iterator at(header.begin(), header.end(), type), end; at != end; ++at) {
    types.insert(in.str(1) + "::" + at->str(1));
  }
  return types;
}

std::string TextOf(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

// Two types of one name in one namespace: the linker takes either's std::vector for both.
TEST(TypeRules, ATypeIsDefinedInOneHeader) {
  std::map<std::string, std::string> first;
  for (const char* folder : {"shared", "server", "client"}) {
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::path(SACCADE_SOURCE_DIR) / folder)) {
      if (entry.path().extension() != ".hpp") continue;
      for (const std::string& type : TypesOf(TextOf(entry.path()))) {
        const auto [known, fresh] = first.emplace(type, entry.path().string());
        EXPECT_TRUE(fresh) << type << " is defined in " << known->second << " and in "
                           << entry.path().string() << ": give one of them a name of its own";
      }
    }
  }
  EXPECT_GE(first.size(), 300U);  // a check that reads nothing passes always
}

TEST(TypeRules, ReadsStructsClassesAndEnumsButNotWhatIsDeclaredOnly) {
  EXPECT_EQ(TypesOf("namespace a::b {\nstruct C {\n};\nclass D;\nenum class E : int {\n};\n"
                    "class F final : public C {\n  struct Inner {\n  };\n};\nstruct G : C {};\n"),
            (std::set<std::string>{"a::b::C", "a::b::E", "a::b::F", "a::b::G"}));
}

}  // namespace
}  // namespace saccade::lint::type_rules_test
