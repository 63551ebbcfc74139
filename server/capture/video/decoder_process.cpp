#include "server/capture/video/decoder_process.hpp"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr int kLookForStop_ms = 100;
constexpr std::chrono::milliseconds kMostBytesTake(5'000);
constexpr std::size_t kMostText = 4'000;
constexpr std::size_t kSkippedAtOnce = 1 << 16;
constexpr int kPipeBytes = 1 << 20;
constexpr std::size_t kMostAddressBytes = 4096;

absl::StatusOr<int> OpenVideoFile(const std::filesystem::path& file) {
  // Not to wait for whoever writes into a pipe.
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) {
    const std::string words = absl::StrCat(file.string(), ": ", std::strerror(errno),
                                           "; give a video file that may be read");
    if (errno == EMFILE || errno == ENFILE) return absl::ResourceExhaustedError(words);
    return errno == ENOENT ? absl::NotFoundError(words) : absl::PermissionDeniedError(words);
  }
  struct stat is {};
  if (fstat(descriptor, &is) == 0 && S_ISREG(is.st_mode)) return descriptor;
  close(descriptor);
  return absl::InvalidArgumentError(
      absl::StrCat(file.string(), ": is no regular file; give a video file"));
}

/// What is read there is `text`, and then it ends: for what nobody else is to see.
absl::StatusOr<int> Whispered(const std::string& text) {
  int ends[2] = {-1, -1};
  if (text.size() > kMostAddressBytes) {
    return absl::InvalidArgumentError(absl::StrCat("--source: an address of ", text.size(),
                                                   " bytes; at most ", kMostAddressBytes));
  }
  if (pipe2(ends, O_CLOEXEC) != 0) {
    return absl::ResourceExhaustedError(
        absl::StrCat("saccade-decode: no pipe to it (", std::strerror(errno), ")"));
  }
  const ssize_t written = write(ends[1], text.data(), text.size());  // fits into any pipe
  close(ends[1]);
  if (written == static_cast<ssize_t>(text.size())) return ends[0];
  close(ends[0]);
  return absl::InternalError("saccade-decode: its address could not be written");
}

std::filesystem::path DecoderProgram() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  return self.parent_path() / "saccade-decode";
}

/// posix_spawn with these three streams and no other descriptor. errno, or 0.
int Spawn(const std::filesystem::path& program, const std::vector<std::string>& words, int in,
          int out, pid_t* pid) {
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (in >= 0) {
    posix_spawn_file_actions_adddup2(&actions, in, STDIN_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  }
  posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, defaults;
  sigemptyset(&none);
  sigfillset(&defaults);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setpgroup(&attributes, 0);  // Ctrl-C is the parent's to hear
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  char* const no_environment[] = {nullptr};
  const int error =
      posix_spawn(pid, program.c_str(), &actions, &attributes, argv.data(), no_environment);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return error;
}

struct Spawned {
  pid_t pid = -1;
  int pipe = -1;  // what it writes
};

/// saccade-decode with `file` (-1: nothing) as its standard input.
absl::StatusOr<Spawned> SpawnDecoder(const std::vector<std::string>& words, int file) {
  const std::filesystem::path program = DecoderProgram();
  int ends[2] = {-1, -1};
  Spawned spawned;
  int error = pipe2(ends, O_CLOEXEC) == 0 ? 0 : errno;
  if (error == 0) {
    (void)fcntl(ends[1], F_SETPIPE_SZ, kPipeBytes);
    error = Spawn(program, words, file, ends[1], &spawned.pid);
    close(ends[1]);
    if (error != 0) close(ends[0]);
  }
  spawned.pipe = ends[0];
  if (error == 0) return spawned;
  const std::string text =
      absl::StrCat(program.string(), ": cannot be started (", std::strerror(error), ")");
  if (error == ENOENT) {
    return absl::NotFoundError(
        absl::StrCat(text, "; videos are decoded by it: install it beside this program"));
  }
  return absl::ResourceExhaustedError(text);
}

}  // namespace

absl::StatusOr<std::unique_ptr<DecoderProcess>> DecoderProcess::StartPackets(
    std::int64_t most_pixels) {
  int ends[2] = {-1, -1};
  // Not a pipe: to write to one that nobody reads any more is a signal.
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    return absl::ResourceExhaustedError(
        absl::StrCat("saccade-decode: no socket to it (", std::strerror(errno), ")"));
  }
  const absl::StatusOr<Spawned> spawned = SpawnDecoder(
      {"saccade-decode", "--packets", "--most-pixels", absl::StrCat(most_pixels)}, ends[1]);
  close(ends[1]);
  if (spawned.ok()) {
    return std::unique_ptr<DecoderProcess>(
        new DecoderProcess(spawned->pid, spawned->pipe, ends[0]));
  }
  close(ends[0]);
  return spawned.status();
}

