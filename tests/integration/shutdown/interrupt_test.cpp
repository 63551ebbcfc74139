// SIGINT ends `saccade` and `saccade-eval` within two seconds, a second one at once.
#include <absl/strings/str_format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <thread>

#include "tests/integration/support/process.hpp"
#include "tests/integration/support/small_dataset.hpp"

namespace saccade::testing::interrupt_test {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr int kEnded = 130;  // also what a shell reports of a process that SIGINT ended

class Interrupt : public ::testing::Test {
 protected:
  void SetUp() override { WriteSmallDataset(folder_ / "set", {.frames = 90}); }
  static void ExpectEnds(Process& process, double within_s, int code) {
    const Clock::time_point begin = Clock::now();
    process.Signal(SIGINT);
    const std::optional<int> ended = process.Wait(milliseconds(10'000));
    const double took = std::chrono::duration<double>(Clock::now() - begin).count();
    EXPECT_EQ(ended, code) << process.err();
    EXPECT_LT(took, within_s);
  }
  Server ServeCrop() const {
    return Server({"--source", "dataset:" + (folder_ / "set"), "--mount", "crop:160x120",
                   "--data-dir", folder_ / "data"});
  }
  Process Fixate(Server& server) const {
    return Process({SACCADE_PROGRAM, "--server", server.grpc(), "fixate", "--point", "0,0,1"},
                   {"XDG_STATE_HOME=" + (folder_ / "state")});
  }
  TemporaryFolder folder_;
};

TEST_F(Interrupt, Watch) {
  Server server = ServeCrop();
  Process watch({SACCADE_PROGRAM, "--server", server.grpc(), "watch"});
  ASSERT_TRUE(watch.WaitForLine("frame", std::chrono::seconds(10)));
  server.process().Signal(SIGSTOP);
  ExpectEnds(watch, 2.0, kEnded);
  server.process().Signal(SIGCONT);
}

TEST_F(Interrupt, FixateLetsGoAndEnds) {
  Server server = ServeCrop();
  Process fixate = Fixate(server);
  ASSERT_TRUE(fixate.WaitForLine("", std::chrono::seconds(10))) << fixate.err();
  ExpectEnds(fixate, 2.0, 0);
}

TEST_F(Interrupt, FixateOnAServerThatDoesNotAnswer) {
  Server server = ServeCrop();
  {
    Process fixate = Fixate(server);
    ASSERT_TRUE(fixate.WaitForLine("", std::chrono::seconds(10))) << fixate.err();
    server.process().Signal(SIGSTOP);
    std::this_thread::sleep_for(milliseconds(300));
    ExpectEnds(fixate, 2.0, kEnded);
    server.process().Signal(SIGCONT);
  }
  std::this_thread::sleep_for(milliseconds(800));  // its lease is gone
  Process fixate = Fixate(server);
  ASSERT_TRUE(fixate.WaitForLine("", std::chrono::seconds(10))) << fixate.err();
  server.process().Signal(SIGSTOP);
  std::this_thread::sleep_for(milliseconds(300));
  fixate.Signal(SIGINT);
  std::this_thread::sleep_for(milliseconds(200));
  ExpectEnds(fixate, 0.5, kEnded);
  server.process().Signal(SIGCONT);
}

TEST_F(Interrupt, EvalRunAndSim) {
  Process sim({SACCADE_EVAL_PROGRAM, "sim", "--scenario", "desk", "--out", folder_ / "sim"});
  std::this_thread::sleep_for(milliseconds(1500));
  ExpectEnds(sim, 2.0, kEnded);
  Process run(
      {SACCADE_EVAL_PROGRAM, "run", "--dataset", folder_ / "set", "--out", folder_ / "run"});
  std::this_thread::sleep_for(milliseconds(60));
  const std::optional<int> done = run.Wait(milliseconds(0));
  if (!done) ExpectEnds(run, 2.0, kEnded);
}

/// Started as by a shell in the background or a supervisor that blocks signals, on stamps with
/// gaps.
TEST_F(Interrupt, EvalRunOnGapsInTimeAlsoWhereSignalsWereBlockedAndIgnored) {
  std::ofstream list(folder_ / "set/rgb.txt");
  for (int i = 0; i < 90; ++i) {  // every third picture comes a day later
    list << 86'400 * (i / 3) << "." << 100 * (i % 3)
         << absl::StrFormat(" rgb/%.6f.png\n", i / 30.0);
  }
  list.close();
  Process plain(
      {SACCADE_EVAL_PROGRAM, "run", "--dataset", folder_ / "set", "--out", folder_ / "plain"});
  EXPECT_EQ(plain.Wait(std::chrono::seconds(60)), 0) << plain.err();  // before: bad_alloc, or hours
  sigset_t blocked, old;
  sigemptyset(&blocked);
  for (const int number : {SIGINT, SIGTERM}) sigaddset(&blocked, number);
  pthread_sigmask(SIG_BLOCK, &blocked, &old);
  signal(SIGINT, SIG_IGN);
  Process sim({SACCADE_EVAL_PROGRAM, "sim", "--scenario", "desk", "--out", folder_ / "sim"});
  signal(SIGINT, SIG_DFL);
  pthread_sigmask(SIG_SETMASK, &old, nullptr);
  std::this_thread::sleep_for(milliseconds(1500));
  ExpectEnds(sim, 2.0, kEnded);
}

TEST_F(Interrupt, NumbersThatAreNoneAreRefused) {
  for (const std::string number : {"nan", "inf", "-1", "0", "1e30", "ten"}) {
    EXPECT_EQ(RunProgram({SACCADE_PROGRAM, "watch", "--for", number}).exit_code, 2) << number;
    EXPECT_EQ(RunProgram({SACCADE_PROGRAM, "--timeout", number, "status"}).exit_code, 2) << number;
    EXPECT_EQ(
        RunProgram({SACCADE_PROGRAM, "fixate", "--point", "0,0,1", "--for", number}).exit_code, 2)
        << number;
    EXPECT_EQ(RunProgram({SACCADE_PROGRAM, "annotate", "--point", "0,0,1", "--size",
                          number == "1e30" ? "11" : number})
                  .exit_code,
              2)
        << number;
    EXPECT_EQ(RunProgram({SACCADE_EVAL_PROGRAM, "sim", "--scenario", "points", "--out",
                          folder_ / "out", "--duration", number})
                  .exit_code,
              2)
        << number;
  }
  for (const std::string runs : {"-1", "0", "1.5", "nan", "1000000000000"}) {
    EXPECT_EQ(RunProgram({SACCADE_EVAL_PROGRAM, "sim", "--scenario", "points", "--out",
                          folder_ / "out", "--runs", runs})
                  .exit_code,
              2)
        << runs;
  }
  EXPECT_EQ(RunProgram({SACCADE_EVAL_PROGRAM, "sim", "--scenario", "points", "--out",
                        folder_ / "out", "--seed", "-1"})
                .exit_code,
            2);
}

}  // namespace
}  // namespace saccade::testing::interrupt_test
