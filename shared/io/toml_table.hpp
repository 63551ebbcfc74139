#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace saccade {

/// One table of a TOML file, read key by key over the present values. The first problem of the file
/// is kept, with file, key and remedy; a key that nobody asked for is one. Hides toml11, which is
/// slow to compile. One thread.
class TomlTable {
 public:
  /// The table `name` of `file`; nothing where the file has none.
  /// Errors as ParseTomlFile (shared/io), and
  ///   InvalidArgument  `name` is not a table
  static absl::StatusOr<std::optional<TomlTable>> Load(const std::filesystem::path& file,
                                                       const std::string& name);

  // Each leaves `out` as it is where the key is absent.
  /// `out` = `scale` * what the file says.
  void Number(const std::string& key, double scale, double& out);
  void Integer(const std::string& key, int& out);
  void Unsigned(const std::string& key, std::uint64_t& out);
  void Boolean(const std::string& key, bool& out);
  void Text(const std::string& key, std::string& out);
  void Vector(const std::string& key, Eigen::Vector3d& out);
  void Texts(const std::string& key, std::vector<std::string>& out);
  /// A table in this one; its Finish() is the caller's to call.
  std::optional<TomlTable> Table(const std::string& key);

  void Say(const std::string& key, const std::string& problem);
  /// The first problem of the whole file so far, or a key of this table that is not known.
  absl::Status Finish();

 private:
  struct File;
  struct State;
  explicit TomlTable(std::shared_ptr<State> state) : state_(std::move(state)) {}

  std::shared_ptr<State> state_;
};

/// `status` with the file's name in front.
absl::Status InFile(const std::filesystem::path& file, const absl::Status& status);

/// Reads the table `name` of `file` with `read(table, options)`, and takes over what it says only
/// if all of it is valid. A file without the table changes nothing.
template <typename Options, typename Reader>
absl::Status LoadTomlTable(const std::filesystem::path& file, const std::string& name, Reader read,
                           Options& options) {
  absl::StatusOr<std::optional<TomlTable>> table = TomlTable::Load(file, name);
  if (!table.ok()) return table.status();
  if (!table->has_value()) return absl::OkStatus();
  Options changed = options;
  read(**table, changed);
  absl::Status status = (*table)->Finish();
  if (status.ok()) status = InFile(file, changed.Validate());
  if (status.ok()) options = changed;
  return status;
}

}  // namespace saccade
