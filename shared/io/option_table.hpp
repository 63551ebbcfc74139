#pragma once

#include <absl/status/status.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "shared/io/toml_table.hpp"

namespace saccade {

/// One field of an options struct as a person writes it: the only description of it. TOML, `--set`,
/// help and validation all read this.
template <typename Options>
struct Option {
  const char* name;  // in the file and for --set
  std::variant<double Options::*, int Options::*, std::uint64_t Options::*, bool Options::*,
               Eigen::Vector3d Options::*>
      field;
  double least, most;  // of the number as it is written; of a vector nothing
  const char* help;    // what it is, in some words, with the unit where the name has none
  double scale = 1.0;  // what is kept = scale * what is written (degrees in the file: pi / 180)
};

/// A number as TOML has it: floats keep a point or an exponent.
inline std::string TomlNumber(double value) {
  std::string text = absl::StrFormat("%.12g", value);
  // TOML tells integers from floats; either is read, but one kind looks better.
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

/// InvalidArgument unless `value` is from `least` to `most`; `name` with what stands before it.
inline absl::Status CheckRange(const std::string& name, double value, double least, double most) {
  if (value >= least && value <= most) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(name, ": ", value, "; give a number from ", least, " to ", most));
}

/// The options of one struct, in the order in which they are told. Immutable.
template <typename Options>
class OptionTable {
 public:
  OptionTable(std::initializer_list<Option<Options>> options) : options_(options) {}

  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const auto& option : options_) names.emplace_back(option.name);
    return names;
  }
  bool Has(absl::string_view name) const { return Find(name) != nullptr; }

  /// What `table` says, over the present values. Its Finish() is the caller's to call.
  void Read(TomlTable& table, Options& options) const {
    for (const auto& option : options_) {
      std::visit([&](auto field) { ReadField(table, option, options.*field); }, option.field);
    }
  }

  /// `--set name=text`. InvalidArgument: not a value of its type, or out of range; NotFound: no
  /// such option. `prefix` stands before the name in messages ("gaze.").
  absl::Status Set(absl::string_view name, absl::string_view text, const std::string& prefix,
                   Options& options) const {
    const Option<Options>* option = Find(name);
    if (option == nullptr) return absl::NotFoundError(absl::StrCat(prefix, name));
    Options changed = options;
    const bool read = std::visit(
        [&](auto field) { return ParseField(text, option->scale, changed.*field); }, option->field);
    if (!read) {
      return absl::InvalidArgumentError(
          absl::StrCat(prefix, name, ": '", text, "' is not a value of its type"));
    }
    const absl::Status valid = Check(changed, *option, prefix);
    if (valid.ok()) options = changed;
    return valid;
  }

  /// InvalidArgument names the option, its value and its range.
  absl::Status Validate(const Options& options, const std::string& prefix) const {
    for (const auto& option : options_) {
      if (absl::Status valid = Check(options, option, prefix); !valid.ok()) return valid;
    }
    return absl::OkStatus();
  }

  /// "name = value" lines.
  std::string ToToml(const Options& options) const {
    std::string text;
    for (const auto& option : options_) {
      absl::StrAppend(&text, option.name, " = ", Written(options, option), "\n");
    }
    return text;
  }

  /// The same with range and meaning behind each: with `[table]` in front, a file that changes
  /// nothing.
  std::string Describe(const Options& defaults) const {
    std::string text;
    for (const auto& option : options_) {
      const bool number = !std::holds_alternative<bool Options::*>(option.field) &&
                          !std::holds_alternative<Eigen::Vector3d Options::*>(option.field);
      absl::StrAppend(
          &text,
          absl::StrFormat("%-44s # ", absl::StrCat(option.name, " = ", Written(defaults, option))),
          number ? absl::StrCat(option.least, " to ", option.most, ": ") : "", option.help, "\n");
    }
    return text;
  }

 private:
  const Option<Options>* Find(absl::string_view name) const {
    for (const auto& option : options_) {
      if (name == option.name) return &option;
    }
    return nullptr;
  }

  template <typename T>
  static void ReadField(TomlTable& table, const Option<Options>& option, T& out) {
    if constexpr (std::is_same_v<T, double>) table.Number(option.name, option.scale, out);
    if constexpr (std::is_same_v<T, int>) table.Integer(option.name, out);
    if constexpr (std::is_same_v<T, std::uint64_t>) table.Unsigned(option.name, out);
    if constexpr (std::is_same_v<T, bool>) table.Boolean(option.name, out);
    if constexpr (std::is_same_v<T, Eigen::Vector3d>) table.Vector(option.name, out);
  }

  template <typename T>
  static bool ParseField(absl::string_view text, double scale, T& out) {
    if constexpr (std::is_same_v<T, bool>) {
      return absl::SimpleAtob(text, &out);
    } else if constexpr (std::is_same_v<T, double>) {
      if (!absl::SimpleAtod(text, &out)) return false;
      out *= scale;
      return true;
    } else if constexpr (std::is_same_v<T, Eigen::Vector3d>) {
      return false;
    } else {
      return absl::SimpleAtoi(text, &out);
    }
  }

  static absl::Status Check(const Options& options, const Option<Options>& option,
                            const std::string& prefix) {
    return std::visit(
        [&](auto field) -> absl::Status {
          using T = std::remove_cvref_t<decltype(options.*field)>;
          if constexpr (std::is_same_v<T, Eigen::Vector3d>) {
            return absl::OkStatus();
          } else {
            return CheckRange(absl::StrCat(prefix, option.name),
                              static_cast<double>(options.*field) / option.scale, option.least,
                              option.most);
          }
        },
        option.field);
  }

  static std::string Written(const Options& options, const Option<Options>& option) {
    return std::visit(
        [&](auto field) -> std::string {
          const auto& value = options.*field;
          using T = std::remove_cvref_t<decltype(value)>;
          if constexpr (std::is_same_v<T, Eigen::Vector3d>) {
            return absl::StrCat("[", TomlNumber(value.x()), ", ", TomlNumber(value.y()), ", ",
                                TomlNumber(value.z()), "]");
          } else if constexpr (std::is_same_v<T, bool>) {
            return value ? "true" : "false";
          } else if constexpr (std::is_same_v<T, double>) {
            return TomlNumber(value / option.scale);
          } else {
            return absl::StrCat(value);
          }
        },
        option.field);
  }

  std::vector<Option<Options>> options_;
};

}  // namespace saccade
