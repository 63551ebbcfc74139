#pragma once

#include <sys/types.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace saccade::testing {

/// A child process with its output collected. It dies with the test, and with this object.
class Process {
 public:
  /// `argv[0]` is the program's path. Aborts the test program if it cannot be started.
  explicit Process(const std::vector<std::string>& argv,
                   const std::vector<std::string>& extra_environment = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  void Signal(int signal) const;
  /// Exit code, or 128 + signal; nothing if it still runs after `limit`.
  std::optional<int> Wait(std::chrono::milliseconds limit);
  /// First line of stdout that contains `text`; nothing if it ended or `limit` passed before.
  std::optional<std::string> WaitForLine(const std::string& text, std::chrono::milliseconds limit);

  /// Until both streams are read to their end; they end with the process and its children.
  void WaitForEnd(std::chrono::milliseconds limit);

  std::string out() const;
  std::string err() const;

 private:
  struct Pipe {
    int read_fd = -1;
    std::string text;
    bool ended = false;
  };
  void Drain();

  pid_t pid_ = -1;
  std::optional<int> exit_code_;
  mutable std::mutex mutex_;
  Pipe out_, err_;
  std::thread drain_;
};

struct RunResult {
  int exit_code = -1;
  std::string out, err;
};
/// Runs a program to its end; exit code -1 if it took longer than `limit` (it is killed then).
RunResult RunProgram(const std::vector<std::string>& argv,
                     std::chrono::milliseconds limit = std::chrono::seconds(20),
                     const std::vector<std::string>& extra_environment = {});

/// A folder below the system's temporary one; removed with everything in it.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

/// saccade-server on free ports of 127.0.0.1, up and ready.
class Server {
 public:
  /// `arguments` without --grpc and --http, which are chosen here unless given. Aborts the test
  /// with the server's own words if it is not ready within `limit`.
  explicit Server(const std::vector<std::string>& arguments,
                  std::chrono::milliseconds limit = std::chrono::seconds(30));

  const std::string& grpc() const { return grpc_; }
  const std::string& http() const { return http_; }
  Process& process() { return *process_; }

 private:
  std::unique_ptr<Process> process_;
  std::string grpc_, http_;
};

}  // namespace saccade::testing
