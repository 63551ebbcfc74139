#include "tests/integration/attack/target.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/integration/attack/calls.hpp"

namespace saccade::testing {
namespace {

int PortOf(std::string address) {
  while (!address.empty() && address.back() == '/') address.pop_back();
  return std::stoi(address.substr(address.rfind(':') + 1));
}

}  // namespace

Vitals ReadVitals(pid_t pid) {
  Vitals vitals;
  const std::string folder = "/proc/" + std::to_string(pid);
  std::ifstream status(folder + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmRSS:", 0) == 0) vitals.rss_kib = std::atol(line.c_str() + 6);
    if (line.rfind("Threads:", 0) == 0) vitals.threads = std::atoi(line.c_str() + 8);
  }
  std::error_code error;
  for (std::filesystem::directory_iterator it(folder + "/fd", error), end; !error && it != end;
       it.increment(error)) {
    ++vitals.descriptors;
  }
  return vitals;
}

std::vector<std::string> LimitedServer(const TargetOptions& options, const std::string& data_dir) {
  std::string script = "ulimit -n " + std::to_string(options.descriptors) + "; exec \"$0\" \"$@\"";
  if (!options.stderr_file.empty()) script += " 2>'" + options.stderr_file + "'";
  return {"/bin/sh",    "-c",          script,   SACCADE_SERVER_PROGRAM, "--source", options.source,
          "--mount",    options.mount, "--grpc", "127.0.0.1:0",          "--http",   "127.0.0.1:0",
          "--data-dir", data_dir};
}

Target::Target(const TargetOptions& options)
    : process_(
          LimitedServer(options, options.data_dir.empty() ? folder_ / "data" : options.data_dir)) {
  const std::optional<std::string> line = process_.WaitForLine("\"ready\"", seconds(90));
  if (!line) {
    std::fprintf(stderr, "saccade-server is not ready; it said: %s%s\n", process_.out().c_str(),
                 process_.err().c_str());
    std::abort();
  }
  const nlohmann::json ready = nlohmann::json::parse(*line);
  grpc_port_ = PortOf(ready.at("grpc"));
  http_port_ = PortOf(ready.at("http"));
}

std::shared_ptr<grpc::Channel> Target::NewChannel() const {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 200);
  return grpc::CreateCustomChannel("127.0.0.1:" + std::to_string(grpc_port_),
                                   grpc::InsecureChannelCredentials(), arguments);
}

bool Target::Alive() {
  const std::lock_guard lock(mutex_);
  return !process_.Wait(milliseconds(0)).has_value();
}

std::string Target::Obituary() {
  const std::lock_guard lock(mutex_);
  const std::optional<int> code = process_.Wait(milliseconds(500));
  if (!code) return "the server is alive";
  const std::string words = process_.err();
  const std::size_t from = words.size() > 600 ? words.size() - 600 : 0;
  return "THE SERVER IS DEAD, exit code " + std::to_string(*code) +
         "; its last words: " + words.substr(from);
}

std::string Target::Unwell(milliseconds limit) {
  if (!Alive()) return Obituary();
  const std::string ping = "/saccade.v1.SessionService/Ping";
  const RawReply reply = Call(NewChannel(), ping, "", limit);
  if (!reply.status.ok()) return "Ping over gRPC: " + reply.status.error_message();
  std::string answer = AnswerTo(http_port_, GrpcWebCall(http_port_, ping, ""), limit);
  if (answer != "200") return "Ping over HTTP: " + answer;
  answer = AnswerTo(http_port_, HttpHead(http_port_, "GET", "/"), limit);
  return answer == "200" ? "" : "the page: " + answer;
}

PeakMemory::PeakMemory(pid_t pid) {
  thread_ = std::jthread([this, pid](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      peak_kib_ = std::max(peak_kib_, ReadVitals(pid).rss_kib);
      std::this_thread::sleep_for(milliseconds(20));
    }
  });
}

long PeakMemory::kib() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  return peak_kib_;
}

}  // namespace saccade::testing
