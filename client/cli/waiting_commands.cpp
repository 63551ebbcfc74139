#include "client/cli/waiting_commands.hpp"

#include <absl/strings/str_cat.h>

#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>
#include <vector>

#include "client/cli/commands.hpp"
#include "client/cli/text.hpp"

namespace saccade::cli {
namespace {

nlohmann::json WaitingJson(const net::Waiting& person) {
  return {{"id", person.id},
          {"display_name", person.display_name},
          {"role", person.role},
          {"since_unix_s", person.since_unix_s},
          {"invite_id", person.invite_id},
          {"label", person.label}};
}

/// By id, or by a name that only one of them has: who guards a door goes by names.
absl::StatusOr<std::string> WaitingId(const std::string& who, net::AccessClient& client) {
  const absl::StatusOr<std::vector<net::Waiting>> people = client.WaitingRoom();
  if (!people.ok()) return people.status();
  std::vector<std::string> ids;
  for (const net::Waiting& person : *people) {
    if (person.id == who) return who;
    if (person.display_name == who) ids.push_back(person.id);
  }
  if (ids.size() == 1) return ids.front();
  return absl::NotFoundError(
      ids.empty() ? absl::StrCat("nobody called ", who, " waits; `saccade waiting` says who does")
                  : absl::StrCat(ids.size(), " called ", who,
                                 " wait; give the id that `saccade waiting` shows"));
}

}  // namespace

std::string TimeText(std::int64_t unix_s) {
  const std::time_t time = unix_s;
  std::tm parts{};
  localtime_r(&time, &parts);
  char text[32];
  return std::string(text, std::strftime(text, sizeof(text), "%Y-%m-%d %H:%M", &parts));
}

absl::Status RunWaiting(const Options& options, net::AccessClient& client) {
  const absl::StatusOr<std::vector<net::Waiting>> people = client.WaitingRoom();
  if (!people.ok()) return people.status();
  if (options.json) {
    nlohmann::json all = nlohmann::json::array();
    for (const net::Waiting& person : *people) all.push_back(WaitingJson(person));
    std::cout << Dump(all, 2) << "\n";
    return absl::OkStatus();
  }
  std::vector<std::vector<std::string>> rows = {{"id", "name", "role", "since", "invite", "label"}};
  for (const net::Waiting& person : *people) {
    rows.push_back({person.id, person.display_name, person.role, TimeText(person.since_unix_s),
                    person.invite_id, person.label});
  }
  std::cout << (people->empty() ? "nobody waits\n" : Table(rows));
  return absl::OkStatus();
}

absl::Status RunAdmit(const Options& options, net::AccessClient& client) {
  const absl::StatusOr<std::string> id = WaitingId(options.id, client);
  if (!id.ok()) return id.status();
  const absl::StatusOr<net::Waiting> person = client.Admit(*id, options.refuse);
  if (!person.ok()) return person.status();
  if (options.json) {
    std::cout << Dump(WaitingJson(*person)) << "\n";
  } else {
    std::cout << person->display_name
              << (options.refuse ? " was sent away\n"
                                 : absl::StrCat(" is in as ", person->role, "\n"));
  }
  return absl::OkStatus();
}

}  // namespace saccade::cli
