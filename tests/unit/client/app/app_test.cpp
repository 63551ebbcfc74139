#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "client/app/address.hpp"
#include "client/app/options.hpp"
#include "client/app/settings.hpp"
#include "client/app/snapshot.hpp"

namespace saccade::app::app_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

TEST(Address, OfAnInviteLinkIsItsHostWithGrpcsPort) {
  const auto address = ParseLink("https://bench.example:8443/#invite=abc.def");
  ASSERT_TRUE(address.ok()) << address.status();
  EXPECT_EQ(address->server, "bench.example:50051");
  EXPECT_EQ(address->invite, "abc.def");
  EXPECT_FALSE(address->plain);
  EXPECT_TRUE(ParseLink("http://127.0.0.1:8080/#invite=x")->plain);
  EXPECT_EQ(ParseLink("https://[fe80::1]:8443/#invite=x")->server, "[fe80::1]:50051");
}

TEST(Address, OfOurOwnSchemeNamesGrpcsPort) {
  EXPECT_EQ(ParseLink("saccade://bench:50099/#invite=x")->server, "bench:50099");
  EXPECT_EQ(ParseLink("saccade://bench")->server, "bench:50051");
  EXPECT_EQ(ParseLink("saccade://bench")->invite, "");
}

TEST(Address, WhatIsNoneSaysWhatOneLooksLike) {
  for (const char* bad : {"ftp://a/#invite=x", "https://a/", "https:///#invite=x", "saccade://",
                          "saccade://a:70000", "https://u@a/#invite=x", "https://a/#invite=", ""}) {
    const auto address = ParseLink(bad);
    ASSERT_FALSE(address.ok()) << bad;
    EXPECT_THAT(std::string(address.status().message()), HasSubstr("https://HOST")) << bad;
  }
}

TEST(Options, SeveralServersAreTabsAndOneServerWithOneLinkIsOne) {
  const auto parse = [](std::vector<const char*> words) {
    words.insert(words.begin(), "saccade-client");
    return ParseCommandLine(static_cast<int>(words.size()), words.data()).options;
  };
  EXPECT_EQ(parse({})->servers[0].server, "127.0.0.1:50051");
  EXPECT_EQ(parse({"--server", "a:1", "--server", "b:2"})->servers.size(), 2u);
  const auto one = parse({"--server", "a:1", "https://a:8443/#invite=x"});
  ASSERT_EQ(one->servers.size(), 1u);
  EXPECT_EQ(one->servers[0].server, "a:1");
  EXPECT_EQ(one->servers[0].invite, "x");
}

class SettingsFiles : public ::testing::Test {
 protected:
  SettingsFiles()
      : folder_(fs::path(::testing::TempDir()) /
                ("client-settings-" + std::to_string(::getpid()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~SettingsFiles() override { fs::remove_all(folder_); }
  const fs::path folder_;
};

TEST_F(SettingsFiles, ComeBackAsTheyWereAndAreTheirOwnersAlone) {
  const fs::path file = folder_ / "saccade" / "client.toml";
  Settings settings;
  settings.name = "Ann \"the\\wise\" Ü";
  settings.window = {1600, 900, true};
  settings.layout.panel_width = 333;
  settings.main = view::Pane::kVideo;
  settings.light = settings.layout.talk_open = true;
  ASSERT_TRUE(SaveSettings(file, settings).ok());
  struct stat facts {};
  ASSERT_EQ(::stat(file.c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777, 0600u);
  Settings read;
  const absl::Status loaded = LoadSettings(file, read);
  ASSERT_TRUE(loaded.ok()) << loaded;
  EXPECT_EQ(read.name, settings.name);
  EXPECT_EQ(read.window.width, 1600);
  EXPECT_TRUE(read.window.maximised);
  EXPECT_FLOAT_EQ(read.layout.panel_width, 333);
  EXPECT_EQ(read.main, view::Pane::kVideo);
  EXPECT_TRUE(read.light);
  EXPECT_TRUE(read.layout.talk_open);
}

TEST_F(SettingsFiles, OnesThatMakeNoSenseAreNamedAndChangeNothing) {
  const fs::path file = folder_ / "client.toml";
  std::ofstream(file) << "[client]\nname = \"A\"\npanel_width = 5\n";
  Settings settings;
  const absl::Status loaded = LoadSettings(file, settings);
  EXPECT_THAT(std::string(loaded.message()), HasSubstr("panel_width"));
  EXPECT_EQ(settings.name, "");
  std::ofstream(file) << "[client]\ntheme = \"pink\"\n";
  EXPECT_THAT(std::string(LoadSettings(file, settings).message()), HasSubstr("theme"));
  EXPECT_TRUE(LoadSettings(folder_ / "none.toml", settings).ok());
}

TEST(Snapshot, HasItsFactsInsideAndIsStillAPng) {
  std::string png("\x89PNG\r\n\x1a\n", 8);
  png += std::string("\0\0\0\0IEND\xae\x42\x60\x82", 12);
  const auto with = WithText(png, "saccade", "{\"frameId\":7}");
  ASSERT_TRUE(with.ok()) << with.status();
  EXPECT_THAT(*with, HasSubstr("iTXtsaccade"));
  EXPECT_THAT(*with, HasSubstr("{\"frameId\":7}"));
  EXPECT_EQ(with->substr(with->size() - 12), png.substr(png.size() - 12));
  EXPECT_FALSE(WithText("no picture", "saccade", "x").ok());
}

}  // namespace
}  // namespace saccade::app::app_test
