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
#include <random>
#include <system_error>

namespace saccade::cli {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kIdBytes = 36;   // a UUID
constexpr std::size_t kKeyBytes = 43;  // 256 bits as base64url

/// From the system's entropy.
std::string NewKey() {
  static constexpr char kLetters[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::random_device entropy;
  std::string key;
  while (key.size() < kKeyBytes) key += kLetters[entropy() & 63];
  return key;
}

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

/// Of this user's state; empty: there is no place for it.
fs::path StateFolder() {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (state != nullptr && *state != '\0') {
    folder = state;
  } else if (home != nullptr && *home != '\0') {
    folder = fs::path(home) / ".local" / "state";
  } else {
    return {};
  }
  return folder / "saccade";
}

std::string FilePath(const char* kind, const std::string& server, const std::string& name) {
  const fs::path folder = StateFolder();
  if (folder.empty()) return "";
  // The user, too: "sudo" and "su" may keep HOME.
  const std::string exact = absl::StrCat(server, "\n", name, "\n", geteuid());
  return (folder /
          absl::StrFormat("%s-%s-%s-%016x", kind, Legible(server), Legible(name), Hash(exact)))
      .string();
}

/// What a file of one's own that nobody else can read holds; empty: there is none.
std::string ReadPrivate(const fs::path& path, std::size_t bytes) {
  const int file =
      path.empty() ? -1 : open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (file < 0) return "";
  struct stat facts {};
  const bool own = fstat(file, &facts) == 0 && S_ISREG(facts.st_mode) &&
                   facts.st_uid == geteuid() && (facts.st_mode & 077) == 0;
  std::string text(bytes, '\0');
  const bool whole = own && read(file, text.data(), bytes) == static_cast<ssize_t>(bytes);
  close(file);
  return whole ? text : "";
}

/// False: not written.
bool WritePrivate(const fs::path& path, const std::string& text) {
  std::error_code ignored;
  fs::create_directories(path.parent_path().parent_path(), ignored);
  mkdir(path.parent_path().c_str(), 0700);
  // Renamed into place: a run beside this one reads the old text or the new one, never half. Never
  // readable by others, not even for a moment.
  const fs::path scratch = absl::StrCat(path.string(), ".", getpid());
  fs::remove(scratch, ignored);
  const int file =
      open(scratch.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (file < 0) return false;
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  std::error_code failed;
  if (close(file) == 0 && written) {
    fs::rename(scratch, path, failed);
    return !failed;
  }
  fs::remove(scratch, ignored);
  return false;
}

}  // namespace

std::string SessionFilePath(const std::string& server, const std::string& name) {
  return FilePath("session", server, name);
}

std::string LoadSession(const std::string& server, const std::string& name) {
  return ReadPrivate(SessionFilePath(server, name), kIdBytes);
}

void SaveSession(const std::string& server, const std::string& name,
                 const std::string& session_id) {
  const fs::path path = SessionFilePath(server, name);
  if (path.empty() || session_id.size() != kIdBytes) return;
  WritePrivate(path, session_id + "\n");
}

std::string PersonFilePath(const std::string& server, const std::string& name) {
  return FilePath("person", server, name);
}

std::string PersonKey(const std::string& server, const std::string& name) {
  const fs::path path = PersonFilePath(server, name);
  if (path.empty()) return "";
  const std::string kept = ReadPrivate(path, kKeyBytes);
  if (!kept.empty()) return kept;
  const std::string key = NewKey();
  if (!WritePrivate(path, key + "\n")) return "";
  // Two runs that began at once: both go on with what lies there now.
  return ReadPrivate(path, kKeyBytes);
}

}  // namespace saccade::cli
