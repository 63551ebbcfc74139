#include "client/cli/session_file.hpp"

#include <absl/strings/ascii.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "shared/io/regular_file.hpp"

namespace saccade::cli {
namespace fs = std::filesystem;

std::string SessionFilePath(const std::string& server) {
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
  std::string name = "session-";
  for (const char c : server) name += absl::ascii_isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return (folder / "saccade" / name).string();
}

std::string LoadSession(const std::string& server) {
  const absl::StatusOr<std::string> text =
      ReadRegularFile(SessionFilePath(server), 4096, "a session id");
  if (!text.ok()) return "";
  const absl::string_view id = absl::StripAsciiWhitespace(*text);
  return id.size() == 36 ? std::string(id) : "";
}

void SaveSession(const std::string& server, const std::string& session_id) {
  const fs::path path = SessionFilePath(server);
  if (path.empty()) return;
  std::error_code ignored;
  fs::create_directories(path.parent_path(), ignored);
  // Renamed into place: a run beside this one reads the old id or the new one, never half.
  const fs::path scratch = path.string() + "." + std::to_string(getpid());
  {
    std::ofstream out(scratch);
    if (!(out << session_id << "\n").flush()) {
      out.close();
      fs::remove(scratch, ignored);
      return;
    }
  }
  fs::permissions(scratch, fs::perms::owner_read | fs::perms::owner_write, ignored);
  fs::rename(scratch, path, ignored);
}

}  // namespace saccade::cli
