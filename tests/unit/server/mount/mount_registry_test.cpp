#include "server/mount/mount_registry.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace saccade::mount_registry_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// What a driver was asked, instead of a mount.
struct Asked {
  std::string check, open;
  double max_rate_rad_s = 0;
};

MountDriver Driver(const std::string& scheme, const std::string& table, Asked& asked) {
  return {.scheme = scheme,
          .usage = scheme + "...",
          .example = scheme + "example",
          .table = table,
          .describe = table.empty() ? nullptr : std::function<std::string()>([table] {
            return "[" + table + "]\n";
          }),
          .check =
              [&asked](const std::string& rest, const MountFacts&) {
                asked.check = rest;
                return absl::OkStatus();
              },
          .open = [&asked](const std::string& rest, const MountOptions& model,
                           const MountContext&) -> absl::StatusOr<OpenedMount> {
            asked.open = rest;
            asked.max_rate_rad_s = model.of(MountJoint::kPan).max_rate_rad_s;
            return OpenedMount{};
          }};
}

TEST(MountRegistry, ADriverGetsWhatFollowsItsScheme) {
  Asked motors, plain;
  MountRegistry registry;
  registry.Add(Driver("motors:", "motors", motors));
  registry.Add(Driver("plain", "", plain));
  EXPECT_TRUE(registry.Check("motors:/dev/x?y=1", {}).ok());
  EXPECT_EQ(motors.check, "/dev/x?y=1");
  EXPECT_TRUE(registry.Open("plain?seed=1", {}).ok());
  EXPECT_EQ(plain.open, "seed=1");
  EXPECT_TRUE(registry.Open("plain", {}).ok());
  EXPECT_EQ(plain.open, "");
  EXPECT_EQ(registry.Usage(), "none | motors:... | plain...");
  EXPECT_THAT(registry.Tables(), ElementsAre("mount_model", "motors"));
  EXPECT_THAT(registry.Describe(), HasSubstr("[motors]"));
}

TEST(MountRegistry, NoneIsNoMountAndTheUnknownIsRefusedWithExamples) {
  Asked asked;
  MountRegistry registry;
  registry.Add(Driver("motors:", "", asked));
  registry.Add(Driver("plain", "", asked));
  const absl::StatusOr<OpenedMount> none = registry.Open("none", {});
  ASSERT_TRUE(none.ok());
  EXPECT_EQ(none->mount, nullptr);
  for (const char* uri : {"", "motors", "plainer", "plain:x", "nothing:"}) {
    const std::string words =
        "'" + std::string(uri) + "' is not known: use none, motors:example or plainexample";
    EXPECT_THAT(std::string(registry.Check(uri, {}).message()), HasSubstr(words));
    EXPECT_EQ(registry.Open(uri, {}).status().code(), absl::StatusCode::kInvalidArgument);
  }
}

TEST(MountRegistry, TheModelOfTheFileReachesTheDriverAndItsErrorsTheUser) {
  Asked asked;
  MountRegistry registry;
  registry.Add(Driver("motors:", "", asked));
  const std::filesystem::path file = ::testing::TempDir() + "mount_registry_test.toml";
  std::ofstream(file) << "[mount_model.pan]\nmax_rate_deg_s = 90\n";
  ASSERT_TRUE(registry.Open("motors:", {.config_file = file}).ok());
  EXPECT_NEAR(asked.max_rate_rad_s, 0.5 * std::numbers::pi, 1e-12);
  std::ofstream(file) << "[mount_model.pan]\nmax_rate_deg_s = 0\n";
  for (const char* uri : {"motors:", "none"}) {
    EXPECT_THAT(std::string(registry.Open(uri, {.config_file = file}).status().message()),
                HasSubstr("mount_model.pan.max_rate_deg_s"));
  }
}

}  // namespace
}  // namespace saccade::mount_registry_test
