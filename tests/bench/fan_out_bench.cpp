// How many subscribers one core serves: the server in a process of its own, pinned to one core,
// over loopback sockets; the subscribers on the others.
//   fan-out-bench [--subscribers 50,100,200,300,400] [--seconds 5] [--core 0]
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <thread>

#include "tests/bench/fan_out_client.hpp"
#include "tests/integration/stream/in_process_server.hpp"
#include "tests/integration/support/process.hpp"

namespace saccade {
namespace {

struct Arguments {
  std::vector<int> subscribers = {50, 100, 200, 300, 400};
  double seconds = 5;
  int core = 0;
  int features = 60;
  bool serve = false;
};

void Pin(bool only, int core) {
  cpu_set_t set;
  CPU_ZERO(&set);
  const int cores = static_cast<int>(std::thread::hardware_concurrency());
  for (int i = 0; i < cores; ++i) {
    if ((i == core) == only) CPU_SET(i, &set);
  }
  if (CPU_COUNT(&set) > 0) sched_setaffinity(0, sizeof(set), &set);
}

/// The server's process: until its standard input ends.
int Serve(const Arguments& arguments) {
  Pin(true, arguments.core);
  testing::InProcessOptions options;
  options.width = 640;
  options.height = 480;
  options.lively_features = arguments.features;
  testing::InProcessServer server(options);
  std::printf("ready %s\n", server.address().c_str());
  std::fflush(stdout);
  std::this_thread::sleep_for(std::chrono::minutes(10));
  return 0;
}

/// Processor time that a process has had so far [s].
double CpuSeconds(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text;
  std::getline(file, text);
  std::istringstream fields(text.substr(text.rfind(')') + 2));
  std::string skipped;
  for (int i = 0; i < 11; ++i) fields >> skipped;
  double user = 0, system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

double OwnCpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

struct Spread {
  double least = 0, median = 0, most = 0;
};
template <typename Of>
Spread SpreadOf(const std::vector<FanOutCounts>& counts, double seconds, Of of) {
  std::vector<double> rates;
  for (const FanOutCounts& one : counts) rates.push_back(static_cast<double>(of(one)) / seconds);
  std::sort(rates.begin(), rates.end());
  return {rates.front(), rates[rates.size() / 2], rates.back()};
}

void Measure(const Arguments& arguments, int subscribers) {
  testing::Process server({"/proc/self/exe", "--serve", "--core", std::to_string(arguments.core),
                           "--features", std::to_string(arguments.features)});
  const auto ready = server.WaitForLine("ready", std::chrono::seconds(20));
  if (!ready) {
    std::fprintf(stderr, "%s\n", server.err().c_str());
    std::exit(1);
  }
  FanOutClients clients(ready->substr(6), subscribers);
  std::this_thread::sleep_for(std::chrono::seconds(2));
  clients.Reset();
  const double server_cpu = CpuSeconds(server.pid()), own_cpu = OwnCpuSeconds();
  const auto begin = std::chrono::steady_clock::now();
  std::this_thread::sleep_for(std::chrono::duration<double>(arguments.seconds));
  const std::vector<FanOutCounts> counts = clients.counts();
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double server_share = (CpuSeconds(server.pid()) - server_cpu) / seconds;
  const double own_share = (OwnCpuSeconds() - own_cpu) / seconds;
  const Spread pictures = SpreadOf(counts, seconds, [](const auto& one) { return one.pictures; });
  const Spread poses = SpreadOf(counts, seconds, [](const auto& one) { return one.poses; });
  std::uint64_t skipped = 0, bytes = 0, ended = 0;
  for (const FanOutCounts& one : counts) {
    skipped += one.skipped;
    bytes += one.bytes;
    ended += one.ended ? 1 : 0;
  }
  std::printf("%11d %8.1f %7.1f %7.1f %9llu %7.1f %7.1f %9.1f %10.2f %10.2f %6llu\n", subscribers,
              pictures.least, pictures.median, pictures.most,
              static_cast<unsigned long long>(skipped), poses.least, poses.median,
              1e-6 * static_cast<double>(bytes) / seconds, server_share, own_share,
              static_cast<unsigned long long>(ended));
  std::fflush(stdout);
}

int Main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("How many subscribers one core serves.", "fan-out-bench");
  app.add_option("--subscribers", arguments.subscribers, "Numbers of subscribers")
      ->delimiter(',')
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--seconds", arguments.seconds, "How long each is measured, after 2 s")
      ->check(CLI::Range(1, 60))
      ->capture_default_str();
  app.add_option("--core", arguments.core, "Of the server; the subscribers take the others")
      ->capture_default_str();
  app.add_option("--features", arguments.features, "Features that change in each frame")
      ->capture_default_str();
  app.add_flag("--serve", arguments.serve, "Be the server (used by itself)");
  CLI11_PARSE(app, argc, argv);
  if (arguments.serve) return Serve(arguments);
  Pin(false, arguments.core);
  std::printf("%11s %24s %9s %15s %9s %10s %10s %6s\n", "", "video [Hz]", "frames", "pose [Hz]", "",
              "server", "clients", "");
  std::printf("%11s %8s %7s %7s %9s %7s %7s %9s %10s %10s %6s\n", "subscribers", "min", "median",
              "max", "skipped", "min", "median", "MB/s", "[cores]", "[cores]", "ended");
  for (const int subscribers : arguments.subscribers) Measure(arguments, subscribers);
  return 0;
}

}  // namespace
}  // namespace saccade

int main(int argc, char** argv) { return saccade::Main(argc, argv); }
