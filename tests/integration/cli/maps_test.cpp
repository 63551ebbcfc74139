// A map that outlives its server, against the real one on the simulated wearable.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/integration/support/process.hpp"

namespace saccade::testing::maps_test {
namespace {

using nlohmann::json;
using std::chrono::seconds;
using ::testing::HasSubstr;

class Maps : public ::testing::Test {
 protected:
  std::vector<std::string> Arguments(std::vector<std::string> more = {}) {
    more.insert(more.end(),
                {"--source", "sim:desk?width=320&height=240", "--data-dir", folder_ / "data"});
    return more;
  }
  RunResult Saccade(const Server& server, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {SACCADE_PROGRAM, "--server", server.grpc()});
    return RunProgram(arguments, seconds(20), {"XDG_STATE_HOME=" + (folder_ / "state")});
  }
  json List(const Server& server) {
    const RunResult result = Saccade(server, {"maps", "list", "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out, nullptr, /*allow_exceptions=*/false);
  }
  /// As soon as enough is mapped.
  std::string Save(const Server& server, const std::string& name) {
    RunResult saved;
    for (int k = 0; k < 60; ++k) {
      saved = Saccade(server, {"maps", "save", name, "--json"});
      if (saved.exit_code == 0) return json::parse(saved.out)["id"];
      EXPECT_THAT(saved.err, HasSubstr("too little is mapped")) << "and nothing else";
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
    }
    ADD_FAILURE() << saved.err;
    return "";
  }
  static void End(Server& server) {
    server.process().Signal(SIGTERM);
    EXPECT_EQ(server.process().Wait(seconds(4)), 0) << server.process().err();
  }

  void GoesOutAndComesIn(const Server& server) {
    const std::string file = folder_ / "bench.map", damaged = folder_ / "damaged.map";
    const RunResult out = Saccade(server, {"maps", "export", "bench", "--out", file, "--json"});
    ASSERT_EQ(out.exit_code, 0) << out.err;
    const std::string id = json::parse(out.out)["id"];
    EXPECT_EQ(ReadFile(file), ReadFile(folder_ / ("data/maps/" + id + ".map")));
    EXPECT_THAT(Saccade(server, {"maps", "import", file}).err, HasSubstr("is kept here already"));
    EXPECT_EQ(Saccade(server, {"maps", "delete", id}).exit_code, 0);
    std::string bytes = ReadFile(file);
    bytes[bytes.size() / 2] ^= 1;
    std::ofstream(damaged, std::ios::binary) << bytes;
    EXPECT_THAT(Saccade(server, {"maps", "import", damaged}).err, HasSubstr("is damaged"));
    EXPECT_EQ(List(server).size(), 1U);
    const RunResult in = Saccade(server, {"maps", "import", file});
    EXPECT_EQ(in.exit_code, 0) << in.err;
    EXPECT_THAT(in.out, HasSubstr("took in the map " + id + " 'bench'"));
    EXPECT_EQ(Saccade(server, {"maps", "load", "bench"}).exit_code, 0) << "and can be come back to";
  }
  static std::string ReadFile(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  TemporaryFolder folder_;
};

TEST_F(Maps, OutliveTheServerAndAreComeBackTo) {
  std::string world;
  {
    Server server(Arguments());
    const std::string id = Save(server, "bench");
    ASSERT_NE(id, "");
    const json all = List(server);
    ASSERT_FALSE(all.empty());
    for (const json& map : all) {
      if (map["id"] == id) world = map["world"];
    }
    EXPECT_NE(world, id) << "a copy";
    End(server);
  }
  {
    Server server(Arguments());
    EXPECT_THAT(server.process().err(), HasSubstr("map " + world + " is looked for"));
    // The same map, not another: what is kept of it has the same world.
    ASSERT_NE(Save(server, "again"), "");
    const json all = List(server);
    EXPECT_EQ(all.size(), 3U) << all.dump(2);
    for (const json& map : all) EXPECT_EQ(map["world"], world) << all.dump(2);

    EXPECT_EQ(Saccade(server, {"maps", "load", "bench"}).exit_code, 0);
    EXPECT_THAT(Saccade(server, {"maps", "load", "cellar"}).err,
                HasSubstr("there is no map cellar"));
    EXPECT_EQ(Saccade(server, {"maps", "delete", "again"}).exit_code, 0);
    EXPECT_EQ(List(server).size(), 2U);
    GoesOutAndComesIn(server);
    EXPECT_THAT(Saccade(server, {"maps", "list"}).out, HasSubstr("(kept by itself)"));
    End(server);
  }
  {
    Server server(Arguments({"--map", "none"}));
    EXPECT_THAT(Saccade(server, {"maps", "list"}).err, HasSubstr("--map none"));
    End(server);
  }
}

}  // namespace
}  // namespace saccade::testing::maps_test
