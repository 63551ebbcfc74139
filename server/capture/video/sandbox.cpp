#include "server/capture/video/sandbox.hpp"

#include <fcntl.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace saccade {
namespace {

constexpr rlim_t kMostMemory = rlim_t{2} << 30;
constexpr rlim_t kMostFiles = 16;

// What a decoder on one thread needs: memory, time, and descriptors that are open already.
constexpr int kAllowed[] = {
    SCMP_SYS(read),
    SCMP_SYS(readv),
    SCMP_SYS(write),
    SCMP_SYS(writev),
    SCMP_SYS(lseek),
    SCMP_SYS(close),
    SCMP_SYS(fstat),
    SCMP_SYS(poll),
    SCMP_SYS(ppoll),
    SCMP_SYS(brk),
    SCMP_SYS(munmap),
    SCMP_SYS(mremap),
    SCMP_SYS(madvise),
    SCMP_SYS(futex),
    SCMP_SYS(clock_gettime),
    SCMP_SYS(clock_nanosleep),
    SCMP_SYS(nanosleep),
    SCMP_SYS(gettimeofday),
    SCMP_SYS(getrandom),
    SCMP_SYS(sched_yield),
    SCMP_SYS(sched_getaffinity),
    SCMP_SYS(getpid),
    SCMP_SYS(gettid),
    SCMP_SYS(getrusage),
    SCMP_SYS(rt_sigaction),
    SCMP_SYS(rt_sigprocmask),
    SCMP_SYS(rt_sigreturn),
    SCMP_SYS(sigaltstack),
    SCMP_SYS(restart_syscall),
    SCMP_SYS(exit),
    SCMP_SYS(exit_group),
};
constexpr int kNetwork[] = {
    SCMP_SYS(socket),     SCMP_SYS(connect),    SCMP_SYS(bind),        SCMP_SYS(sendto),
    SCMP_SYS(sendmsg),    SCMP_SYS(recvfrom),   SCMP_SYS(recvmsg),     SCMP_SYS(shutdown),
    SCMP_SYS(setsockopt), SCMP_SYS(getsockopt), SCMP_SYS(getsockname), SCMP_SYS(getpeername),
    SCMP_SYS(fcntl),
};

bool Limit(int resource, rlim_t most) {
  const rlimit limit{most, most};
  return setrlimit(static_cast<__rlimit_resource_t>(resource), &limit) == 0;
}

/// Memory may be mapped, but never to be executed.
bool AllowMemory(scmp_filter_ctx filter) {
  const scmp_arg_cmp no_exec = SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0);
  return seccomp_rule_add_array(filter, SCMP_ACT_ALLOW, SCMP_SYS(mmap), 1, &no_exec) == 0 &&
         seccomp_rule_add_array(filter, SCMP_ACT_ALLOW, SCMP_SYS(mprotect), 1, &no_exec) == 0;
}

bool LoadFilter(bool network) {
  const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ERRNO(EPERM));
  if (filter == nullptr) return false;
  bool good = AllowMemory(filter);
  for (const int call : kAllowed) {
    good = good && seccomp_rule_add_array(filter, SCMP_ACT_ALLOW, call, 0, nullptr) == 0;
  }
  if (network) {
    for (const int call : kNetwork) {
      good = good && seccomp_rule_add_array(filter, SCMP_ACT_ALLOW, call, 0, nullptr) == 0;
    }
  }
  good = good && seccomp_load(filter) == 0;
  seccomp_release(filter);
  return good;
}

std::string Attempt(const char* what, bool allowed) {
  const int error = errno;
  return std::string(what) +
         (allowed ? ": allowed\n" : ": refused (" + std::string(std::strerror(error)) + ")\n");
}

}  // namespace

std::string EnterSandbox(bool network) {
  if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) return "it may outlive its parent";
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return "rights cannot be given up";
  if (prctl(PR_SET_DUMPABLE, 0) != 0) return "memory stays readable";
    // RLIMIT_AS includes the address sanitizer's shadow, which is terabytes.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  if (!Limit(RLIMIT_AS, kMostMemory)) return "memory cannot be limited";
#endif
  if (!Limit(RLIMIT_CORE, 0) || !Limit(RLIMIT_FSIZE, 0) || !Limit(RLIMIT_NOFILE, kMostFiles)) {
    return "files cannot be limited";
  }
  signal(SIGXFSZ, SIG_IGN);
  return LoadFilter(network) ? "" : "seccomp is not to be had; a kernel with it is needed";
}

std::string TrySandbox() {
  std::string result;
  result += Attempt("read /etc/passwd", open("/etc/passwd", O_RDONLY) >= 0);
  result += Attempt("write /tmp", open("/tmp/saccade-decode-try", O_WRONLY | O_CREAT, 0600) >= 0);
  result += Attempt("make a folder", mkdir("/tmp/saccade-decode-try-folder", 0700) == 0);
  result += Attempt("open a socket", socket(AF_INET, SOCK_STREAM, 0) >= 0);
  const pid_t child = fork();
  if (child == 0) _exit(0);
  if (child > 0) waitpid(child, nullptr, 0);
  result += Attempt("start a process", child > 0);
  char* const argv[] = {const_cast<char*>("true"), nullptr};
  execv("/bin/true", argv);
  result += Attempt("run a program", false);
  result += Attempt("signal the parent", kill(getppid(), 0) == 0);
  void* code =
      mmap(nullptr, 4096, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  result += Attempt("make memory executable", code != MAP_FAILED);
  void* much = mmap(nullptr, std::size_t{4} << 30, PROT_READ | PROT_WRITE,
                    MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  result += Attempt("take 4 GiB", much != MAP_FAILED);
  return result;
}

}  // namespace saccade
