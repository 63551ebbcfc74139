#include "tests/integration/support/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

namespace saccade::testing {
namespace {

using Clock = std::chrono::steady_clock;

[[noreturn]] void Abort(const std::string& problem) {
  std::fprintf(stderr, "%s\n", problem.c_str());
  std::abort();
}

[[noreturn]] void ExecChild(const std::vector<std::string>& argv,
                            const std::vector<std::string>& environment, int out, int err) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  for (const std::string& entry : environment) putenv(const_cast<char*>(entry.c_str()));
  std::vector<char*> arguments;
  for (const std::string& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  execv(arguments[0], arguments.data());
  std::perror(arguments[0]);
  _exit(127);
}

}  // namespace

Process::Process(const std::vector<std::string>& argv,
                 const std::vector<std::string>& extra_environment) {
  int out[2], err[2];
  if (pipe2(out, O_CLOEXEC) != 0 || pipe2(err, O_CLOEXEC) != 0) Abort("pipe failed");
  pid_ = fork();
  if (pid_ < 0) Abort("fork failed");
  if (pid_ == 0) ExecChild(argv, extra_environment, out[1], err[1]);
  close(out[1]);
  close(err[1]);
  out_.read_fd = out[0];
  err_.read_fd = err[0];
  drain_ = std::thread([this] { Drain(); });
}

Process::~Process() {
  if (!exit_code_) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  drain_.join();
  close(out_.read_fd);
  close(err_.read_fd);
}

// Both pipes until the child (and whoever inherited them) closed them.
void Process::Drain() {
  while (!out_.ended || !err_.ended) {
    pollfd fds[2] = {{out_.ended ? -1 : out_.read_fd, POLLIN, 0},
                     {err_.ended ? -1 : err_.read_fd, POLLIN, 0}};
    poll(fds, 2, -1);
    Pipe* const pipes[2] = {&out_, &err_};
    for (int i = 0; i < 2; ++i) {
      if (fds[i].revents == 0) continue;
      char buffer[4096];
      const ssize_t count = read(pipes[i]->read_fd, buffer, sizeof buffer);
      const std::lock_guard lock(mutex_);
      if (count > 0) pipes[i]->text.append(buffer, static_cast<std::size_t>(count));
      if (count <= 0) pipes[i]->ended = true;
    }
  }
}

void Process::Signal(int signal) const { kill(pid_, signal); }

std::optional<int> Process::Wait(std::chrono::milliseconds limit) {
  const auto end = Clock::now() + limit;
  while (!exit_code_) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    } else if (Clock::now() >= end) {
      return std::nullopt;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  return exit_code_;
}

std::optional<std::string> Process::WaitForLine(const std::string& text,
                                                std::chrono::milliseconds limit) {
  const auto end = Clock::now() + limit;
  for (;;) {
    bool ended = false;
    {
      const std::lock_guard lock(mutex_);
      const auto at = out_.text.find(text);
      const auto newline = at == std::string::npos ? at : out_.text.find('\n', at);
      if (newline != std::string::npos) {
        const auto previous = out_.text.rfind('\n', at);
        const auto begin = previous == std::string::npos ? 0 : previous + 1;
        return out_.text.substr(begin, newline - begin);
      }
      ended = out_.ended;
    }
    if (ended || Clock::now() >= end) return std::nullopt;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

void Process::WaitForEnd(std::chrono::milliseconds limit) {
  for (const auto end = Clock::now() + limit; Clock::now() < end;) {
    {
      const std::lock_guard lock(mutex_);
      if (out_.ended && err_.ended) return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

std::string Process::out() const {
  const std::lock_guard lock(mutex_);
  return out_.text;
}
std::string Process::err() const {
  const std::lock_guard lock(mutex_);
  return err_.text;
}

RunResult RunProgram(const std::vector<std::string>& argv, std::chrono::milliseconds limit,
                     const std::vector<std::string>& extra_environment) {
  Process process(argv, extra_environment);
  const std::optional<int> code = process.Wait(limit);
  if (!code) process.Signal(SIGKILL);
  process.WaitForEnd(std::chrono::seconds(2));
  return {code.value_or(-1), process.out(), process.err()};
}

TemporaryFolder::TemporaryFolder() {
  std::string pattern = std::filesystem::temp_directory_path() / "saccade-test-XXXXXX";
  if (mkdtemp(pattern.data()) == nullptr) Abort("mkdtemp failed for " + pattern);
  path_ = pattern;
}
TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

Server::Server(const std::vector<std::string>& arguments, std::chrono::milliseconds limit) {
  std::vector<std::string> argv = {SACCADE_SERVER_PROGRAM};
  for (const char* option : {"--grpc", "--http"}) {
    if (std::find(arguments.begin(), arguments.end(), option) == arguments.end()) {
      argv.insert(argv.end(), {option, "127.0.0.1:0"});
    }
  }
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  process_ = std::make_unique<Process>(argv);
  const std::optional<std::string> line = process_->WaitForLine("\"ready\"", limit);
  if (!line) Abort("saccade-server is not ready; it said: " + process_->out() + process_->err());
  const nlohmann::json ready = nlohmann::json::parse(*line);
  grpc_ = ready.at("grpc");
  http_ = ready.at("http");
}

}  // namespace saccade::testing
