#include "server/mount/mount_registry.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/strip.h>

namespace saccade {
namespace {

constexpr char kNone[] = "none";

}  // namespace

std::string MountRegistry::Usage() const {
  std::string usage = kNone;
  for (const MountDriver& driver : drivers_) absl::StrAppend(&usage, " | ", driver.usage);
  return usage;
}

std::vector<std::string> MountRegistry::Tables() const {
  std::vector<std::string> tables = {"mount_model"};
  for (const MountDriver& driver : drivers_) {
    if (!driver.table.empty()) tables.push_back(driver.table);
  }
  return tables;
}

std::string MountRegistry::Describe() const {
  std::string text = MountOptions::Describe();
  for (const MountDriver& driver : drivers_) {
    if (driver.describe) absl::StrAppend(&text, "\n", driver.describe());
  }
  return text;
}

const MountDriver* MountRegistry::Find(absl::string_view uri, std::string& rest) const {
  for (const MountDriver& driver : drivers_) {
    absl::string_view left = uri;
    if (!absl::ConsumePrefix(&left, driver.scheme)) continue;
    const bool whole = absl::EndsWith(driver.scheme, ":") || left.empty();
    if (!whole && !absl::ConsumePrefix(&left, "?")) continue;
    rest = std::string(left);
    return &driver;
  }
  return nullptr;
}

absl::Status MountRegistry::Unknown(const std::string& uri) const {
  std::vector<std::string> examples = {kNone};
  for (const MountDriver& driver : drivers_) examples.push_back(driver.example);
  const std::string last = examples.back();
  examples.pop_back();
  return absl::InvalidArgumentError(absl::StrCat("--mount: '", uri, "' is not known: use ",
                                                 absl::StrJoin(examples, ", "), " or ", last));
}

absl::Status MountRegistry::Check(const std::string& uri, const MountFacts& facts) const {
  if (uri == kNone) return absl::OkStatus();
  std::string rest;
  const MountDriver* driver = Find(uri, rest);
  return driver == nullptr ? Unknown(uri) : driver->check(rest, facts);
}

absl::StatusOr<OpenedMount> MountRegistry::Open(const std::string& uri,
                                                const MountContext& context) const {
  // Also without a mount: what is wrong in the file is said.
  MountOptions model;
  if (!context.config_file.empty()) {
    if (absl::Status loaded = model.LoadToml(context.config_file); !loaded.ok()) return loaded;
  }
  if (uri == kNone) return OpenedMount{};
  std::string rest;
  const MountDriver* driver = Find(uri, rest);
  if (driver == nullptr) return Unknown(uri);
  return driver->open(rest, model, context);
}

}  // namespace saccade
