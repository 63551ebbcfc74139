#include "server/app/server_config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

#include "server/gaze/gaze_options.hpp"
#include "server/mount/drivers/drivers.hpp"
#include "server/tracker/tracker_options.hpp"

namespace saccade::server_config_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

absl::StatusOr<std::optional<ServerConfig>> Parse(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "saccade-server");
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  return ServerConfig::FromCommandLine(static_cast<int>(argv.size()), argv.data());
}

ServerConfig Good(const std::vector<std::string>& arguments) {
  const auto config = Parse(arguments);
  EXPECT_TRUE(config.ok()) << config.status();
  return config.ok() && config->has_value() ? **config : ServerConfig{};
}

std::string Error(const std::vector<std::string>& arguments) {
  const auto config = Parse(arguments);
  EXPECT_FALSE(config.ok());
  return std::string(config.status().message());
}

// A file in the test's own folder.
std::string Toml(const std::string& text) {
  const std::string path =
      ::testing::TempDir() + "/saccade_config_test_" + std::to_string(getpid()) + ".toml";
  std::ofstream(path) << text;
  return path;
}

TEST(ServerConfig, DefaultsAreTheContracts) {
  const ServerConfig config = Good({"--source", "sim:desk"});
  EXPECT_EQ(config.grpc.ToString(config.grpc.port), "127.0.0.1:50051");
  EXPECT_EQ(config.http.ToString(config.http.port), "127.0.0.1:8080");
  EXPECT_FALSE(config.every_frame);
  EXPECT_FALSE(config.run_for_s);
}

TEST(ServerConfig, EveryFlagOfTheContract) {
  const ServerConfig config =
      Good({"--source", "sim:desk", "--mount",   "none",   "--data-dir",  "/d",     "--camera",
            "c.yaml",   "--grpc",   "[::1]:0",   "--http", "localhost:0", "--gl",   "osmesa",
            "--speed",  "max",      "--run-for", "2.5",    "--sim-truth", "t.jsonl"});
  EXPECT_EQ(config.data_dir, "/d");
  EXPECT_EQ(config.camera_file, "c.yaml");
  EXPECT_EQ(config.grpc.ToString(7), "[::1]:7");
  EXPECT_EQ(config.http.ToString(7), "127.0.0.1:7");
  EXPECT_TRUE(config.every_frame);
  EXPECT_EQ(config.run_for_s, 2.5);
  EXPECT_EQ(config.sim_truth, "t.jsonl");
}

TEST(ServerConfig, BadUsageNamesTheFlagAndTheRemedy) {
  EXPECT_THAT(Error({}), HasSubstr("--source"));
  EXPECT_THAT(Error({"--source", "sim:desk", "--nonsense"}), HasSubstr("--nonsense"));
  EXPECT_THAT(Error({"--source", "sim:desk", "--speed", "fast"}), HasSubstr("--speed"));
  EXPECT_THAT(Error({"--source", "sim:desk", "--grpc", "50051"}), HasSubstr("--grpc"));
  EXPECT_THAT(Error({"--source", "sim:desk", "--grpc", "127.0.0.1:70000"}), HasSubstr("65535"));
  EXPECT_THAT(Error({"--source", "sim:desk", "--grpc", "example.org:1"}), HasSubstr("IP address"));
  EXPECT_THAT(Error({"--source", "sim:desk", "--run-for", "-1"}), HasSubstr("--run-for"));
  EXPECT_THAT(Error({"--source", "sim:desk", "--run-for", "nan"}), HasSubstr("--run-for"));
  EXPECT_THAT(Error({"--source", "sim:desk", "--mount", "warp"}), HasSubstr("use none, sim"));
  EXPECT_THAT(Error({"--source", "sim:desk", "--mount", "crop"}), HasSubstr("use none, sim"));
  EXPECT_THAT(Error({"--source", "sim:desk", "--mount", "dynamixel:"}),
              HasSubstr("dynamixel:/dev/ttyUSB0"));
  EXPECT_EQ(
      Good({"--source", "v4l2:/dev/video0", "--mount", "dynamixel:/dev/ttyUSB0?baud=57600"}).mount,
      "dynamixel:/dev/ttyUSB0?baud=57600");
  EXPECT_EQ(Good({"--source", "dataset:/x", "--mount", "crop:320x240"}).mount, "crop:320x240");
  EXPECT_THAT(Error({"--source", "dataset:/x", "--mount", "sim"}), HasSubstr("sim: source only"));
  EXPECT_THAT(Error({"--source", "sim:desk", "--mount", "sim", "--speed", "max"}),
              HasSubstr("--speed max"));
  EXPECT_EQ(Good({"--source", "sim:desk", "--mount", "sim"}).mount, "sim");
  EXPECT_THAT(Error({"--source", "sim:desk", "--gl", "vulkan"}), HasSubstr("--gl"));
  EXPECT_THAT(Error({"--source", "dataset:/x", "--sim-truth", "t"}), HasSubstr("--sim-truth"));
}

