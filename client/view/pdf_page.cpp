#include "client/view/pdf_page.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <vector>

extern char** environ;

namespace saccade::view {
namespace {

constexpr std::chrono::seconds kLimit(10);
constexpr int kSharpPx = 2000;                   // the small print can be read
constexpr std::size_t kMostPngBytes = 64 << 20;  // of a page's PNG
constexpr absl::string_view kRemedy = " cannot be run: install the package poppler-utils.";

struct Output {
  std::string out, err;
  int exit_code = -1;  // -1: it did not end by itself
};

struct Pipe {
  int read = -1, write = -1;
  bool Open() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return false;
    read = ends[0];
    write = ends[1];
    return true;
  }
  void CloseWrite() {
    if (write >= 0) ::close(write);
    write = -1;
  }
  ~Pipe() {
    CloseWrite();
    if (read >= 0) ::close(read);
  }
};

/// True while more may come.
bool ReadSome(int from, std::string& to) {
  std::array<char, 65536> bytes;
  const ssize_t count = ::read(from, bytes.data(), bytes.size());
  if (count > 0) to.append(bytes.data(), static_cast<std::size_t>(count));
  return count > 0 || (count < 0 && errno == EINTR);
}

/// Reads both until they end; false: too much, or too late.
bool ReadAll(const Pipe& out, const Pipe& err, Output& output) {
  const auto end = std::chrono::steady_clock::now() + kLimit;
  std::array<pollfd, 2> waiting = {pollfd{out.read, POLLIN, 0}, pollfd{err.read, POLLIN, 0}};
  while (waiting[0].fd >= 0 || waiting[1].fd >= 0) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    if (left.count() <= 0 || output.out.size() + output.err.size() > kMostPngBytes) return false;
    if (::poll(waiting.data(), waiting.size(), static_cast<int>(left.count())) < 0 &&
        errno != EINTR) {
      return false;
    }
    for (std::size_t i = 0; i < waiting.size(); ++i) {
      if (waiting[i].fd < 0 || waiting[i].revents == 0) continue;
      if (!ReadSome(waiting[i].fd, i == 0 ? output.out : output.err)) waiting[i].fd = -1;
    }
  }
  return true;
}

absl::StatusOr<Output> Run(std::vector<std::string> arguments) {
  Pipe out, err;
  if (!out.Open() || !err.Open()) return absl::ResourceExhaustedError("too many open files.");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, out.write, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.write, STDERR_FILENO);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return absl::FailedPreconditionError(absl::StrCat(arguments[0], kRemedy));
  out.CloseWrite();
  err.CloseWrite();
  Output output;
  const bool whole = ReadAll(out, err, output);
  if (!whole) ::kill(child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (whole && WIFEXITED(status)) output.exit_code = WEXITSTATUS(status);
  return output;
}

}  // namespace

absl::StatusOr<std::string> DrawPdfPage(const std::string& file, int page) {
  if (page < 1) return absl::InvalidArgumentError("pages count from 1.");
  // Absolute: a name that begins with a dash is no option then.
  const std::string path = std::filesystem::absolute(file);
  const std::string number = absl::StrCat(page);
  absl::StatusOr<Output> drawn = Run({"pdftoppm", "-png", "-singlefile", "-f", number, "-l", number,
                                      "-scale-to", absl::StrCat(kSharpPx), path});
  if (!drawn.ok()) return drawn.status();
  if (absl::StartsWith(drawn->out, "\x89PNG")) return std::move(drawn->out);
  if (drawn->exit_code < 0) {
    return absl::InvalidArgumentError(absl::StrCat(file, " is too much to draw."));
  }
  if (absl::StrContains(drawn->err, "Wrong page range")) {
    return absl::InvalidArgumentError(absl::StrCat(file, " has no page ", page, "."));
  }
  if (absl::StrContains(drawn->err, "assword")) {
    return absl::InvalidArgumentError(absl::StrCat(file, " asks for a password."));
  }
  return absl::InvalidArgumentError(absl::StrCat(file, " cannot be read as a PDF."));
}

}  // namespace saccade::view
