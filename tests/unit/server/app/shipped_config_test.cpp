// deploy/debian/saccade.toml, which the package installs as /etc/saccade/saccade.toml.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <regex>

#include "server/app/server_config.hpp"
#include "server/gaze/gaze_options.hpp"
#include "server/mount/drivers/drivers.hpp"
#include "server/tracker/tracker_options.hpp"

namespace saccade::shipped_config_test {
namespace {

constexpr char kShipped[] = SACCADE_SOURCE_DIR "/deploy/debian/saccade.toml";

std::string Read(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

ServerConfig Load(const std::string& file) {
  std::string words[] = {"saccade-server", "--config", file};
  char* argv[] = {words[0].data(), words[1].data(), words[2].data()};
  const auto config = ServerConfig::FromCommandLine(3, argv);
  EXPECT_TRUE(config.ok()) << config.status();
  return config.ok() && config->has_value() ? **config : ServerConfig{};
}

TEST(ShippedConfig, IsReadAndOpenToNobodyElse) {
  const ServerConfig config = Load(kShipped);
  EXPECT_FALSE(config.beyond_loopback());
  EXPECT_FALSE(config.insecure);
  EXPECT_EQ(config.source, "sim:desk");
  EXPECT_EQ(config.data_dir, "/var/lib/saccade");
}

// A line that people uncomment is a key, and its value is the default it claims to be.
TEST(ShippedConfig, LinesWithANumberSignAreTheDefaults) {
  const std::string shipped = Read(kShipped);
  const std::regex commented("\n# (\\[[a-z]+\\]|[a-z_]+ = [^\n]*)");
  ASSERT_GE(std::distance(std::sregex_iterator(shipped.begin(), shipped.end(), commented), {}), 12);
  const std::string file =
      ::testing::TempDir() + "shipped_config_" + std::to_string(getpid()) + ".toml";
  std::ofstream(file) << std::regex_replace(shipped, commented, "\n$1");
  const ServerConfig all = Load(file), shipped_config = Load(kShipped);
  EXPECT_EQ(all.mount, shipped_config.mount);
  EXPECT_EQ(all.camera_file, shipped_config.camera_file);
  EXPECT_EQ(all.public_url, shipped_config.public_url);
  EXPECT_EQ(all.insecure, shipped_config.insecure);
  EXPECT_EQ(all.tls_certificate, shipped_config.tls_certificate);
  EXPECT_EQ(all.tls_required, shipped_config.tls_required);
  EXPECT_EQ(all.auth_required, shipped_config.auth_required);
  EXPECT_EQ(all.video_bit_rate_bit_s, shipped_config.video_bit_rate_bit_s);
  EXPECT_EQ(all.limits.scale, shipped_config.limits.scale);
  TrackerOptions tracker;
  EXPECT_TRUE(tracker.LoadToml(file).ok());
  GazeOptions gaze;
  EXPECT_TRUE(gaze.LoadToml(file).ok());
  EXPECT_TRUE(MountDrivers().Open("none", {.config_file = file}).ok());
  std::remove(file.c_str());
}

}  // namespace
}  // namespace saccade::shipped_config_test
