// The command line against the real server, which plays a small data set made here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/integration/support/process.hpp"
#include "tests/integration/support/small_dataset.hpp"

namespace saccade::testing::cli_test {
namespace {

using nlohmann::json;
using std::chrono::seconds;
using ::testing::HasSubstr;

RunResult Saccade(std::vector<std::string> arguments, const std::string& state_folder) {
  arguments.insert(arguments.begin(), SACCADE_PROGRAM);
  return RunProgram(arguments, seconds(20), {"XDG_STATE_HOME=" + state_folder});
}

// One line that names the thing, and nothing on stdout.
void ExpectFailure(const RunResult& result, const std::string& part) {
  EXPECT_EQ(result.exit_code, 1) << result.out << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_THAT(result.err, HasSubstr("saccade: "));
  EXPECT_THAT(result.err, HasSubstr(part));
  EXPECT_EQ(result.out, "");
}

TEST(CommandLineAlone, SaysThatNoServerAnswersAndWhatToDo) {
  TemporaryFolder folder;
  // Port 1 is privileged and nobody's.
  const RunResult result = Saccade({"--server", "127.0.0.1:1", "status"}, folder.path());
  ExpectFailure(result, "no server answers at 127.0.0.1:1");
  EXPECT_THAT(result.err, HasSubstr("--server HOST:PORT"));
}

TEST(CommandLineAlone, ListsTheCamerasOfThisMachineWithoutAServer) {
  TemporaryFolder folder;
  const RunResult text = Saccade({"--server", "127.0.0.1:1", "cameras"}, folder.path());
  EXPECT_EQ(text.exit_code, 0) << text.err;
  const RunResult result = Saccade({"cameras", "--json"}, folder.path());
  const json cameras = json::parse(result.out, nullptr, /*allow_exceptions=*/false);
  ASSERT_TRUE(cameras["cameras"].is_array()) << result.out;
  bool any = false;
  for (const auto& entry : std::filesystem::directory_iterator("/dev")) {
    any = any || entry.path().filename().string().rfind("video", 0) == 0;
  }
  EXPECT_EQ(cameras["cameras"].empty(), !any);
  if (!any) {
    EXPECT_THAT(text.out, HasSubstr("no camera is there"));
  }
}

class CommandLine : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    WriteSmallDataset(*folder_ / "set");
    server_ =
        new Server({"--source", "dataset:" + (*folder_ / "set"), "--data-dir", *folder_ / "data"});
  }
  static void TearDownTestSuite() {
    server_->process().Signal(SIGTERM);
    EXPECT_EQ(server_->process().Wait(seconds(2)), 0) << server_->process().err();
    delete server_;
    delete folder_;
  }

  static RunResult Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--server", server_->grpc()});
    return Saccade(arguments, *folder_ / "state");
  }
  static json RunJson(std::vector<std::string> arguments) {
    arguments.push_back("--json");
    const RunResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out, nullptr, /*allow_exceptions=*/false);
  }

  static TemporaryFolder* folder_;
  static Server* server_;
};
TemporaryFolder* CommandLine::folder_ = nullptr;
Server* CommandLine::server_ = nullptr;

TEST_F(CommandLine, StatusNamesSourceAndTracking) {
  const json status = RunJson({"status"});
  EXPECT_THAT(status["source"].get<std::string>(), HasSubstr("dataset:"));
  EXPECT_TRUE(status["pose"]["status"].is_string());
  EXPECT_GT(status["uptime_s"].get<double>(), 0);
  const RunResult text = Run({"status"});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_THAT(text.out, HasSubstr("tracking"));
}

TEST_F(CommandLine, RawSnapshotIsTheRecordedPictureToTheBit) {
  const std::string file = *folder_ / "raw.png";
  const json taken = RunJson({"snapshot", "--view", "raw", "--out", file});
  const cv::Mat picture = cv::imread(file, cv::IMREAD_GRAYSCALE);
  ASSERT_EQ(picture.size(), cv::Size(320, 240));
  char name[32];
  std::snprintf(name, sizeof name, "/rgb/%.6f.png", taken["frame_id"].get<int>() / 30.0);
  const cv::Mat truth = cv::imread(*folder_ / "set" + name, cv::IMREAD_GRAYSCALE);
  ASSERT_FALSE(truth.empty()) << name;
  EXPECT_EQ(cv::norm(picture, truth, cv::NORM_INF), 0.0);
}

TEST_F(CommandLine, AugmentedSnapshotIsAPictureToo) {
  const std::string file = *folder_ / "augmented.png";
  RunJson({"snapshot", "--view", "augmented", "--out", file});
  EXPECT_EQ(cv::imread(file).size(), cv::Size(320, 240));
}

