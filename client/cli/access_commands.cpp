#include "client/cli/access_commands.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <unistd.h>

#include <ctime>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "client/cli/access_files.hpp"
#include "client/cli/commands.hpp"
#include "client/cli/text.hpp"
#include "client/cli/waiting_commands.hpp"
#include "client/net/access_client.hpp"
#include "client/net/trust.hpp"
#include "shared/io/qr_code.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade::cli {
namespace {

constexpr std::size_t kMaxPemBytes = 64 * 1024;

/// "90s", "30m", "8h", "7d" in seconds; nothing: not of that form.
std::optional<std::uint32_t> ParseLife(absl::string_view text) {
  if (text.size() < 2) return std::nullopt;
  constexpr std::uint64_t kMost_s = 366 * 86'400;
  std::uint64_t number = 0;
  if (!absl::SimpleAtoi(text.substr(0, text.size() - 1), &number) || number > kMost_s) {
    return std::nullopt;
  }
  const std::uint64_t unit_s = text.back() == 's'   ? 1
                               : text.back() == 'm' ? 60
                               : text.back() == 'h' ? 3600
                               : text.back() == 'd' ? 86'400
                                                    : 0;
  if (unit_s == 0 || number * unit_s > kMost_s) return std::nullopt;
  return static_cast<std::uint32_t>(number * unit_s);
}

CLI::Validator Life() {
  return CLI::Validator(
      [](std::string& text) {
        const auto life_s = ParseLife(text);
        return life_s && *life_s >= 60 && *life_s <= 31'536'000
                   ? std::string()
                   : absl::StrCat("'", text, "' is not a time from 60s to 365d, like 8h");
      },
      "TIME");
}

std::string StateOf(const net::Invite& invite) {
  if (invite.revoked) return "revoked";
  if (std::time(nullptr) >= invite.expires_unix_s) return invite.person ? "signed out" : "expired";
  if (invite.person) return "signed in";
  return invite.used >= invite.uses ? "used up" : "open";
}

nlohmann::json InviteJson(const net::Invite& invite) {
  return {{"id", invite.id},
          {"role", invite.role},
          {"label", invite.label},
          {"created_unix_s", invite.created_unix_s},
          {"expires_unix_s", invite.expires_unix_s},
          {"waiting_room", invite.waiting_room},
          {"person", invite.person},
          {"uses", invite.uses},
          {"used", invite.used},
          {"state", StateOf(invite)}};
}

absl::Status RunTrust(const Options& options) {
  absl::StatusOr<std::string> root = absl::NotFoundError("");
  if (options.from.empty()) {
    const std::filesystem::path data_dir =
        options.data_dir.empty() ? DefaultDataDir() : std::filesystem::path(options.data_dir);
    root = ReadRegularFile(data_dir / "tls/authority.pem", kMaxPemBytes, "a certificate");
    if (!root.ok()) {
      return absl::NotFoundError(
          absl::StrCat(root.status().message(),
                       "; a server makes it when it first serves beyond loopback; name "
                       "its --data-dir, or --from HOST:HTTP_PORT of a running one"));
    }
  } else {
    root = net::FetchRoot(options.from);
    if (!root.ok()) return root.status();
  }
  root = net::OneRoot(*root);
  if (!root.ok()) return root.status();
  const absl::StatusOr<std::string> fingerprint = net::Fingerprint(*root);
  if (!fingerprint.ok()) return fingerprint.status();
  if (!options.out.empty()) {
    if (absl::Status written = WriteFile(options.out, *root); !written.ok()) return written;
  }
  if (options.json) {
    std::cout << Dump({{"out", options.out}, {"sha256", *fingerprint}, {"pem", *root}}) << "\n";
  } else if (options.fingerprint || !options.out.empty()) {
    std::cout << *fingerprint << "\n";
  } else {
    std::cout << *root;
  }
  return absl::OkStatus();
}

absl::Status RunInvite(const Options& options, net::AccessClient& client) {
  const std::uint32_t life_s = options.life.empty() ? 0 : *ParseLife(options.life);
  const absl::StatusOr<net::NewInvite> made =
      client.Create(options.invite_role, life_s, options.uses, options.label, options.waiting_room);
  if (!made.ok()) return made.status();
  if (options.json) {
    nlohmann::json json = InviteJson(made->invite);
    json["link"] = made->link;
    std::cout << Dump(json) << "\n";
    return absl::OkStatus();
  }
  std::cout << made->link << "\n";
  if (::isatty(STDOUT_FILENO) == 0) return absl::OkStatus();
  for (const std::string& line : QrCodeLines(made->link)) std::cout << line << "\n";
  std::cout << absl::StrFormat("%s %s, %d use%s, until %s; ends with: saccade revoke %s\n",
                               made->invite.id, made->invite.role, made->invite.uses,
                               made->invite.uses == 1 ? "" : "s",
                               TimeText(made->invite.expires_unix_s), made->invite.id);
  return absl::OkStatus();
}

absl::Status RunInvites(const Options& options, net::AccessClient& client) {
  const absl::StatusOr<std::vector<net::Invite>> invites = client.List();
  if (!invites.ok()) return invites.status();
  if (options.json) {
    nlohmann::json all = nlohmann::json::array();
    for (const net::Invite& invite : *invites) all.push_back(InviteJson(invite));
    std::cout << Dump(all, 2) << "\n";
    return absl::OkStatus();
  }
  std::vector<std::vector<std::string>> rows = {{"id", "role", "state", "used", "until", "label"}};
  for (const net::Invite& invite : *invites) {
    rows.push_back({invite.id, invite.role, StateOf(invite),
                    invite.person ? absl::StrCat(invite.used, " times")
                                  : absl::StrCat(invite.used, " of ", invite.uses),
                    TimeText(invite.expires_unix_s), invite.label});
  }
  std::cout << (invites->empty() ? "no invites\n" : Table(rows));
  return absl::OkStatus();
}

absl::Status RunRevoke(const Options& options, net::AccessClient& client) {
  const absl::StatusOr<int> ended = client.Revoke(options.id, options.undo);
  if (!ended.ok()) return ended.status();
  if (options.json) {
    std::cout << Dump({{"id", options.id}, {"passes", *ended}}) << "\n";
  } else if (options.undo) {
    std::cout << absl::StrFormat("%s may sign in again\n", options.id);
  } else {
    std::cout << absl::StrFormat("%s is revoked; %d pass%s ended with it\n", options.id, *ended,
                                 *ended == 1 ? "" : "es");
  }
  return absl::OkStatus();
}

absl::Status RunAudit(const Options& options, net::AccessClient& client) {
  const absl::StatusOr<std::vector<net::AuditEntry>> entries = client.Audit(options.most);
  if (!entries.ok()) return entries.status();
  if (options.json) {
    nlohmann::json all = nlohmann::json::array();
    for (const net::AuditEntry& entry : *entries) {
      all.push_back({{"unix_ms", entry.unix_ms},
                     {"participant_id", entry.participant_id},
                     {"display_name", entry.display_name},
                     {"invite_id", entry.invite_id},
                     {"call", entry.call},
                     {"outcome", entry.outcome}});
    }
    std::cout << Dump(all, 2) << "\n";
    return absl::OkStatus();
  }
  std::vector<std::vector<std::string>> rows = {{"time", "who", "invite", "call", "outcome"}};
  for (const net::AuditEntry& entry : *entries) {
    rows.push_back({TimeText(entry.unix_ms / 1000), entry.display_name, entry.invite_id, entry.call,
                    entry.outcome});
  }
  std::cout << (entries->empty() ? "nothing was done yet\n" : Table(rows));
  return absl::OkStatus();
}

}  // namespace

