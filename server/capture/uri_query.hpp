#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace saccade {

/// "PATH?key=value&key=value" taken apart: what is asked for is taken out by name, and what nobody
/// took is an error. Keeps the first error, as YamlReader does.
class UriQuery {
 public:
  /// `scheme` is for messages: "v4l2:".
  UriQuery(absl::string_view scheme, absl::string_view rest);

  const std::string& path() const { return path_; }
  bool Has(absl::string_view key) const;
  /// The value, or nothing if the key is absent.
  std::optional<std::string> Text(absl::string_view key);
  /// `form` says what is expected ("a number from 1 to 240").
  std::optional<double> Number(absl::string_view key, double least, double most);
  std::optional<bool> Flag(absl::string_view key);
  void Fail(absl::string_view key, absl::string_view problem);
  /// The first error; also for a key that nobody took: then `known` tells those that there are.
  absl::Status Finish(absl::string_view known);

 private:
  const std::string scheme_;
  std::string path_;
  std::vector<std::pair<std::string, std::string>> values_;
  absl::Status status_;
};

}  // namespace saccade
