#include "server/team/team_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace saccade::team_file_test {
namespace {

class TeamFile : public ::testing::Test {
 protected:
  absl::StatusOr<TeamDescription> Load(const std::string& text) {
    const auto file = std::filesystem::path(::testing::TempDir()) /
                      ("team_" + std::to_string(::getpid()) + ".toml");
    std::ofstream(file) << text;
    auto team = LoadTeam(file);
    std::filesystem::remove(file);
    return team;
  }
};

TEST_F(TeamFile, SaysWhoIsThere) {
  const auto team = Load(R"(
[[robot]]
name = "anna"
source = "v4l2:/dev/video0"
[[robot.camera]]
source = "v4l2:/dev/video2"
lens = "left.yaml"
pose = [0.1, 0, 0, 0, 0, 0, 1]
[[robot.marker]]
family = "apriltag36h11"
id = 3
side_m = 0.12
pose = [0, 0, 0.2, 0, 0, 0.70710678, 0.70710678]
[[robot]]
name = "cart"
source = "rtsp://cart/1"
mount = "sim"
model = "planar"
[[camera]]
name = "tripod"
source = "rtsp://tripod/1"
[[marker]]
family = "koller"
id = 3
side_m = 1
)");
  ASSERT_TRUE(team.ok()) << team.status();
  ASSERT_EQ(team->robots.size(), 2u);
  const TeamRobot& anna = team->robots[0];
  EXPECT_EQ(anna.model, "agile");
  EXPECT_EQ(anna.mount, "none");
  ASSERT_EQ(anna.cameras.size(), 1u);
  EXPECT_EQ(anna.cameras[0].lens.filename(), "left.yaml");
  EXPECT_TRUE(anna.cameras[0].lens.has_parent_path());
  EXPECT_EQ(anna.cameras[0].pose->translation.x(), 0.1);
  ASSERT_EQ(anna.markers.size(), 1u);
  EXPECT_NEAR(RotationAngle(*anna.markers[0].pose, Rigid3()), M_PI / 2, 1e-6);
  EXPECT_EQ(team->robots[1].model, "planar");
  ASSERT_EQ(team->cameras.size(), 1u);
  EXPECT_FALSE(team->cameras[0].pose) << "it finds its place";
  ASSERT_EQ(team->markers.size(), 1u);
  EXPECT_EQ(team->markers[0].side_m, 1.0);
}

TEST_F(TeamFile, SaysWhatIsWrongAndWhatToDo) {
  const std::string robot = "[[robot]]\nname = \"a\"\nsource = \"s\"\n";
  const std::string marker = "[[robot.marker]]\nfamily = \"koller\"\nid = 1\nside_m = 0.1\n";
  const std::string pose = "pose = [0, 0, 0, 0, 0, 0, 1]\n";
  const std::pair<std::string, const char*> cases[] = {
      {"", "robot: there is nobody"},
      {"robot = 3\n", "robot: is not a list of tables; write [[robot]]"},
      {"[robot]\nname = \"a\"\n", "write [[robot]]"},
      {"[[robots]]\n", "robots: is not known; there are robot, camera, marker"},
      {"[[robot]]\nsource = \"s\"\n", "robot[0].name: is missing"},
      {"[[robot]]\nname = \"a\"\n", "robot[0].source: is missing"},
      {robot + "modle = \"agile\"\n", "robot[0].modle: is not known"},
      {robot + "model = \"fast\"\n", "robot[0].model: 'fast'; give one of agile, "},
      {robot + "mount = 3\n", "robot[0].mount: is not a text"},
      {robot + robot, "robot[1].name: 'a' is there twice"},
      {robot + marker, "robot[0].marker[0].pose: is missing"},
      {robot + marker + "pose = [0, 0, 0]\n", "robot[0].marker[0].pose: give [x, y, z"},
      {robot + marker + "pose = [0, 0, 0, 1, 1, 1, 1]\n", "a quaternion of length 1"},
      {robot + marker + pose + marker + pose, "marker 1 of koller is there twice"},
      {robot + "[[marker]]\nfamily = \"koller\"\nid = -1\nside_m = 1\n",
       "marker[0].id: give a whole"},
      {robot + "[[marker]]\nfamily = \"koller\"\nid = 1\nside_m = 0\n",
       "marker[0].side_m: give the"},
      {robot + "[[camera]]\nsource = \"s\"\n", "camera[0].name: is missing"},
      {robot + "[[camera]]\nname = \"a\"\nsource = \"s\"\n", "camera[0].name: 'a' is there twice"},
      {"robot = [1]\n", "robot: is not a list of tables"},
  };
  for (const auto& [text, message] : cases) {
    const auto team = Load(text);
    ASSERT_FALSE(team.ok()) << text;
    EXPECT_EQ(team.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(team.status().message()), ::testing::HasSubstr(message)) << text;
    EXPECT_THAT(std::string(team.status().message()), ::testing::HasSubstr(".toml: ")) << text;
  }
  EXPECT_FALSE(Load("[[robot]\n").ok());
  EXPECT_EQ(LoadTeam("/nowhere/team.toml").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace saccade::team_file_test
