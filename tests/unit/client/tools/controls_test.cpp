#include "client/tools/controls.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace saccade::tools {
namespace {

/// label -> key, of the page's own table.
std::map<std::string, std::string> PageKeys() {
  std::ifstream in(SACCADE_SOURCE_DIR "/web/src/tools/tools.ts");
  std::stringstream text;
  text << in.rdbuf();
  const std::string all = text.str();
  const std::regex entry(R"re(label: '([^']+)',\s*key: '([^']+)')re");
  std::map<std::string, std::string> keys;
  for (std::sregex_iterator at(all.begin(), all.end(), entry), end; at != end; ++at) {
    keys[(*at)[1]] = (*at)[2];
  }
  return keys;
}

TEST(Controls, HaveThePagesKeysWhereThePageHasThem) {
  const std::map<std::string, std::string> page = PageKeys();
  ASSERT_GE(page.size(), 20u);
  int shared = 0;
  std::map<std::string, std::string> own;
  for (const Control& control : Controls()) own[control.label] = control.key;
  for (const auto& [label, key] : page) {
    if (!own.contains(label)) continue;
    EXPECT_EQ(own[label], key) << label;
    ++shared;
  }
  EXPECT_GE(shared, 20);
  // And no key means one thing here and another there.
  for (const auto& [label, key] : own) {
    for (const auto& [other, page_key] : page) {
      if (key == page_key && own.contains(other)) {
        EXPECT_EQ(label, other) << key;
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
  EXPECT_EQ(ActionOf({.key = "c", .ctrl = true}), std::nullopt);
  EXPECT_EQ(ActionOf({.key = "c", .alt = true}), std::nullopt);
  EXPECT_EQ(ActionOf({.key = "z", .ctrl = true}), Action::kUndo);
  EXPECT_EQ(ActionOf({.key = "z", .ctrl = true, .shift = true}), Action::kRedo);
  EXPECT_EQ(ActionOf({.key = "backspace"}), Action::kDelete);
  EXPECT_EQ(ActionOf({.key = "tab"}), std::nullopt);
  EXPECT_EQ(ActionOf({.key = "tab", .ctrl = true}), Action::kNextTab);
}

}  // namespace
}  // namespace saccade::tools
