#include "client/cli/session_file.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace saccade::cli {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kIdBytes = 36;  // a UUID

/// Different names may have the same letters and digits: "Ann B" and "Ann_B".
std::uint64_t Hash(const std::string& text) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return hash;  // FNV-1a
}

std::string Legible(const std::string& text) {
  std::string out;
  for (const char c : text.substr(0, 40)) {
    out += absl::ascii_isalnum(static_cast<unsigned char>(c)) ? c : '_';
  }
  return out;
}

}  // namespace

std::string SessionFilePath(const std::string& server, const std::string& name) {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (state != nullptr && *state != '\0') {
    folder = state;
  } else if (home != nullptr && *home != '\0') {
    folder = fs::path(home) / ".local" / "state";
  } else {
    return "";
  }
  // The user, too: "sudo" and "su" may keep HOME.
  const std::string exact = absl::StrCat(server, "\n", name, "\n", geteuid());
  return (folder / "saccade" /
          absl::StrFormat("session-%s-%s-%016x", Legible(server), Legible(name), Hash(exact)))
      .string();
}

std::string LoadSession(const std::string& server, const std::string& name) {
  const std::string path = SessionFilePath(server, name);
  const int file =
      path.empty() ? -1 : open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (file < 0) return "";
  struct stat facts {};
  const bool own = fstat(file, &facts) == 0 && S_ISREG(facts.st_mode) &&
                   facts.st_uid == geteuid() && (facts.st_mode & 077) == 0;
  std::string id(kIdBytes, '\0');
  const bool whole = own && read(file, id.data(), kIdBytes) == static_cast<ssize_t>(kIdBytes);
  close(file);
  return whole ? id : "";
}

void SaveSession(const std::string& server, const std::string& name,
                 const std::string& session_id) {
  const fs::path path = SessionFilePath(server, name);
  if (path.empty() || session_id.size() != kIdBytes) return;
  std::error_code ignored;
  fs::create_directories(path.parent_path().parent_path(), ignored);
  mkdir(path.parent_path().c_str(), 0700);
  // Renamed into place: a run beside this one reads the old id or the new one, never half. Never
  // readable by others, not even for a moment.
  const fs::path scratch = absl::StrCat(path.string(), ".", getpid());
  fs::remove(scratch, ignored);
  const int file =
      open(scratch.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (file < 0) return;
  const std::string line = session_id + "\n";
  const bool written = write(file, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  if (close(file) == 0 && written) {
    fs::rename(scratch, path, ignored);
  } else {
    fs::remove(scratch, ignored);
  }
}

}  // namespace saccade::cli
