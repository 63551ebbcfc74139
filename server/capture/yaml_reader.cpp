#include "server/capture/yaml_reader.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>

#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxBytes = 1 << 20;  // these files are a few lines; more is a mistake

std::string RangeText(const YamlReader::Range& range) {
  std::string text;
  if (std::isfinite(range.min)) {
    absl::StrAppend(&text, range.min_excluded ? " above " : " from ", range.min);
  }
  if (std::isfinite(range.max)) absl::StrAppend(&text, " up to ", range.max);
  return text;
}

}  // namespace

YamlReader::YamlReader(const std::filesystem::path& file) : file_(file.string()) {
  const absl::StatusOr<std::string> text = ReadRegularFile(file, kMaxBytes, "a YAML settings file");
  if (!text.ok()) {
    status_ = text.status();
    return;
  }
  Parse(*text);
}

YamlReader::YamlReader(std::string file, std::string prefix, const YAML::Node& node)
    : file_(std::move(file)), prefix_(std::move(prefix)), node_(node) {
  RefuseRepeatedKeys();
}

YamlReader YamlReader::FromText(std::string file, const std::string& text) {
  YamlReader reader(std::move(file), "", YAML::Node());
  reader.Parse(text);
  return reader;
}

void YamlReader::Parse(const std::string& text) {
  try {
    node_ = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    FailAt(e.mark, absl::StrCat("not valid YAML (", e.msg, ")"));
    return;
  } catch (const std::exception& e) {  // no memory
    FailAt(YAML::Mark::null_mark(), absl::StrCat("cannot be read (", e.what(), ")"));
    return;
  }
  if (!node_.IsMap()) FailAt(node_.Mark(), "must be a list of `key: value` lines");
  RefuseRepeatedKeys();
}

void YamlReader::RefuseRepeatedKeys() {
  if (!ok() || !node_.IsMap()) return;
  std::map<std::string, int> lines;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) continue;
    const int line = entry.first.Mark().line + 1;
    const auto [before, is_new] = lines.try_emplace(entry.first.Scalar(), line);
    if (is_new) continue;
    FailAt(entry.first.Mark(), absl::StrCat(prefix_, entry.first.Scalar(), ": is on line ",
                                            before->second, " already; keep one of the two"));
    return;
  }
}

void YamlReader::FailAt(const YAML::Mark& mark, absl::string_view what) {
  if (!status_.ok()) return;
  const std::string line = mark.is_null() ? "" : absl::StrCat(":", mark.line + 1);
  status_ = absl::InvalidArgumentError(absl::StrCat(file_, line, ": ", what));
}

void YamlReader::Fail(absl::string_view key, absl::string_view problem) {
  const YAML::Node value = Get(key);
  FailAt(value.IsDefined() ? value.Mark() : YAML::Mark::null_mark(),
         absl::StrCat(prefix_, key, ": ", problem));
}

int YamlReader::Line(absl::string_view key) const {
  const YAML::Node value = Get(key);
  return value.IsDefined() && !value.Mark().is_null() ? value.Mark().line + 1 : 0;
}

std::vector<std::string> YamlReader::Keys() const {
  std::vector<std::string> keys;
  if (!node_.IsMap()) return keys;
  for (const auto& entry : node_) {
    if (entry.first.IsScalar()) keys.push_back(entry.first.Scalar());
  }
  return keys;
}

YamlReader YamlReader::Map(absl::string_view key) {
  const YAML::Node value = Get(key);
  if (ok() && !value.IsMap()) Fail(key, "missing, or not a map of fields");
  YamlReader reader(file_, absl::StrCat(prefix_, key, "."),
                    value.IsMap() ? value : YAML::Node(YAML::NodeType::Map));
  if (!ok()) reader.status_ = status_;
  return reader;
}

void YamlReader::Merge(const YamlReader& other) {
  if (status_.ok()) status_ = other.status_;
}

