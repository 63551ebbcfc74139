#include "shared/io/log.hpp"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <utility>

namespace saccade {
namespace {

constexpr std::size_t kMaxLine = 4000;  // with its newline below PIPE_BUF: written as one piece
constexpr std::size_t kLineCost = 64;   // so that empty lines are bounded too
constexpr int kLook_ms = 100;           // how often a writer that waits looks whether to end
constexpr std::chrono::milliseconds kAtExit(200);

void AppendHex(char c, std::string& out) {
  constexpr char kDigits[] = "0123456789abcdef";
  const auto byte = static_cast<unsigned char>(c);
  out += {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 15]};
}

bool IsControl(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 || byte == 0x7f;
}

std::string OneLine(absl::string_view text) {
  std::string line;
  for (const char c : text.substr(0, kMaxLine)) {
    if (line.size() >= kMaxLine) break;
    IsControl(c) ? AppendHex(c, line) : line.push_back(c);
  }
  if (text.size() > kMaxLine || line.size() >= kMaxLine) {
    line.resize(std::min(line.size(), kMaxLine));
    line += "...";
  }
  return line + "\n";
}

/// Never destroyed: other threads may still write while the process ends.
LineWriter& WriterOf(int descriptor) {
  static LineWriter* const err = new LineWriter(STDERR_FILENO);
  static LineWriter* const out = new LineWriter(STDOUT_FILENO);
  [[maybe_unused]] static const int at_exit = std::atexit([] { FlushLog(kAtExit); });
  return descriptor == STDERR_FILENO ? *err : *out;
}

}  // namespace

LineWriter::LineWriter(int descriptor, std::size_t most_bytes)
    : descriptor_(descriptor), most_bytes_(most_bytes) {
  try {
    thread_ = std::jthread([this](const std::stop_token& stop) {
      sigset_t all;
      sigfillset(&all);
      pthread_sigmask(SIG_BLOCK, &all, nullptr);
      Run(stop);
    });
  } catch (const std::system_error&) {
    // No thread to be had: Write tries by itself, and drops what does not go at once.
  }
}

LineWriter::~LineWriter() = default;

void LineWriter::Write(absl::string_view text) {
  std::string line = OneLine(text);
  {
    const std::lock_guard lock(mutex_);
    const std::size_t cost = line.size() + kLineCost;
    if (bytes_ + cost > most_bytes_) {
      ++dropped_;
      ++untold_;
      return;
    }
    if (untold_ > 0) {
      std::string told = absl::StrCat("log: ", std::exchange(untold_, 0),
                                      " lines dropped: nobody read them in time\n");
      bytes_ += told.size() + kLineCost;
      queue_.push_back(std::move(told));
    }
    bytes_ += cost;
    queue_.push_back(std::move(line));
  }
  wake_.notify_one();
  if (thread_.joinable()) return;
  std::stop_source now;
  now.request_stop();
  Run(now.get_token());
}

void LineWriter::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (wake_.wait(lock, stop, [this] { return !queue_.empty(); })) {
    const std::string line = std::move(queue_.front());
    queue_.pop_front();
    busy_ = true;
    lock.unlock();
    WriteOut(line, stop);
    lock.lock();
    busy_ = false;
    bytes_ -= line.size() + kLineCost;
    if (queue_.empty()) drained_.notify_all();
  }
}

/// A descriptor that was made not to block says EAGAIN; one that blocks is asked by poll first.
void LineWriter::WriteOut(absl::string_view text, const std::stop_token& stop) const {
  while (!text.empty()) {
    pollfd ready{descriptor_, POLLOUT, 0};
    if (poll(&ready, 1, stop.stop_requested() ? 0 : kLook_ms) <= 0) {
      if (stop.stop_requested()) return;
      continue;
    }
    const ssize_t written = ::write(descriptor_, text.data(), text.size());
    if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
    // A full disk or a pipe without a reader: there is nowhere to say so.
    if (written < 0 && errno != EAGAIN && errno != EINTR) return;
  }
}

bool LineWriter::Flush(std::chrono::milliseconds limit) {
  std::unique_lock lock(mutex_);
  return drained_.wait_for(lock, limit, [this] { return queue_.empty() && !busy_; });
}

std::uint64_t LineWriter::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

void Log(absl::string_view line) { WriterOf(STDERR_FILENO).Write(line); }
void Announce(absl::string_view line) { WriterOf(STDOUT_FILENO).Write(line); }

bool FlushLog(std::chrono::milliseconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  const bool out = WriterOf(STDOUT_FILENO).Flush(limit);
  const auto left =
      std::max(std::chrono::steady_clock::duration::zero(), end - std::chrono::steady_clock::now());
  return WriterOf(STDERR_FILENO)
             .Flush(std::chrono::duration_cast<std::chrono::milliseconds>(left)) &&
         out;
}

void NeverWaitForStandardStreams() {
  for (const int descriptor : {STDOUT_FILENO, STDERR_FILENO}) {
    struct stat what {};
    if (fstat(descriptor, &what) != 0) continue;
    // A file would begin anew at its start, and a socket cannot be opened: neither is touched.
    if (!S_ISFIFO(what.st_mode) && !S_ISCHR(what.st_mode)) continue;
    // O_NONBLOCK belongs to the open file, which others share; so it is opened once more.
    const std::string name = absl::StrCat("/proc/self/fd/", descriptor);
    const int again = open(name.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (again < 0) continue;
    dup2(again, descriptor);
    close(again);
  }
}

std::string Printable(absl::string_view text) {
  std::string out;
  for (const char c : text) {
    c >= 0x20 && c < 0x7f && c != '\\' ? out.push_back(c) : AppendHex(c, out);
  }
  return out;
}

}  // namespace saccade
