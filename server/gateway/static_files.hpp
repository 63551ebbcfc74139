#pragma once

#include <cstddef>
#include <filesystem>
#include <list>
#include <map>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace saccade {

/// A file as it goes over the wire.
struct StaticFile {
  std::string body;
  std::string gzip_body;  // empty: not worth it
  std::string content_type;
  std::string cache_control;  // files with a hash in their name never change
  std::string etag;
};

/// The built page, read into memory once: no request ever reaches the file system, so there is no
/// path to escape from.
class StaticFiles {
 public:
  /// Reads every regular file below `root`; symbolic links are not followed. An absent `root` or
  /// one without index.html gives a page that says how to build it. Errors:
  ///   ResourceExhausted  more than 64 MB
  ///   Unavailable        a file cannot be read, naming it
  static absl::StatusOr<StaticFiles> Load(const std::filesystem::path& root);

  /// The file at a request's path (query ignored): `/` is index.html, `/wearer` is wearer.html.
  /// Null if there is none.
  const StaticFile* Find(absl::string_view target) const;

  /// Puts one that is not on the disk at `path` ("/trust"). What was there is kept, as somebody may
  /// be reading it: for what changes once in years.
  void Put(const std::string& path, std::string body, absl::string_view content_type);

  std::size_t size() const { return files_.size(); }

 private:
  std::map<std::string, StaticFile, std::less<>> files_;  // by path, "/assets/main-1a2b.js"
  std::list<StaticFile> replaced_;
};

}  // namespace saccade