TEST_F(CommandLine, MapIsWrittenAsPly) {
  const std::string file = *folder_ / "map.ply";
  const json answer = RunJson({"map", "--out", file});
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_THAT(text.str(), ::testing::StartsWith("ply\n"));
  EXPECT_THAT(text.str(), HasSubstr("element vertex " + answer["features"].dump() + "\n"));
}

TEST_F(CommandLine, WatchDeliversPosesAndEndsInTime) {
  const RunResult result = Run({"watch", "--for", "1", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(result.out);
  std::string line;
  int events = 0;
  while (std::getline(lines, line)) {
    EXPECT_TRUE(json::accept(line)) << line;
    ++events;
  }
  EXPECT_GT(events, 0);
}

TEST_F(CommandLine, AnnotationIsPlacedShownDeletedAndBroughtBack) {
  const json placed =
      RunJson({"annotate", "--point", "0.1,-0.05,1.5", "--shape", "note", "--text", "oil"});
  const std::string id = placed["id"];
  EXPECT_EQ(placed["shape"], "note");
  EXPECT_EQ(placed["text"], "oil");

  EXPECT_EQ(RunJson({"annotations", "show", id.substr(0, 8)})["id"], id);
  const auto listed = [&] {
    const json all = RunJson({"annotations"});
    return std::any_of(all.begin(), all.end(), [&](const json& a) { return a["id"] == id; });
  };
  EXPECT_TRUE(listed());
  EXPECT_EQ(RunJson({"annotations", "delete", id})["deleted"], id);
  EXPECT_FALSE(listed());
  RunJson({"annotations", "undo"});  // another process, the same session
  EXPECT_TRUE(listed());
  RunJson({"annotations", "redo"});
  EXPECT_FALSE(listed());
}

TEST_F(CommandLine, BadTargetsAreRefusedByName) {
  ExpectFailure(Run({"annotate", "--pixel", "5000,10"}), "--pixel: u 5000 is outside the picture");
  ExpectFailure(Run({"annotate", "--point", "1e9,0,1"}), "--point: x 1e+09 is beyond");
  ExpectFailure(Run({"annotate", "--feature", "18446744073709551615"}),
                "--feature: 18446744073709551615 is not in the map");
  ExpectFailure(Run({"annotate", "--pixel", "10,10", "--frame", "4000000000"}), "frame");
  ExpectFailure(Run({"annotate", "--point", "0,0,1", "--text", std::string(501, 'x')}),
                "--text: at most 500 bytes, not 501");
  ExpectFailure(Run({"annotate", "--pixel", "1,1", "--shape", "ink", "--stroke", "1,1,-9,1"}),
                "--stroke: point 2, u -9 is outside");
  ExpectFailure(Run({"--name", std::string(70, 'x'), "annotate", "--point", "0,0,1"}), "--name: ");
  ExpectFailure(Run({"annotations", "show", "ffffffff"}), "no annotation 'ffffffff'");
  ExpectFailure(
      Run({"snapshot", "--view", "raw", "--frame", "4000000000", "--out", *folder_ / "never.png"}),
      "frame");
}

TEST_F(CommandLine, ErrorsAreJsonWhereAnswersAre) {
  const RunResult failed = Run({"--json", "annotate", "--pixel", "5000,10"});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_EQ(failed.out, "");
  const json problem = json::parse(failed.err, nullptr, /*allow_exceptions=*/false);
  ASSERT_TRUE(problem.is_object()) << failed.err;
  EXPECT_EQ(problem["error"]["code"], "INVALID_ARGUMENT");
  EXPECT_THAT(problem["error"]["message"].get<std::string>(), ::testing::StartsWith("--pixel: u"));

  const RunResult usage = Run({"annotate", "--json", "--pixel", "1"});
  EXPECT_EQ(usage.exit_code, 2);
  EXPECT_TRUE(json::parse(usage.err, nullptr, false)["error"]["message"].is_string()) << usage.err;
  const RunResult nobody = Saccade({"--server", "127.0.0.1:1", "status", "--json"}, *folder_ / "s");
  EXPECT_EQ(json::parse(nobody.err, nullptr, false)["error"]["code"], "UNAVAILABLE") << nobody.err;
  EXPECT_EQ(Run({"annotate", "--point", "0,0,1", "--text", "\xff"}).exit_code, 2) << "not UTF-8";
}

TEST_F(CommandLine, UndoUnderAnotherNameLeavesOnesOwnMarks) {
  const auto as = [](const std::string& name, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--name", name});
    return Run(arguments);
  };
  const RunResult placed =
      as("Ann", {"annotate", "--point", "0.1,0.1,1.5", "--shape", "arrow", "--json"});
  ASSERT_EQ(placed.exit_code, 0) << placed.err;
  const json mark = json::parse(placed.out, nullptr, false);
  EXPECT_EQ(mark["author"], "Ann");
  EXPECT_TRUE(mark["created_unix_ns"].is_string()) << "2^53 ns were over in April 1970";
  ExpectFailure(as("Bob", {"annotations", "undo"}), "nothing to undo");
  EXPECT_EQ(as("Bob", {"annotations", "show", mark["id"]}).exit_code, 0);
  const RunResult undone = as("Ann", {"annotations", "undo"});
  EXPECT_EQ(undone.exit_code, 0) << undone.err;
  EXPECT_THAT(undone.out, HasSubstr("created arrow"));
  EXPECT_EQ(as("Ann", {"annotations", "show", mark["id"]}).exit_code, 1);
  for (const auto& file : std::filesystem::directory_iterator(*folder_ / "state" + "/saccade")) {
    EXPECT_EQ(file.status().permissions() & std::filesystem::perms::all,
              std::filesystem::perms::owner_read | std::filesystem::perms::owner_write)
        << file.path();
  }
}

TEST_F(CommandLine, EveryShapeIsPlacedAndShown) {
  const auto place = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(),
                     {"annotate", "--json", "--point", "0.1,0.1,1.5", "--shape"});
    const RunResult placed = Run(arguments);
    EXPECT_EQ(placed.exit_code, 0) << placed.err;
    return json::parse(placed.out, nullptr, false);
  };
  const json box = place({"box", "--extent", "0.1,0.2,0.3", "--rotation", "0,1,0,0"});
  EXPECT_EQ(box["extent_m"][1], 0.2);
  const json measure = place({"measure", "--to-point", "0.1,0.1,1.9"});
  EXPECT_NEAR(measure["length_m"].get<double>(), 0.4, 1e-6);
  EXPECT_THAT(Run({"annotations", "show", measure["id"]}).out, HasSubstr("length"));
  EXPECT_GE(place({"pin"})["number"].get<int>(), 1);
  const std::string png = *folder_ / "pinned.png";
  ASSERT_EQ(Run({"snapshot", "--view", "raw", "--out", png}).exit_code, 0);
  const json picture = place({"picture", "--picture", png});
  EXPECT_EQ(picture["picture"]["media_type"], "image/png");
  const std::string again = *folder_ / "again.png";
  ASSERT_EQ(Run({"annotations", "picture", picture["id"], "--out", again}).exit_code, 0);
  const auto bytes = [](const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  EXPECT_EQ(bytes(again), bytes(png));
  const json list = place({"check-list", "--item", "oil", "--item", "lid"});
  const RunResult ticked = Run({"annotations", "tick", list["id"], "2", "--json"});
  ASSERT_EQ(ticked.exit_code, 0) << ticked.err;
  EXPECT_EQ(json::parse(ticked.out)["check_items"][1]["done"], true);
  EXPECT_EQ(json::parse(Run({"annotations", "lock", list["id"], "--json"}).out)["locked"], true);
  ExpectFailure(Run({"--name", "Bob", "annotations", "delete", list["id"]}), "locked by");
  for (const json& one : {box, measure, picture, list}) {
    EXPECT_EQ(Run({"annotations", "delete", one["id"]}).exit_code, 0);
  }
}

TEST_F(CommandLine, AMapWithoutScaleHasNoMillimetres) {
  const RunResult placed = Run({"annotate", "--point", "0.1,0.1,1.5", "--text", "größer"});
  ASSERT_EQ(placed.exit_code, 0) << placed.err;
  EXPECT_THAT(placed.out, HasSubstr("scale unknown"));
  EXPECT_THAT(Run({"annotations"}).out, ::testing::Not(HasSubstr(" mm")));
  const json all = RunJson({"annotations"});
  ASSERT_FALSE(all.empty());
  EXPECT_TRUE(all.back()["anchor"]["error_mm"].is_null());
  EXPECT_EQ(all.back()["anchor"]["metric"], false);
  EXPECT_EQ(Run({"annotations", "delete", all.back()["id"]}).exit_code, 0);
}

TEST_F(CommandLine, FilesThatCannotBeWrittenAreNamed) {
  ExpectFailure(Run({"snapshot", "--view", "raw", "--out", "/nonexistent/a.png"}),
                "/nonexistent/a.png");
  ExpectFailure(Run({"snapshot", "--view", "raw", "--out", "/dev/full"}), "No space left");
}

TEST_F(CommandLine, TheWearerPausesThePictureAndLiftsIt) {
  const std::string file = *folder_ / "paused.png";
  const RunResult on = Run({"--name", "Ann", "pause-picture", "on"});
  EXPECT_EQ(on.exit_code, 0) << on.err;
  EXPECT_THAT(on.out, HasSubstr("paused by Ann since"));
  ExpectFailure(Run({"snapshot", "--view", "raw", "--out", file}), "Ann has paused it");
  ExpectFailure(Run({"snapshot", "--view", "augmented", "--out", file}), "Ann has paused it");
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_TRUE(RunJson({"status"})["picture_pause"]["paused"].get<bool>());
  EXPECT_THAT(Run({"status"}).out, HasSubstr("paused by Ann since"));
  EXPECT_FALSE(RunJson({"--name", "Bea", "pause-picture", "off"})["paused"].get<bool>());
  EXPECT_FALSE(RunJson({"status"})["picture_pause"]["paused"].get<bool>());
  EXPECT_EQ(Run({"pause-picture", "perhaps"}).exit_code, 2);
}

TEST_F(CommandLine, WhatIsSaidIsThereForOthers) {
  const json mark = RunJson({"annotate", "--point", "0,0,1", "--text", "here"});
  const std::string id = mark["id"];
  const json said =
      RunJson({"--name", "Ann", "say", "the left screw", "--annotation", id.substr(0, 10)});
  EXPECT_EQ(said["annotation_id"], id);
  EXPECT_EQ(said["display_name"], "Ann");
  const RunResult read = Run({"--name", "Bea", "messages"});
  EXPECT_EQ(read.exit_code, 0) << read.err;
  EXPECT_THAT(read.out, HasSubstr("Ann: the left screw  (mark " + id + ")"));
  ExpectFailure(Run({"say", "nowhere", "--annotation", "zz"}), "there is no annotation 'zz'");
  ExpectFailure(Run({"say", ""}), "text");
  RunJson({"annotations", "delete", id});
}

TEST_F(CommandLine, GazeSaysThatThereIsNoMount) {
  ExpectFailure(Run({"fixate", "--point", "0,0,1"}), "no mount");
  ExpectFailure(Run({"home"}), "no mount");
}

TEST(CommandLineWithAHead, FixateTurnsTheHeadSaysSoAndHomeBringsItBack) {
  TemporaryFolder folder;
  Server server({"--source", "sim:desk?motion=still&width=320&height=240", "--mount", "sim",
                 "--data-dir", folder / "data"});
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--server", server.grpc(), "--name", "Ann"});
    return Saccade(arguments, folder / "state");
  };
  // Until the tracker has a pose; a slow computer may need more than one try.
  double farthest = 0;
  std::string pilot;
  for (int attempt = 0; attempt < 5 && farthest < 0.1; ++attempt) {
    const RunResult result = run({"fixate", "--point", "1.0,0.2,0", "--for", "3", "--json"});
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) {
      const json state = json::parse(line, nullptr, /*allow_exceptions=*/false);
      ASSERT_TRUE(state.is_object()) << result.out << result.err;
      if (state["joints_rad"].is_array()) {
        farthest = std::max(farthest, state["joints_rad"][0].get<double>());
      }
      if (state["pilot"].is_string()) pilot = state["pilot"].get<std::string>();
    }
  }
  EXPECT_GT(farthest, 0.1);
  EXPECT_EQ(pilot, "Ann");
  const RunResult home = run({"home"});
  EXPECT_EQ(home.exit_code, 0) << home.err;
  EXPECT_THAT(home.out, HasSubstr("home"));
  ExpectFailure(run({"fixate", "--point", "0,0,700"}), "at most 30 m");
  ExpectFailure(run({"release"}), "lease");
  EXPECT_EQ(run({"fixate"}).exit_code, 2);
  server.process().Signal(SIGTERM);
  EXPECT_EQ(server.process().Wait(seconds(4)), 0) << server.process().err();
}

TEST_F(CommandLine, PortThatIsNotGrpcFailsClearly) {
  std::string http = server_->http();
  if (http.starts_with("http://")) http = http.substr(7);
  if (http.ends_with('/')) http.pop_back();
  const RunResult result =
      Saccade({"--server", http, "--timeout", "2", "status"}, *folder_ / "state");
  ExpectFailure(result, http);
}

}  // namespace
}  // namespace saccade::testing::cli_test