YAML::Node YamlReader::Get(absl::string_view key) const {
  const YAML::Node& node = node_;  // const: operator[] must not insert
  if (!node.IsMap()) return YAML::Node(YAML::NodeType::Undefined);
  for (const auto& entry : node) {
    if (entry.first.IsScalar() && entry.first.Scalar() == key) return entry.second;
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

bool YamlReader::Has(absl::string_view key) const { return Get(key).IsDefined(); }

double YamlReader::Finite(absl::string_view key, const YAML::Node& value) {
  double number = 0.0;
  if (!value.IsScalar() || !absl::SimpleAtod(value.Scalar(), &number) || !std::isfinite(number)) {
    const std::string found = value.IsScalar() ? absl::StrCat("'", value.Scalar(), "'") : "a list";
    FailAt(value.Mark(), absl::StrCat(prefix_, key, ": ", found, " is not a finite number"));
    return 0.0;
  }
  return number;
}

double YamlReader::Number(absl::string_view key, Range range, std::optional<double> fallback) {
  if (!ok()) return 0.0;
  const YAML::Node value = Get(key);
  if (!value.IsDefined()) {
    if (!fallback) Fail(key, absl::StrCat("missing; add a number", RangeText(range)));
    return fallback.value_or(0.0);
  }
  const double number = Finite(key, value);
  const bool low = range.min_excluded ? number <= range.min : number < range.min;
  if (ok() && (low || number > range.max)) {
    Fail(key, absl::StrCat(number, " is out of range; give a number", RangeText(range)));
  }
  return ok() ? number : 0.0;
}

int YamlReader::Integer(absl::string_view key, int min, int max) {
  const double number = Number(key, {static_cast<double>(min), static_cast<double>(max)});
  if (ok() && number != std::floor(number)) {
    Fail(key, absl::StrCat(number, " is not a whole number"));
  }
  return ok() ? static_cast<int>(number) : 0;
}

std::string YamlReader::Text(absl::string_view key) {
  if (!ok()) return {};
  const YAML::Node value = Get(key);
  if (value.IsDefined() && value.IsScalar()) return value.Scalar();
  Fail(key, value.IsDefined() ? "must be a single word" : "missing");
  return {};
}

std::vector<double> YamlReader::Numbers(absl::string_view key, std::optional<std::size_t> count,
                                        bool optional, Range range) {
  if (!ok()) return {};
  const YAML::Node value = Get(key);
  if (!value.IsDefined() || value.IsNull()) {
    if (!optional) Fail(key, "missing; add a list of numbers such as [0.1, 0.2]");
    return {};
  }
  std::vector<double> numbers;
  if (!value.IsSequence()) {
    Fail(key, "must be a list of numbers such as [0.1, 0.2]");
    return {};
  }
  for (const auto& entry : value) numbers.push_back(Finite(key, entry));
  if (ok() && count && numbers.size() != *count) {
    Fail(key, absl::StrCat("has ", numbers.size(), " numbers; give ", *count));
  }
  for (const double number : numbers) {
    if (ok() && (number < range.min || number > range.max)) {
      Fail(key, absl::StrCat(number, " is out of range; give numbers", RangeText(range)));
    }
  }
  return ok() ? numbers : std::vector<double>();
}

std::vector<YamlReader> YamlReader::Maps(absl::string_view key) {
  std::vector<YamlReader> maps;
  const YAML::Node value = Get(key);
  if (!ok()) return maps;
  if (!value.IsDefined() || !value.IsSequence()) {
    Fail(key, "must be a list with one `- {...}` line for each entry");
    return maps;
  }
  for (const auto& entry : value) {
    if (!entry.IsMap()) {
      FailAt(entry.Mark(),
             absl::StrCat(prefix_, key, ": each entry must be written `- {key: value, ...}`"));
      return {};
    }
    maps.push_back(YamlReader(file_, "", entry));
  }
  return maps;
}

void YamlReader::AllowOnly(std::initializer_list<absl::string_view> keys) {
  if (!ok()) return;
  for (const auto& entry : node_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      FailAt(entry.first.Mark(),
             absl::StrCat(prefix_, key, ": unknown field; known are ", absl::StrJoin(keys, ", ")));
    }
  }
}

}  // namespace saccade
