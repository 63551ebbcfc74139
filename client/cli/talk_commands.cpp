#include "client/cli/talk_commands.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <ctime>
#include <iostream>

#include "client/cli/option_values.hpp"
#include "client/cli/session_file.hpp"
#include "client/cli/text.hpp"
#include "client/cli/waiting_commands.hpp"

namespace saccade::cli {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

nlohmann::json ChatJson(const net::ChatMessage& message) {
  return {{"number", message.number},
          {"display_name", message.display_name},
          {"text", message.text},
          {"annotation_id", message.annotation_id},
          {"sent_unix_ns", absl::StrCat(message.sent_unix_ns)}};
}

std::string Line(const net::ChatMessage& message) {
  std::string text = message.text;
  std::replace(text.begin(), text.end(), '\n', ' ');
  if (!message.annotation_id.empty()) {
    text = text.empty() ? absl::StrCat("look at mark ", message.annotation_id)
                        : absl::StrCat(text, "  (mark ", message.annotation_id, ")");
  }
  return absl::StrCat(TimeText(message.sent_unix_ns / kSecond_ns), "  ", message.display_name, ": ",
                      text);
}

void Print(const Options& options, const net::ChatMessage& message) {
  std::cout << (options.json ? Dump(ChatJson(message)) : Line(message)) << std::endl;
}

absl::Status RunPause(const Options& options, net::Connection& client) {
  const absl::StatusOr<net::PicturePause> state = client.PausePicture(options.pause);
  if (!state.ok()) return state.status();
  if (options.json) {
    std::cout << Dump({{"paused", state->paused},
                       {"by", state->by},
                       {"since_unix_ns", absl::StrCat(state->since_unix_ns)}})
              << "\n";
  } else if (state->paused) {
    std::cout << absl::StrCat("paused by ", state->by, " since ",
                              TimeText(state->since_unix_ns / kSecond_ns),
                              ": nobody is shown a picture; the map stays live\n");
  } else {
    std::cout << "pictures are shown\n";
  }
  return absl::OkStatus();
}

absl::Status RunMessages(const Options& options, net::Connection& client) {
  const auto print = [&options](const net::ChatMessage& message) {
    Print(options, message);
    return true;
  };
  if (options.follow) return client.FollowChat(print);
  const absl::StatusOr<std::vector<net::ChatMessage>> kept = client.Messages();
  if (!kept.ok()) return kept.status();
  for (const net::ChatMessage& message : *kept) print(message);
  return absl::OkStatus();
}

// The one annotation whose id begins so.
absl::StatusOr<std::string> FullId(const std::string& prefix, const Options& options) {
  const auto connection = net::Connection::Create(options.connection);
  if (!connection.ok()) return connection.status();
  const absl::StatusOr<std::vector<Annotation>> all = (*connection)->ListAnnotations();
  if (!all.ok()) return all.status();
  std::vector<std::string> found;
  for (const Annotation& one : *all) {
    if (absl::StartsWith(one.id, prefix)) found.push_back(one.id);
  }
  if (found.size() == 1) return found.front();
  return absl::NotFoundError(absl::StrCat(
      found.empty() ? "there is no annotation '" : "more than one annotation begins with '", prefix,
      "'; 'saccade annotations' lists those there are"));
}

absl::Status RunSay(const Options& options, net::Connection& client) {
  std::string mark;
  if (!options.id.empty()) {
    const absl::StatusOr<std::string> id = FullId(options.id, options);
    if (!id.ok()) return id.status();
    mark = *id;
  }
  const absl::StatusOr<net::ChatMessage> said = client.Say(options.text, mark);
  if (said.ok()) Print(options, *said);
  return said.status();
}

}  // namespace

void AddTalk(CLI::App& app, Options& options) {
  CLI::App* say = app.add_subcommand("say", "Say something to everybody there");
  say->add_option("text", options.text, "At most 500 bytes")->required()->check(Utf8());
  say->add_option("--annotation", options.id, "A mark to look at: its id, or the beginning of it");
  CLI::App* messages = app.add_subcommand("messages", "What was said: the last 500");
  messages->add_flag("--follow", options.follow, "Go on with what is said, until Ctrl-C");
  CLI::App* pause = app.add_subcommand(
      "pause-picture",
      "As the wearer: nobody is shown video, stills or snapshots; tracking goes on");
  pause
      ->add_option_function<std::string>(
          "state", [&options](const std::string& word) { options.pause = word == "on"; },
          "on or off")
      ->required()
      ->check(CLI::IsMember({"on", "off"}));
}

bool IsTalkCommand(Command command) {
  return command == Command::kSay || command == Command::kMessages ||
         command == Command::kPausePicture;
}

absl::Status RunTalk(const Options& options) {
  net::ConnectionOptions to = options.connection;
  const bool pauses = options.command == Command::kPausePicture;
  const bool own = pauses || options.follow;  // a session of its own
  if (pauses) to.role = net::Role::kWearer;
  to.session_id = own ? "" : LoadSession(to.server, to.display_name);
  const auto made = net::Connection::Create(to);
  if (!made.ok()) return made.status();
  net::Connection& client = **made;
  if (const auto joined = client.JoinAnew(); !joined.ok()) return joined.status();
  if (!own && client.session_id() != to.session_id) {
    SaveSession(to.server, to.display_name, client.session_id());
  }
  if (pauses) return RunPause(options, client);
  return options.command == Command::kSay ? RunSay(options, client) : RunMessages(options, client);
}

}  // namespace saccade::cli
