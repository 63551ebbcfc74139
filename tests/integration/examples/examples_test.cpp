// The programs of examples/ as a user runs them, held against the simulator's truth.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "client/net/connection.hpp"
#include "server/sim/sim_source.hpp"
#include "shared/geometry/rigid3.hpp"
#include "tests/integration/support/process.hpp"

namespace saccade::testing::examples_test {
namespace {

using nlohmann::json;
using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;
// Half the rate: three programs and a renderer share the machine with other tests.
// tests.
constexpr char kSway[] = "sim:desk?motion=sway&fps=15";
constexpr char kStand[] = "sim:desk?motion=stand&fps=15";

Rigid3 ToRigid(const json& pose) {
  const json& t = pose.at("translation_m");
  const json& q = pose.at("rotation_xyzw");
  return {Eigen::Quaterniond(q[3].get<double>(), q[0].get<double>(), q[1].get<double>(),
                             q[2].get<double>()),
          Eigen::Vector3d(t[0].get<double>(), t[1].get<double>(), t[2].get<double>())};
}

// world_from_camera by frame, from --sim-truth.
std::map<FrameId, Rigid3> ReadTruth(const std::string& file) {
  std::map<FrameId, Rigid3> truth;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    const json frame = json::parse(line, nullptr, /*allow_exceptions=*/false);
    if (frame.is_discarded()) continue;  // the line being written
    truth[frame.at("frame").get<FrameId>()] = ToRigid(frame.at("world_from_camera"));
  }
  return truth;
}

constexpr char kPython[] = "/usr/bin/python3";  // the one that Debian's modules belong to
constexpr char kNoPython[] = "python3-grpcio or python3-protobuf is missing: deploy/install";
bool HasPython() {
  return std::filesystem::exists(kPython) &&
         RunProgram({kPython, "-c", "import grpc, google.protobuf"}).exit_code == 0;
}

// The poses that follow_pose prints: frame status metric|relative x y z qx qy qz qw.
TEST(Examples, FollowPoseInCppPrintsWhereTheCameraIs) {
  const TemporaryFolder folder;
  const std::string truth_file = folder / "truth";
  Server server({"--source", kSway, "--data-dir", folder / "data", "--sim-truth", truth_file});
  const RunResult result = RunProgram({FOLLOW_POSE, server.grpc(), "60"}, seconds(40));
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const std::map<FrameId, Rigid3> truth = ReadTruth(truth_file);
  int poses = 0, tracked = 0;
  FrameId before = 0;
  std::stringstream lines(result.out);
  FrameId frame = 0;
  std::string status, scale;
  double x, y, z, qx, qy, qz, qw;
  for (; lines >> frame >> status >> scale >> x >> y >> z >> qx >> qy >> qz >> qw; ++poses) {
    EXPECT_TRUE(poses == 0 || frame > before) << "frame " << frame << " after " << before;
    before = frame;
    if (status != "tracking") continue;
    ++tracked;
    ASSERT_TRUE(truth.contains(frame)) << frame;
    const Rigid3 told{Eigen::Quaterniond(qw, qx, qy, qz), Eigen::Vector3d(x, y, z)};
    EXPECT_EQ(scale, "metric");  // the simulator begins before a board of known size
    EXPECT_LT((told.translation - truth.at(frame).translation).norm(), 0.05) << "frame " << frame;
    EXPECT_LT(RotationAngle(told, truth.at(frame)), 3 * kDegree) << "frame " << frame;
  }
  EXPECT_EQ(poses, 60) << result.out;
  EXPECT_GE(tracked, 30) << result.out;
}

TEST(Examples, FollowPoseInCppSaysThatNobodyAnswers) {
  const RunResult result = RunProgram({FOLLOW_POSE, "127.0.0.1:1", "1"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("follow_pose: "));
  EXPECT_THAT(result.err, HasSubstr("no server answers at 127.0.0.1:1"));
}

TEST(Examples, PlaceMarkInPythonMarksWhatThePictureShows) {
  if (!HasPython()) GTEST_SKIP() << kNoPython;
  const TemporaryFolder folder;
  Server server({"--source", kSway, "--data-dir", folder / "data"});
  const RunResult result = RunProgram(
      {kPython, PLACE_MARK, "--server", server.grpc(), "--text", "this screw"}, seconds(40));
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  std::stringstream words(result.out);  // frame N mark ID at X Y Z error E mm STATE
  std::string word, id;
  FrameId frame = 0;
  Eigen::Vector3d point;
  words >> word >> frame >> word >> id >> word >> point.x() >> point.y() >> point.z();
  ASSERT_TRUE(words) << result.out;

  net::ConnectionOptions options;
  options.server = server.grpc();
  auto connection = net::Connection::Create(options);
  ASSERT_TRUE(connection.ok()) << connection.status();
  const auto marks = (*connection)->ListAnnotations();
  ASSERT_TRUE(marks.ok()) << marks.status();
  ASSERT_EQ(marks->size(), 1U);
  EXPECT_EQ(marks->front().id, id);
  EXPECT_EQ(marks->front().text, "this screw");
  EXPECT_EQ(marks->front().author, "place_mark");

  const auto source = SimSource::OpenUri(std::string(kSway).substr(4), {});
  ASSERT_TRUE(source.ok()) << source.status();
  const auto shown = (*source)->PointAt(frame, {319.5, 239.5});
  ASSERT_TRUE(shown);
  const double distance = (*shown - (*source)->WorldFromCamera(frame).translation).norm();
  EXPECT_LT((point - *shown).norm(), 0.1 * distance)
      << result.out << "true place " << shown->transpose() << ", " << distance << " m away";
}

TEST(Examples, PlaceMarkInPythonSaysWhatTheServerSays) {
  if (!HasPython()) GTEST_SKIP() << kNoPython;
  const TemporaryFolder folder;
  Server server({"--source", kSway, "--data-dir", folder / "data"});
  const RunResult result = RunProgram(
      {kPython, PLACE_MARK, "--server", server.grpc(), "--pixel", "1000", "20"}, seconds(40));
  EXPECT_EQ(result.exit_code, 1) << result.out;
  EXPECT_THAT(result.err, HasSubstr("place_mark: INVALID_ARGUMENT: "));
  EXPECT_THAT(result.err, HasSubstr("pixel"));
}

// With the packages that the page has; the README's other way is npm install. One test, as its two
// halves would build in one folder.
TEST(Examples, TurnHeadInTypeScriptTurnsItToThePointAndSaysWhereThereIsNoHead) {
  namespace fs = std::filesystem;
  const fs::path modules = fs::path(SACCADE_SOURCE_DIR) / "web/node_modules";
  if (!fs::exists(modules) || !fs::exists(SACCADE_NPM) || !fs::exists(SACCADE_NODE)) {
    GTEST_SKIP() << modules << ", npm or node is missing: deploy/install";
  }
  const std::string example = SACCADE_SOURCE_DIR "/examples/typescript";
  if (!fs::exists(fs::symlink_status(example + "/node_modules"))) {
    fs::create_directory_symlink("../../web/node_modules", example + "/node_modules");
  }
  const RunResult built =
      RunProgram({SACCADE_NPM, "--prefix", example, "run", "build"}, seconds(90));
  ASSERT_EQ(built.exit_code, 0) << built.out << built.err;

  const TemporaryFolder folder;
  const std::string program = example + "/dist/turn_head.js", truth_file = folder / "truth";
  {
    Server server({"--source", kStand, "--mount", "sim", "--data-dir", folder / "data",
                   "--sim-truth", truth_file});
    const RunResult result = RunProgram(
        {SACCADE_NODE, program, "http://" + server.http(), "0.5", "0.1", "-0.2", "2"}, seconds(60));
    ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_THAT(result.out, HasSubstr("arrived, off by "));
  }
  // The true angle between the optic axis and the point, frame by frame.
  const std::map<FrameId, Rigid3> truth = ReadTruth(truth_file);
  ASSERT_TRUE(truth.contains(0));
  const auto off_by = [](const Rigid3& world_from_camera) {
    const Eigen::Vector3d seen = world_from_camera.Inverse() * Eigen::Vector3d(0.5, 0.1, -0.2);
    return std::atan2(seen.head<2>().norm(), seen.z());
  };
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [frame, pose] : truth) least = std::min(least, off_by(pose));
  EXPECT_GT(off_by(truth.at(0)), 10 * kDegree);
  EXPECT_LT(least, 1.5 * kDegree);

  Server headless({"--source", kStand, "--data-dir", folder / "data"});
  const RunResult refused =
      RunProgram({SACCADE_NODE, program, "http://" + headless.http()}, seconds(60));
  EXPECT_EQ(refused.exit_code, 1) << refused.out;
  EXPECT_THAT(refused.err, HasSubstr("turn_head: gaze: no mount"));
}

// Who copies the example gets what the page is tested with.
TEST(Examples, TypeScriptNamesTheVersionsOfThePage) {
  const auto read = [](const std::string& file) {
    std::ifstream in(std::string(SACCADE_SOURCE_DIR) + file);
    return json::parse(in, nullptr, /*allow_exceptions=*/false);
  };
  const json page = read("/web/package.json"), example = read("/examples/typescript/package.json");
  for (const char* kind : {"dependencies", "devDependencies"}) {
    ASSERT_FALSE(example.at(kind).empty());
    for (const auto& [name, version] : example.at(kind).items()) {
      EXPECT_EQ(page.at(kind).value(name, "none"), version) << name;
    }
  }
}

}  // namespace
}  // namespace saccade::testing::examples_test