void AddAccess(CLI::App& app, Options& options) {
  CLI::Option* trust = app.add_option(
      "--trust", options.trust, "PEM file of whom to trust (else the system's store); means TLS");
  CLI::Option* tls = app.add_flag("--tls", options.tls,
                                  "TLS on loopback, too (elsewhere it is what no word means)");
  app.add_flag("--plain", options.plain, "No TLS: for a server with --insecure")
      ->excludes(trust)
      ->excludes(tls);
  app.add_option("--invite", options.invite,
                 "Link or token that lets you in; its pass is kept for later runs");
  app.add_option("--id-token", options.id_token_file,
                 "File (-: standard input) with an ID token of your firm's provider, instead of an "
                 "invite; the pass is kept for later runs")
      ->excludes("--invite");
  app.add_option("--data-dir", options.data_dir,
                 "Of the server on this machine (trust, invite, invites, revoke)");
  CLI::App* root = app.add_subcommand("trust", "Export the root of a server's own authority (PEM)");
  root->add_option("--out", options.out, "Write it to this file, and print its fingerprint");
  root->add_option("--from", options.from, "HOST:PORT of a running server's page, else --data-dir");
  root->add_flag("--fingerprint", options.fingerprint, "Print only its SHA-256, to compare");
  CLI::App* invite = app.add_subcommand("invite", "Make a link that lets somebody in");
  invite->add_option("--role", options.invite_role, "viewer, annotator, pilot or wearer")
      ->check(CLI::IsMember({"viewer", "annotator", "pilot", "wearer"}))
      ->required();
  invite->add_option("--life", options.life, "How long it holds: 30m, 8h, 7d (8h)")->check(Life());
  invite->add_option("--uses", options.uses, "How many people it lets in")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  invite->add_option("--label", options.label, "Who it is for, at most 60 bytes");
  invite->add_flag("--wait", options.waiting_room, "Who comes by it waits to be let in");
  app.add_subcommand("waiting", "Who waits to be let in");
  CLI::App* admit = app.add_subcommand("admit", "Let somebody in who waits");
  admit->add_option("who", options.id, "Their name or id, as `saccade waiting` shows it")
      ->required();
  admit->add_flag("--refuse", options.refuse, "Send them away instead");
  app.add_subcommand("invites", "The invites of the server");
  CLI::App* audit = app.add_subcommand("audit", "Who did what, as far as the server keeps it");
  audit->add_option("--most", options.most, "So many of the newest")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  CLI::App* revoke = app.add_subcommand(
      "revoke", "End an invite or a person's sign-in, and throw out who came in by it");
  revoke->add_option("id", options.id, "Its id, as `saccade invites` shows it")->required();
  revoke->add_flag("--undo", options.undo, "Of a person who signs in: let them sign in again");
}

