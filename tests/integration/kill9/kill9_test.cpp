// What the server answered is on disk, whenever it is killed.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <iostream>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <thread>

#include "client/net/connection.hpp"
#include "tests/integration/support/process.hpp"
#include "tests/integration/support/small_dataset.hpp"

namespace saccade::testing::kill9_test {
namespace {

constexpr int kAnsweredEdits = 100;
constexpr unsigned kSeed = 7;

// What must be there: what was answered. The one edit that was cut off may have happened or not.
struct Expected {
  std::map<std::string, std::string> text_of;  // id -> text
  struct CutOff {
    std::string id;    // empty: a creation
    std::string text;  // what it would be now; of a deletion the text before
    bool deletion = false;
  };
  std::optional<CutOff> cut_off;
};

std::string AnyId(const Expected& expected, std::mt19937& random) {
  auto at = expected.text_of.begin();
  std::advance(at,
               std::uniform_int_distribution<std::size_t>(0, expected.text_of.size() - 1)(random));
  return at->first;
}

// One random edit; true if it was answered.
bool Edit(net::Connection& connection, int number, std::mt19937& random, Expected& expected) {
  const std::string text = "edit " + std::to_string(number);
  const int kind = expected.text_of.size() < 3 ? 0 : std::uniform_int_distribution(0, 3)(random);
  if (kind <= 1) {
    AnnotationDraft draft;
    draft.text = text;
    draft.target = PointTarget{{0.01 * number, 0, 1}};
    expected.cut_off = {{"", text, false}};
    const absl::StatusOr<Annotation> created = connection.CreateAnnotation(draft);
    if (!created.ok()) return false;
    expected.text_of[created->id] = text;
  } else if (kind == 2) {
    AnnotationPatch patch;
    patch.id = AnyId(expected, random);
    patch.text = text;
    expected.cut_off = {{patch.id, text, false}};
    if (!connection.UpdateAnnotation(patch).ok()) return false;
    expected.text_of[patch.id] = text;
  } else {
    const std::string id = AnyId(expected, random);
    expected.cut_off = {{id, expected.text_of[id], true}};
    if (!connection.DeleteAnnotation(id).ok()) return false;
    expected.text_of.erase(id);
  }
  expected.cut_off.reset();
  return true;
}

// Compares what the restarted server holds with what was answered, and settles the edit in doubt.
void Check(net::Connection& connection, Expected& expected) {
  const absl::StatusOr<std::vector<Annotation>> all = connection.ListAnnotations();
  ASSERT_TRUE(all.ok()) << all.status();
  std::map<std::string, std::string> found;
  for (const Annotation& annotation : *all) found[annotation.id] = annotation.text;
  const auto doubt = expected.cut_off;
  for (const auto& [id, text] : expected.text_of) {
    const bool doubtful = doubt && doubt->id == id;
    if (doubtful && doubt->deletion && !found.contains(id)) continue;
    ASSERT_TRUE(found.contains(id)) << id << " '" << text << "' was answered and is missing";
    if (doubtful && found[id] == doubt->text) continue;
    EXPECT_EQ(found[id], text) << id << " is not what was answered";
  }
  for (const auto& [id, text] : found) {
    const bool created_in_doubt = doubt && doubt->id.empty() && text == doubt->text;
    EXPECT_TRUE(expected.text_of.contains(id) || created_in_doubt)
        << id << " '" << text << "' is there and was deleted, or never asked for";
  }
  expected.text_of = found;
  expected.cut_off.reset();
}

TEST(Kill9, NothingThatWasAnsweredIsMissing) {
  TemporaryFolder folder;
  WriteSmallDataset(folder / "set", {.frames = 60});
  const std::vector<std::string> arguments = {"--source", "dataset:" + (folder / "set"),
                                              "--data-dir", folder / "data"};
  std::mt19937 random(kSeed);
  Expected expected;
  int answered = 0, number = 0, kills = 0;
  auto server = std::make_unique<Server>(arguments);
  while (answered < kAnsweredEdits) {
    auto connection = net::Connection::Create({.server = server->grpc(), .session_id = ""});
    ASSERT_TRUE(connection.ok()) << connection.status();
    // The kill falls at any point of an edit: before it, within it, after its commit.
    std::atomic<bool> stop{false};
    const auto delay =
        std::chrono::microseconds(std::uniform_int_distribution(2'000, 120'000)(random));
    std::thread killer([&] {
      std::this_thread::sleep_for(delay);
      server->process().Signal(SIGKILL);
      stop = true;
    });
    while (Edit(**connection, ++number, random, expected)) ++answered;
    killer.join();
    ++kills;
    EXPECT_TRUE(stop) << "an edit was refused by a living server";
    ASSERT_EQ(server->process().Wait(std::chrono::seconds(5)), 128 + SIGKILL);
    server = std::make_unique<Server>(arguments);
    auto again = net::Connection::Create({.server = server->grpc(), .session_id = ""});
    ASSERT_TRUE(again.ok());
    Check(**again, expected);
    if (HasFatalFailure()) return;
    ASSERT_LT(kills, 60) << "the server answers too few edits between two kills";
  }
  std::cout << "note: " << answered << " edits answered, " << kills
            << " kills, nothing answered is missing\n";
  server->process().Signal(SIGTERM);
  EXPECT_EQ(server->process().Wait(std::chrono::seconds(5)), 0);
}

}  // namespace
}  // namespace saccade::testing::kill9_test
