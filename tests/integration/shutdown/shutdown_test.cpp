// A signal ends saccade-server within two seconds, with exit code 0 and everything kept, whatever
// it is doing.
#include <absl/strings/str_format.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <thread>

#include "client/net/connection.hpp"
#include "tests/integration/support/process.hpp"
#include "tests/integration/support/small_dataset.hpp"

namespace saccade::testing::shutdown_test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr milliseconds kLimit(2000);

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

class ShutdownTest : public ::testing::Test {
 protected:
  void SetUp() override { WriteSmallDataset(folder_ / "set", {.frames = 60}); }
  std::vector<std::string> Arguments(const std::string& data = "data") const {
    return {"--source", "dataset:" + (folder_ / "set"), "--data-dir", folder_ / data};
  }
  std::unique_ptr<net::Connection> Connect(Server& server) {
    auto connection = net::Connection::Create({.server = server.grpc(), .session_id = ""});
    EXPECT_TRUE(connection.ok()) << connection.status();
    return *std::move(connection);
  }
  static AnnotationDraft Draft() {
    AnnotationDraft draft;
    draft.text = "kept";
    draft.target = PointTarget{{0, 0, 1}};
    return draft;
  }
  /// Whether main has begun: from then on the signals are its own, before they are the system's.
  static bool Listens(const Process& process) {
    std::ifstream status("/proc/" + std::to_string(process.pid()) + "/status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("SigBlk:")) {
        return (std::stoull(line.substr(7), nullptr, 16) >> (SIGTERM - 1) & 1) != 0;
      }
    }
    return false;
  }
  static void WaitUntilItListens(const Process& process) {
    for (int i = 0; i < 4000 && !Listens(process); ++i) {
      std::this_thread::sleep_for(milliseconds(5));
    }
    ASSERT_TRUE(Listens(process));
  }
  /// Ends it with `signal` and says how long that took. The exit code must be 0, unless main had
  /// not begun.
  static double End(Process& process, int signal) {
    const bool listened = Listens(process);
    const Clock::time_point begin = Clock::now();
    process.Signal(signal);
    const std::optional<int> code = process.Wait(milliseconds(10'000));
    const double took = SecondsSince(begin);
    EXPECT_TRUE(code == 0 || (!listened && code == 128 + signal))
        << code.value_or(-1) << ": " << process.err();
    return took;
  }
  TemporaryFolder folder_;
};

/// Stops one thread of another process, as a frame that takes minutes would. Everything on the
/// thread that made it.
class HeldThread {
 public:
  HeldThread(pid_t process, const std::string& name) {
    for (const auto& task : fs::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
      std::string comm;
      std::getline(std::ifstream(task.path() / "comm") >> std::ws, comm);
      if (comm == name) thread_ = std::stoi(task.path().filename());
    }
    if (thread_ == 0) return;
    held_ = ptrace(PTRACE_SEIZE, thread_, nullptr, nullptr) == 0 &&
            ptrace(PTRACE_INTERRUPT, thread_, nullptr, nullptr) == 0 &&
            waitpid(thread_, nullptr, __WALL) == thread_;
  }
  bool found() const { return thread_ != 0; }
  bool held() const { return held_; }
  /// The process is not gone before its held thread was asked for.
  std::optional<int> Wait(Process& process, milliseconds limit) const {
    for (const auto end = Clock::now() + limit; Clock::now() < end;) {
      waitpid(thread_, nullptr, __WALL | WNOHANG);
      if (const std::optional<int> code = process.Wait(milliseconds(5))) return code;
    }
    return std::nullopt;
  }

 private:
  pid_t thread_ = 0;
  bool held_ = false;
};

TEST_F(ShutdownTest, WhileTheNextFrameIsNotDueForLong) {
  std::ofstream(folder_ / "set/rgb.txt") << "0 rgb/0.000000.png\n30 rgb/0.033333.png\n";
  for (const int signal : {SIGTERM, SIGINT}) {
    Server server(Arguments());
    std::this_thread::sleep_for(milliseconds(200));
    EXPECT_LT(End(server.process(), signal), 2.0);
    EXPECT_EQ(server.process().err().find("left"), std::string::npos)
        << "in order: " << server.process().err();
  }
}

TEST_F(ShutdownTest, OnStampsThatAreAYearApart) {
  std::ofstream list(folder_ / "set/rgb.txt");
  for (int i = 0; i < 60; ++i) {  // every tenth picture: nothing grows with the gap
    list << 31'536'000LL * (i / 10) << ".0" << i % 10
         << absl::StrFormat(" rgb/%.6f.png\n", i / 30.0);
  }
  list.close();
  for (const bool every_frame : {true, false}) {
    std::vector<std::string> arguments = Arguments();
    if (every_frame) arguments.insert(arguments.end(), {"--speed", "max"});
    Server server(arguments);
    std::this_thread::sleep_for(milliseconds(600));
    EXPECT_LT(End(server.process(), SIGINT), 2.0);
    EXPECT_EQ(server.process().err().find("left without"), std::string::npos)
        << "in order: " << server.process().err();
    EXPECT_THAT(server.process().err(), HasSubstr("rgb.txt:11: a pause of 3.1536e+07 s"));
  }
}

TEST_F(ShutdownTest, WhileAFrameTakesMinutes) {
  std::string id;
  {
    Server server(Arguments());
    const auto connection = Connect(server);
    absl::StatusOr<Annotation> created = absl::UnavailableError("not tried");
    for (int i = 0; i < 100 && !created.ok(); ++i) {
      created = connection->CreateAnnotation(Draft());
      if (!created.ok()) std::this_thread::sleep_for(milliseconds(50));
    }
    ASSERT_TRUE(created.ok()) << created.status();
    id = created->id;
    const HeldThread tracker(server.process().pid(), "tracker");
    ASSERT_TRUE(tracker.found());
    if (!tracker.held()) GTEST_SKIP() << "may not stop a thread here (ptrace)";
    const Clock::time_point begin = Clock::now();
    server.process().Signal(SIGTERM);
    EXPECT_EQ(tracker.Wait(server.process(), milliseconds(10'000)), 0);
    const double took = SecondsSince(begin);
    std::printf("left %.2f s after SIGTERM\n", took);
    EXPECT_LT(took, 2.0);
    server.process().WaitForEnd(milliseconds(2000));
    EXPECT_THAT(server.process().err(), HasSubstr("left without waiting"));
    EXPECT_THAT(server.process().err(), HasSubstr("every accepted change is on disk"));
  }
  Server again(Arguments());
  const auto all = Connect(again)->ListAnnotations();
  ASSERT_TRUE(all.ok());
  ASSERT_EQ(all->size(), 1u);
  EXPECT_EQ(all->front().id, id);
}

TEST_F(ShutdownTest, ASecondSignalEndsItAtOnce) {
  Server server(Arguments());
  std::this_thread::sleep_for(milliseconds(200));
  const HeldThread tracker(server.process().pid(), "tracker");
  ASSERT_TRUE(tracker.found());
  if (!tracker.held()) GTEST_SKIP() << "may not stop a thread here (ptrace)";
  server.process().Signal(SIGINT);
  std::this_thread::sleep_for(milliseconds(200));
  const Clock::time_point begin = Clock::now();
  server.process().Signal(SIGINT);
  EXPECT_EQ(tracker.Wait(server.process(), milliseconds(10'000)), 0);
  EXPECT_LT(SecondsSince(begin), 0.8);
}

TEST_F(ShutdownTest, RunForEndsAlsoWhileAFrameTakesMinutes) {
  std::vector<std::string> arguments = Arguments();
  arguments.insert(arguments.end(), {"--run-for", "1.5"});
  Server server(arguments);
  const HeldThread tracker(server.process().pid(), "tracker");
  ASSERT_TRUE(tracker.found());
  if (!tracker.held()) GTEST_SKIP() << "may not stop a thread here (ptrace)";
  const Clock::time_point begin = Clock::now();
  EXPECT_EQ(tracker.Wait(server.process(), milliseconds(10'000)), 0);
  EXPECT_LT(SecondsSince(begin), 3.5);
}

/// A pipe with a name that nobody reads, full after `bytes`.
class UnreadPipe {
 public:
  explicit UnreadPipe(const std::string& path) : path_(path) {
    EXPECT_EQ(mkfifo(path.c_str(), 0600), 0);
    fd_ = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    fcntl(fd_, F_SETPIPE_SZ, 4096);
  }
  ~UnreadPipe() { close(fd_); }
  void Fill() const {
    const std::string page(4096, 'x');
    while (write(fd_, page.data(), page.size()) > 0) {
    }
  }
  std::string Read() const {
    std::string text(65536, '\0');
    const ssize_t count = read(fd_, text.data(), text.size());
    text.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
    return text;
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  int fd_ = -1;
};

TEST_F(ShutdownTest, WhileNobodyReadsStderrAndNoCallEverWaitsForIt) {
  const UnreadPipe err(folder_ / "err");
  std::string command = "exec " SACCADE_SERVER_PROGRAM " --grpc 127.0.0.1:0 --http 127.0.0.1:0";
  for (const std::string& argument : Arguments()) command += " '" + argument + "'";
  Process server({"/bin/sh", "-c", command + " 2>'" + err.path() + "'"});
  const auto ready = server.WaitForLine("\"ready\"", std::chrono::seconds(20));
  ASSERT_TRUE(ready);
  const auto at = ready->find("127.0.0.1:", ready->find("\"grpc\""));
  const std::string grpc = ready->substr(at, ready->find('"', at) - at);
  auto connection = net::Connection::Create({.server = grpc, .session_id = ""});
  ASSERT_TRUE(connection.ok());
  // 4 KiB fit; each of these says a line of 130 bytes. Before, the 30th waited for ever.
  double longest = 0;
  for (int i = 0; i < 500; ++i) {
    const Clock::time_point begin = Clock::now();
    const absl::Status status = (*connection)->DeleteAnnotation("none-" + std::to_string(i));
    longest = std::max(longest, SecondsSince(begin));
    ASSERT_NE(status.code(), absl::StatusCode::kDeadlineExceeded) << i;
    ASSERT_NE(status.code(), absl::StatusCode::kUnavailable) << i;
  }
  std::printf("longest of 500 calls: %.3f s\n", longest);
  EXPECT_LT(longest, 2.0);
  EXPECT_LT(End(server, SIGTERM), 2.0);
  EXPECT_THAT(err.Read(), HasSubstr("rpc "));
}

TEST_F(ShutdownTest, WhileNeitherStreamTakesALine) {
  const UnreadPipe out(folder_ / "out");
  out.Fill();
  std::string command = "exec " SACCADE_SERVER_PROGRAM " --grpc 127.0.0.1:0 --http 127.0.0.1:0";
  for (const std::string& argument : Arguments()) command += " '" + argument + "'";
  Process server({"/bin/sh", "-c", command + " >'" + out.path() + "' 2>&1"});
  WaitUntilItListens(server);
  std::this_thread::sleep_for(milliseconds(1500));
  EXPECT_LT(End(server, SIGTERM), 2.0);
}

TEST_F(ShutdownTest, DuringTheStart) {
  // Opening a pipe for writing waits for somebody who reads: here for ever.
  ASSERT_EQ(mkfifo((folder_ / "truth").c_str(), 0600), 0);
  for (const int signal : {SIGTERM, SIGINT}) {
    Process server({SACCADE_SERVER_PROGRAM, "--grpc", "127.0.0.1:0", "--http", "127.0.0.1:0",
                    "--source", "sim:desk", "--sim-truth", folder_ / "truth", "--data-dir",
                    folder_ / "data"});
    WaitUntilItListens(server);
    std::this_thread::sleep_for(milliseconds(300));
    EXPECT_LT(End(server, signal), 2.0);
    server.WaitForEnd(milliseconds(2000));
    EXPECT_THAT(server.err(), HasSubstr("opening the source"));
  }
  double longest = 0;
  for (int i = 0; i < 20; ++i) {
    std::vector<std::string> argv = Arguments();
    argv.insert(argv.begin(),
                {SACCADE_SERVER_PROGRAM, "--grpc", "127.0.0.1:0", "--http", "127.0.0.1:0"});
    Process server(argv);
    if (i >= 5) WaitUntilItListens(server);
    std::this_thread::sleep_for(milliseconds(1 + 41 * (i % 10)));
    longest = std::max(longest, End(server, i % 2 == 0 ? SIGTERM : SIGINT));
  }
  std::printf("longest of 20 ends during the start: %.2f s\n", longest);
  EXPECT_LT(longest, 2.0);
}

TEST_F(ShutdownTest, FilesDeletedWhileItRunsAreThereAfterAKill) {
  std::vector<std::string> kept;
  {
    Server server(Arguments());
    const auto connection = Connect(server);
    for (int i = 0; i < 100 && kept.size() < 4; ++i) {
      if (kept.size() == 3) fs::remove_all(folder_ / "data");
      const absl::StatusOr<Annotation> created = connection->CreateAnnotation(Draft());
      if (created.ok()) kept.push_back(created->id);
      if (!created.ok()) std::this_thread::sleep_for(milliseconds(50));
    }
    ASSERT_EQ(kept.size(), 4u);
    server.process().Signal(SIGKILL);
    server.process().Wait(milliseconds(5000));
    EXPECT_THAT(server.process().err(), HasSubstr("was deleted while this server ran"));
  }
  Server again(Arguments());
  const auto all = Connect(again)->ListAnnotations();
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->size(), 4u);
  EXPECT_EQ(fs::status(folder_ / "data").permissions(), fs::perms::owner_all);
}

}  // namespace
}  // namespace saccade::testing::shutdown_test
