#include "client/tools/controls.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace saccade::tools::controls_test {
namespace {

/// label -> key, of one of the page's own tables.
std::map<std::string, std::string> PageKeys(const char* file, const char* entry) {
  std::ifstream in(std::string(SACCADE_SOURCE_DIR "/web/src/") + file);
  std::stringstream text;
  text << in.rdbuf();
  const std::string all = text.str();
  const std::regex pattern(entry);
  std::map<std::string, std::string> keys;
  for (std::sregex_iterator at(all.begin(), all.end(), pattern), end; at != end; ++at) {
    keys[(*at)[1]] = (*at)[2];
  }
  return keys;
}

TEST(Controls, HaveThePagesKeysAndAllOfItsControls) {
  std::map<std::string, std::string> page =
      PageKeys("tools/tools.ts", R"re(label: '([^']+)',\s*key: '([^']+)')re");
  ASSERT_GE(page.size(), 30u);
  page["Hide"] = page.extract("Hide marks").mapped();
  std::map<std::string, std::string> own;
  for (const Control& control : Controls()) own[control.label] = control.key;
  for (const auto& [label, key] : page) {
    EXPECT_TRUE(own.contains(label) && own[label] == key) << label << " is not on " << key;
  }
}

TEST(Controls, NoKeyMeansOneThingHereAndAnotherOnThePage) {
  std::map<std::string, std::string> page =
      PageKeys("tools/tools.ts", R"re(label: '([^']+)',\s*key: '([^']+)')re");
  page["Hide"] = page.extract("Hide marks").mapped();
  std::map<std::string, std::string> talk;
  for (const auto& [key, label] :
       PageKeys("ui/talk_keys.ts", R"re(shown: '([^']+)', label: '([^']+)')re")) {
    talk[label] = key;
  }
  ASSERT_EQ(talk["Message"], "9");
  page.merge(talk);
  for (const Control& control : Controls()) {
    for (const auto& [label, key] : page) {
      if (key == control.key) {
        EXPECT_EQ(label, control.label) << key;
      }
    }
  }
}

TEST(Controls, EachKeyIsOnesAlone) {
  std::set<std::string> keys;
  for (const Control& control : Controls()) {
    EXPECT_TRUE(keys.insert(control.key).second) << control.key;
  }
}

TEST(Controls, KeysWithModifiersAreNotTools) {
  EXPECT_EQ(ActionOf({.key = "c"}), Action::kCube);
  EXPECT_EQ(ActionOf({.key = "c", .ctrl = true}), Action::kCopy);
  EXPECT_EQ(ActionOf({.key = "v", .ctrl = true}), Action::kPaste);
  EXPECT_EQ(ActionOf({.key = "n", .ctrl = true}), std::nullopt);
  EXPECT_EQ(ActionOf({.key = "c", .alt = true}), std::nullopt);
  EXPECT_EQ(ActionOf({.key = "z", .ctrl = true}), Action::kUndo);
  EXPECT_EQ(ActionOf({.key = "z", .ctrl = true, .shift = true}), Action::kRedo);
  EXPECT_EQ(ActionOf({.key = "backspace"}), Action::kDelete);
  EXPECT_EQ(ActionOf({.key = "tab"}), std::nullopt);
  EXPECT_EQ(ActionOf({.key = "tab", .ctrl = true}), Action::kNextTab);
}

}  // namespace
}  // namespace saccade::tools::controls_test
