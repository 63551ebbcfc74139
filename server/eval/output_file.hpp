#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

namespace saccade {

/// A text file that grows line by line, so that an interrupted run leaves what it had. The first
/// failed write (a full disk) is kept and told by Close, with file, cause and remedy.
class OutputFile {
 public:
  static absl::StatusOr<OutputFile> Create(const std::filesystem::path& file);

  /// Appends; after a failure does nothing.
  void Write(absl::string_view text);
  absl::Status status() const { return status_; }
  /// Hands everything to the operating system.
  absl::Status Flush();
  absl::Status Close();

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  OutputFile(std::FILE* file, std::string name) : file_(file), name_(std::move(name)) {}
  void Fail();

  std::unique_ptr<std::FILE, Closer> file_;
  std::string name_;
  absl::Status status_;
};

/// Writes a whole file at once: readers see the old one or the new one, never half of it.
absl::Status WriteFileAtomically(const std::filesystem::path& file, absl::string_view text);

/// Creates a folder with its parents; AlreadyExists if a file is in the way.
absl::Status CreateFolder(const std::filesystem::path& folder);

}  // namespace saccade
