#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/integration/attack/socket.hpp"
#include "tests/integration/support/process.hpp"

namespace saccade::testing {

/// What one process holds.
struct Vitals {
  long rss_kib = 0;
  int descriptors = 0;
  int threads = 0;
};
Vitals ReadVitals(pid_t pid);

struct TargetOptions {
  std::string source = "sim:desk?motion=sway&width=320&height=240&supersampling=1";
  std::string mount = "none";
  int descriptors = 1024;   // RLIMIT_NOFILE, soft and hard
  std::string data_dir;     // empty: a temporary one
  std::string stderr_file;  // empty: collected
};

/// The argv that starts saccade-server under those limits, on free ports of 127.0.0.1.
std::vector<std::string> LimitedServer(const TargetOptions& options, const std::string& data_dir);

/// The server under attack, up and ready. Aborts the test program if it does not come up.
class Target {
 public:
  explicit Target(const TargetOptions& options = {});

  int grpc_port() const { return grpc_port_; }
  int http_port() const { return http_port_; }
  pid_t pid() const { return process_.pid(); }
  Process& process() { return process_; }
  Vitals vitals() const { return ReadVitals(pid()); }

  /// A connection of its own, not shared with anybody in this process.
  std::shared_ptr<grpc::Channel> NewChannel() const;
  /// Any thread.
  bool Alive();
  /// How it ended, in words.
  std::string Obituary();
  /// "" if Ping is answered over gRPC and over HTTP and a page is served, each within `limit`.
  std::string Unwell(milliseconds limit = seconds(1));

 private:
  TemporaryFolder folder_;
  Process process_;
  std::mutex mutex_;
  int grpc_port_ = 0, http_port_ = 0;
};

/// The most memory the server holds while this one lives.
class PeakMemory {
 public:
  explicit PeakMemory(pid_t pid);
  ~PeakMemory() { kib(); }
  /// Ends the watch.
  long kib();

 private:
  long peak_kib_ = 0;
  std::jthread thread_;
};

}  // namespace saccade::testing