TEST(ServerConfig, BeyondThisMachineThereIsTlsAndInvitesUnlessInsecure) {
  const ServerConfig loopback = Good({"--source", "sim:desk"});
  EXPECT_FALSE(loopback.WantsTls(loopback.grpc) || loopback.WantsTls(loopback.http));
  EXPECT_FALSE(loopback.auth_required);
  for (const char* flag : {"--http", "--grpc"}) {
    const ServerConfig outside = Good({"--source", "sim:desk", flag, "0.0.0.0:1"});
    EXPECT_EQ(outside.WantsTls(outside.http), flag == std::string("--http"));
    EXPECT_EQ(outside.WantsTls(outside.grpc), flag == std::string("--grpc"));
    EXPECT_TRUE(outside.auth_required) << "on both ports: the other one is no back door";
  }
  EXPECT_TRUE(Good({"--source", "sim:desk", "--grpc", "[::]:1"}).auth_required);
  const ServerConfig lab = Good({"--source", "sim:desk", "--http", "0.0.0.0:1", "--insecure"});
  EXPECT_FALSE(lab.WantsTls(lab.http));
  EXPECT_FALSE(lab.auth_required);
}

TEST(ServerConfig, LoopbackHasTlsAndInvitesWhereAskedFor) {
  const std::string file =
      Toml("source = \"sim:desk\"\n[tls]\nrequired = true\n[auth]\nrequired = true\n");
  const ServerConfig config = Good({"--config", file});
  EXPECT_TRUE(config.WantsTls(config.grpc) && config.WantsTls(config.http));
  EXPECT_TRUE(config.auth_required);
  EXPECT_THAT(Error({"--config", file, "--insecure"}), HasSubstr("--insecure"));
  EXPECT_THAT(Error({"--config", Toml("[tls]\nrequires = true\n")}), HasSubstr("tls.requires"));
}

TEST(ServerConfig, ACertificateComesWithItsKey) {
  EXPECT_THAT(Error({"--source", "sim:desk", "--tls-certificate", "a.pem"}),
              HasSubstr("--tls-key"));
  EXPECT_THAT(Error({"--source", "sim:desk", "--tls-key", "a.key"}),
              HasSubstr("--tls-certificate"));
  const ServerConfig given =
      Good({"--source", "sim:desk", "--tls-certificate", "a.pem", "--tls-key", "a.key"});
  EXPECT_TRUE(given.WantsTls(given.http)) << "who gives one means it, on loopback, too";
  const ServerConfig file =
      Good({"--config", Toml("source = \"sim:desk\"\n[tls]\ncertificate = \"c\"\nkey = \"k\"\n")});
  EXPECT_EQ(file.tls_certificate, "c");
  EXPECT_EQ(file.tls_key, "k");
}

TEST(ServerConfig, ThePublicUrlIsAnOrigin) {
  EXPECT_EQ(Good({"--source", "sim:desk", "--public-url", "https://a.example/"}).public_url,
            "https://a.example");
  for (const char* bad :
       {"a.example", "https://", "https://a.example/path", "https://u@a.example"}) {
    EXPECT_THAT(Error({"--source", "sim:desk", "--public-url", bad}), HasSubstr("--public-url"));
  }
}

