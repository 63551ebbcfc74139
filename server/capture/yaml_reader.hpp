#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace saccade {

struct YamlRange {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_excluded = false;
};

/// Reads the fields of one YAML map and keeps the first error, with file, line, field and remedy,
/// so that a parser reads as a list of fields with one check of status() at its end. After an error
/// every call answers with a harmless default.
class YamlReader {
 public:
  using Range = YamlRange;

  /// Loads `file`, which must be a regular file of at most 1 MiB and hold a map.
  explicit YamlReader(const std::filesystem::path& file);
  /// The same of text that was read already; `file` is for messages. Only the first document in it.
  static YamlReader FromText(std::string file, const std::string& text);

  const absl::Status& status() const { return status_; }
  bool ok() const { return status_.ok(); }

  /// A finite number in `range`; `fallback` if the key is absent (an error without one).
  double Number(absl::string_view key, Range range, std::optional<double> fallback = std::nullopt);
  int Integer(absl::string_view key, int min, int max);
  std::string Text(absl::string_view key);
  /// A list of finite numbers in `range`; `count` of them, if given. An absent optional list is
  /// empty.
  std::vector<double> Numbers(absl::string_view key, std::optional<std::size_t> count,
                              bool optional = false, Range range = Range());
  /// Makes any key not named here an error: a misspelt optional field must not pass unseen.
  void AllowOnly(std::initializer_list<absl::string_view> keys);

  bool Has(absl::string_view key) const;
  /// Readers of the maps in the list `key`.
  std::vector<YamlReader> Maps(absl::string_view key);
  /// Reader of the map `key`, whose fields are called `key.field` in messages.
  YamlReader Map(absl::string_view key);
  std::vector<std::string> Keys() const;
  bool IsMap(absl::string_view key) const { return Get(key).IsMap(); }
  bool IsList(absl::string_view key) const { return Get(key).IsSequence(); }
  /// Line of the value of `key`, from 1; 0 without one.
  int Line(absl::string_view key) const;
  /// Records an error at the line of `key`.
  void Fail(absl::string_view key, absl::string_view problem);
  /// Takes over another reader's error.
  void Merge(const YamlReader& other);

 private:
  YamlReader(std::string file, std::string prefix, const YAML::Node& node);
  void Parse(const std::string& text);
  /// One key twice: which of them counts, nobody can say.
  void RefuseRepeatedKeys();
  YAML::Node Get(absl::string_view key) const;
  void FailAt(const YAML::Mark& mark, absl::string_view what);
  double Finite(absl::string_view key, const YAML::Node& value);

  std::string file_;
  std::string prefix_;  // of field names in messages
  YAML::Node node_;
  absl::Status status_;
};

}  // namespace saccade
