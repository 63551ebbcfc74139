#include "shared/io/toml_table.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <cmath>
#include <set>
#include <toml.hpp>
#include <utility>

#include "shared/io/toml_file.hpp"

namespace saccade {

struct TomlTable::File {
  std::filesystem::path path;
  toml::value root;
  absl::Status status;
};

struct TomlTable::State {
  State(std::shared_ptr<File> in, const toml::value& what, std::string name)
      : file(std::move(in)), table(what), prefix(std::move(name)) {
    for (const auto& [key, value] : table.as_table()) left.insert(key);
  }
  const toml::value* Take(const std::string& key) {
    known.push_back(key);
    return left.erase(key) > 0 ? &table.at(key) : nullptr;
  }
  void Say(const std::string& key, const std::string& problem) {
    if (!file->status.ok()) return;
    file->status = InFile(
        file->path, absl::InvalidArgumentError(absl::StrCat(prefix, ".", key, ": ", problem)));
  }
  void Read(const toml::value& value, const std::string& key, double scale, double& out) {
    if (value.is_floating() && !std::isfinite(value.as_floating())) {
      Say(key, "is not a finite number; give a number");
    } else if (value.is_floating()) {
      out = scale * value.as_floating();
    } else if (value.is_integer()) {
      out = scale * static_cast<double>(value.as_integer());
    } else {
      Say(key, "is not a number");
    }
  }

  const std::shared_ptr<File> file;
  const toml::value& table;  // in file
  const std::string prefix;
  std::set<std::string> left;
  std::vector<std::string> known;
};

absl::Status InFile(const std::filesystem::path& file, const absl::Status& status) {
  if (status.ok()) return status;
  return {status.code(), absl::StrCat(file.string(), ": ", status.message())};
}

absl::StatusOr<std::optional<TomlTable>> TomlTable::Load(const std::filesystem::path& file,
                                                         const std::string& name) {
  absl::StatusOr<toml::value> root = ParseTomlFile(file);
  if (!root.ok()) return root.status();
  auto read = std::make_shared<File>();
  read->path = file;
  try {
    read->root = *std::move(root);
    if (!read->root.contains(name)) return std::nullopt;
    const toml::value& table = read->root.at(name);
    if (!table.is_table()) {
      return absl::InvalidArgumentError(
          absl::StrCat(file.string(), ": ", name, ": is not a table; write [", name, "]"));
    }
    return TomlTable(std::make_shared<State>(read, table, name));
  } catch (const std::exception& problem) {
    return absl::InvalidArgumentError(absl::StrCat(file.string(), ": ", problem.what()));
  }
}

void TomlTable::Say(const std::string& key, const std::string& problem) {
  state_->Say(key, problem);
}

void TomlTable::Number(const std::string& key, double scale, double& out) {
  if (const toml::value* node = state_->Take(key)) state_->Read(*node, key, scale, out);
}

void TomlTable::Integer(const std::string& key, int& out) {
  const toml::value* node = state_->Take(key);
  if (node == nullptr) return;
  // 1.0 is whole as well.
  const double number = node->is_floating() ? node->as_floating() : 0.0;
  if (node->is_floating() && number == std::trunc(number) && std::abs(number) < 1e9) {
    out = static_cast<int>(number);
    return;
  }
  if (!node->is_integer() || !std::in_range<int>(node->as_integer())) {
    return Say(key, "is not a whole number");
  }
  out = static_cast<int>(node->as_integer());
}

void TomlTable::Unsigned(const std::string& key, std::uint64_t& out) {
  const toml::value* node = state_->Take(key);
  if (node == nullptr) return;
  if (!node->is_integer() || node->as_integer() < 0) {
    return Say(key, "is not a whole number from 0");
  }
  out = static_cast<std::uint64_t>(node->as_integer());
}

void TomlTable::Boolean(const std::string& key, bool& out) {
  const toml::value* node = state_->Take(key);
  if (node == nullptr) return;
  if (!node->is_boolean()) return Say(key, "give true or false");
  out = node->as_boolean();
}

void TomlTable::Text(const std::string& key, std::string& out) {
  const toml::value* node = state_->Take(key);
  if (node == nullptr) return;
  if (!node->is_string()) return Say(key, "is not a text; write it in quotes");
  out = node->as_string().str;
}

void TomlTable::Vector(const std::string& key, Eigen::Vector3d& out) {
  const toml::value* node = state_->Take(key);
  if (node == nullptr) return;
  if (!node->is_array() || node->as_array().size() != 3) {
    return Say(key, "is not three numbers; give for example [0.0, 0.02, 0.0]");
  }
  for (std::size_t k = 0; k < 3; ++k) {
    state_->Read(node->as_array()[k], key, 1.0, out(static_cast<Eigen::Index>(k)));
  }
}

void TomlTable::Texts(const std::string& key, std::vector<std::string>& out) {
  const toml::value* node = state_->Take(key);
  if (node == nullptr) return;
  std::vector<std::string> texts;
  if (node->is_array()) {
    for (const toml::value& one : node->as_array()) {
      if (one.is_string()) texts.push_back(one.as_string().str);
    }
  }
  if (!node->is_array() || texts.size() != node->as_array().size()) {
    return Say(key, "is not a list of texts; give for example [\"a\", \"b\"]");
  }
  out = std::move(texts);
}

std::optional<TomlTable> TomlTable::Table(const std::string& key) {
  const toml::value* node = state_->Take(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_table()) {
    Say(key, "is not a table");
    return std::nullopt;
  }
  return TomlTable(
      std::make_shared<State>(state_->file, *node, absl::StrCat(state_->prefix, ".", key)));
}

absl::Status TomlTable::Finish() {
  if (!state_->left.empty()) {
    Say(*state_->left.begin(),
        absl::StrCat("unknown key; known: ", absl::StrJoin(state_->known, ", ")));
  }
  return state_->file->status;
}

}  // namespace saccade