absl::StatusOr<std::unique_ptr<DecoderProcess>> DecoderProcess::Start(const VideoInput& input,
                                                                      std::int64_t after_ns) {
  const bool stream = input.file.empty();
  const absl::StatusOr<int> in = stream ? Whispered(input.url) : OpenVideoFile(input.file);
  if (!in.ok()) return in.status();
  std::vector<std::string> words = {"saccade-decode", "--after", absl::StrCat(after_ns)};
  if (stream) words.emplace_back("--stream");
  const absl::StatusOr<Spawned> spawned = SpawnDecoder(words, *in);
  close(*in);
  if (!spawned.ok()) return spawned.status();
  return std::unique_ptr<DecoderProcess>(new DecoderProcess(spawned->pid, spawned->pipe, -1));
}

DecoderProcess::~DecoderProcess() {
  if (!reaped_) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  close(pipe_);
  if (input_ >= 0) close(input_);
}

absl::Status DecoderProcess::Death() {
  int status = 0;
  bool known = false;
  for (int i = 0; i < 100 && !known; ++i) {  // its pipe closes a little before it is gone
    known = waitpid(pid_, &status, WNOHANG) == pid_;
    if (!known) poll(nullptr, 0, 1);
  }
  const bool killed = known;  // by others, if at all
  if (!known) {               // it lives on with its pipe closed
    kill(pid_, SIGKILL);
    known = waitpid(pid_, &status, 0) == pid_;
  }
  reaped_ = true;
  const int signal = known && WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (killed && (signal == SIGKILL || signal == SIGTERM)) {
    return absl::AbortedError(absl::StrCat("the decoder was killed by signal ", signal));
  }
  if (known && WIFSIGNALED(status)) {
    return absl::UnavailableError(absl::StrCat("the decoder died of signal ", WTERMSIG(status)));
  }
  return absl::UnavailableError(
      absl::StrCat("the decoder ended with ", known ? WEXITSTATUS(status) : -1));
}

absl::Status DecoderProcess::Read(void* out, std::size_t size, const std::function<bool()>& stopped,
                                  std::chrono::milliseconds most) {
  char* at = static_cast<char*>(out);
  const auto end = std::chrono::steady_clock::now() + most;
  while (size > 0) {
    pollfd wait_for{pipe_, POLLIN, 0};
    const int ready = poll(&wait_for, 1, kLookForStop_ms);
    if (stopped()) return absl::CancelledError("");
    // Also while a little comes now and then: nobody may hold this thread so.
    if (std::chrono::steady_clock::now() > end) {
      return absl::DeadlineExceededError("the decoder has not answered for too long");
    }
    if (ready <= 0) continue;
    const ssize_t got = read(pipe_, at, size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return Death();
    at += got;
    size -= static_cast<std::size_t>(got);
  }
  return absl::OkStatus();
}

absl::Status DecoderProcess::Write(const void* data, std::size_t size,
                                   const std::function<bool()>& stopped,
                                   std::chrono::milliseconds most) {
  const char* at = static_cast<const char*>(data);
  const auto end = std::chrono::steady_clock::now() + most;
  while (size > 0) {
    pollfd wait_for{input_, POLLOUT, 0};
    const int ready = poll(&wait_for, 1, kLookForStop_ms);
    if (stopped()) return absl::CancelledError("");
    if (std::chrono::steady_clock::now() > end) {
      return absl::DeadlineExceededError("the decoder has not taken its input for too long");
    }
    if (ready <= 0) continue;
    const ssize_t sent = send(input_, at, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (sent <= 0) return Death();
    at += sent;
    size -= static_cast<std::size_t>(sent);
  }
  return absl::OkStatus();
}

absl::StatusOr<DecodeHeader> DecoderProcess::ReadHeader(const std::function<bool()>& stopped,
                                                        std::chrono::milliseconds most) {
  DecodeHeader header;
  if (absl::Status read = Read(&header, sizeof header, stopped, most); !read.ok()) return read;
  if (header.magic != DecodeHeader::kMagic) {
    return absl::UnavailableError("the decoder writes nonsense; is it of this version?");
  }
  return header;
}

absl::Status DecoderProcess::ReadBytes(void* out, std::size_t size,
                                       const std::function<bool()>& stopped) {
  return Read(out, size, stopped, kMostBytesTake);
}

absl::Status DecoderProcess::SkipBytes(std::size_t size, const std::function<bool()>& stopped) {
  const auto end = std::chrono::steady_clock::now() + kMostBytesTake;
  std::vector<char> part(std::min(size, kSkippedAtOnce));
  while (size > 0) {
    const std::size_t next = std::min(size, part.size());
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    if (absl::Status read = Read(part.data(), next, stopped, left); !read.ok()) return read;
    size -= next;
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> DecoderProcess::ReadText(const DecodeHeader& header,
                                                     const std::function<bool()>& stopped) {
  if (header.size > kMostText) return absl::UnavailableError("the decoder writes nonsense");
  std::string text(header.size, '\0');
  if (absl::Status read = ReadBytes(text.data(), text.size(), stopped); !read.ok()) return read;
  return Printable(text);
}

}  // namespace saccade