bool IsAccessCommand(Command command) {
  return command == Command::kTrust || command == Command::kInvite ||
         command == Command::kInvites || command == Command::kRevoke ||
         command == Command::kAudit || command == Command::kWaiting || command == Command::kAdmit;
}

absl::Status RunAccess(const Options& options) {
  if (options.command == Command::kTrust) return RunTrust(options);
  // The server that this user runs: its address, too, is in owner.json.
  const absl::StatusOr<KeptAccess> owner = LoadOwner(
      options.data_dir.empty() ? DefaultDataDir() : std::filesystem::path(options.data_dir));
  if (!owner.ok()) return owner.status();
  net::ConnectionOptions to = options.connection;
  to.server = owner->server;
  to.tls = owner->tls;
  to.root_pem = owner->root_pem;
  to.tls_name = owner->name;
  to.token = owner->token;
  if (!options.trust.empty()) {
    absl::StatusOr<std::string> root =
        ReadRegularFile(options.trust, kMaxPemBytes, "a certificate");
    if (!root.ok()) return root.status();
    to.root_pem = *std::move(root);
  }
  net::AccessClient client(to);
  switch (options.command) {
    case Command::kInvite:
      return RunInvite(options, client);
    case Command::kInvites:
      return RunInvites(options, client);
    case Command::kAudit:
      return RunAudit(options, client);
    case Command::kWaiting:
      return RunWaiting(options, client);
    case Command::kAdmit:
      return RunAdmit(options, client);
    default:
      return RunRevoke(options, client);
  }
}

}  // namespace saccade::cli