TEST(ServerConfig, TheFileIsReadAndFlagsWin) {
  const std::string file = Toml(
      "source = \"sim:desk\"\nseed = 9\ngrpc = \"127.0.0.1:1\"\n[video]\nbit_rate_bit_s = 900000\n"
      "[tracker]\nfeatures_in_view = 40\n");
  const ServerConfig config = Good({"--config", file, "--grpc", "127.0.0.1:2"});
  EXPECT_EQ(config.source, "sim:desk");
  EXPECT_EQ(config.seed, 9u);
  EXPECT_EQ(config.grpc.port, 2);
  EXPECT_EQ(config.video_bit_rate_bit_s, 900'000);
  EXPECT_EQ(config.config_file, file);
}

// Every key that exists is in what --print-config prints, with its default.
TEST(ServerConfig, ThePrintedFileSaysEverythingAndChangesNothing) {
  ::testing::internal::CaptureStdout();
  const auto printed = Parse({"--print-config"});
  const std::string text = ::testing::internal::GetCapturedStdout();
  ASSERT_TRUE(printed.ok()) << printed.status();
  EXPECT_FALSE(printed->has_value());
  for (const char* words :
       {"mount = \"none\"", "grpc = \"127.0.0.1:50051\"", "[video]", "[limits]", "[tracker]",
        "[tls]", "certificate = \"\"", "[auth]", "required = false", "pixel_sigma_px = 0.5",
        "[gaze]", "[mount_model.pan]", "[dynamixel]", "[v4l2]"}) {
    EXPECT_THAT(text, HasSubstr(words));
  }
  const std::string file = Toml(text);
  const ServerConfig config = Good({"--config", file, "--source", "sim:desk"});
  const ServerConfig plain = Good({"--source", "sim:desk"});
  EXPECT_EQ(config.mount, plain.mount);
  EXPECT_EQ(config.data_dir, plain.data_dir);
  EXPECT_EQ(config.grpc.port, plain.grpc.port);
  EXPECT_EQ(config.seed, plain.seed);
  EXPECT_EQ(config.limits.scale, plain.limits.scale);
  EXPECT_EQ(config.video_bit_rate_bit_s, plain.video_bit_rate_bit_s);
  TrackerOptions tracker;
  EXPECT_TRUE(tracker.LoadToml(file).ok()) << tracker.LoadToml(file);
  EXPECT_EQ(tracker.pixel_sigma_px, TrackerOptions().pixel_sigma_px);
  GazeOptions gaze;
  EXPECT_TRUE(gaze.LoadToml(file).ok()) << gaze.LoadToml(file);
  EXPECT_TRUE(MountDrivers().Open("none", {.config_file = file}).ok());
}

TEST(ServerConfig, ABadFileIsNamedWithItsKey) {
  EXPECT_THAT(Error({"--config", "/nowhere.toml"}), HasSubstr("/nowhere.toml"));
  EXPECT_THAT(Error({"--config", Toml("sorce = \"sim:desk\"")}), HasSubstr("unknown key sorce"));
  EXPECT_THAT(Error({"--config", Toml("[video]\nrate = 1")}), HasSubstr("video.rate"));
  EXPECT_THAT(Error({"--config", Toml("source = 4")}), HasSubstr("saccade_config_test_"));
  EXPECT_THAT(Error({"--config", Toml("source = ")}), HasSubstr("saccade_config_test_"));
}

TEST(ServerConfig, NumbersOutsideTheirRangeAreRefusedByName) {
  for (const char* time : {"1e30", "inf", "-inf", "nan", "-0.1", "1e10", "1e999", "ten"}) {
    EXPECT_THAT(Error({"--source", "sim:desk", "--run-for", time}), HasSubstr("--run-for")) << time;
  }
  EXPECT_EQ(Good({"--source", "sim:desk", "--run-for", "0"}).run_for_s, 0.0);
  EXPECT_EQ(Good({"--source", "sim:desk", "--run-for", "1e9"}).run_for_s, 1e9);
  for (const char* rate : {"1", "49999", "100000001", "-1", "-9223372036854775808"}) {
    EXPECT_THAT(Error({"--source", "sim:desk", "--config",
                       Toml("[video]\nbit_rate_bit_s = " + std::string(rate))}),
                AllOf(HasSubstr("video.bit_rate_bit_s"), HasSubstr("50000 to 100000000")))
        << rate;
  }
  EXPECT_THAT(Error({"--source", "sim:desk", "--config", Toml("seed = -1")}), HasSubstr("seed"));
  for (const char* address : {"127.0.0.1:-1", "127.0.0.1:65536", "127.0.0.1:1e3", "127.0.0.1:"}) {
    EXPECT_THAT(Error({"--source", "sim:desk", "--grpc", address}), HasSubstr("--grpc")) << address;
  }
}

TEST(ServerConfig, WhatIsNoConfigurationFileIsNamed) {
  EXPECT_THAT(Error({"--config", "/tmp"}), AllOf(HasSubstr("/tmp"), HasSubstr("is a folder")));
  EXPECT_THAT(Error({"--config", "/dev/zero"}), HasSubstr("is a device"));
  EXPECT_THAT(Error({"--config", std::string(5000, 'x')}), HasSubstr("--config"));
  EXPECT_THAT(Error({"--config", Toml("source = " + std::string(100'000, '['))}),
              AllOf(HasSubstr("saccade_config_test_"), HasSubstr("nested")));
}

TEST(ServerConfig, VersionPrintsAndGivesNothing) {
  const auto config = Parse({"--version"});
  ASSERT_TRUE(config.ok());
  EXPECT_FALSE(config->has_value());
}

}  // namespace
}  // namespace saccade::server_config_test
