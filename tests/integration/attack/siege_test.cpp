// Everything at once, while the good expert works.
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <thread>

#include "tests/integration/attack/attack_test.hpp"

namespace saccade::testing::siege_test {
namespace {

using Siege = AttackTest;

constexpr int kDefaultSeconds = 45;
// The map grows meanwhile, and gRPC keeps what the HTTP/2 attacks needed once: 120 MB, and next to
// nothing more the second time (Malformed.Http2IsRefusedAndNotKept).
constexpr long kGrownKib = 192 * 1024;

seconds Length() {
  const char* text = std::getenv("SACCADE_ATTACK_SECONDS");
  return seconds(text != nullptr ? std::atoi(text) : kDefaultSeconds);
}

struct Named {
  std::string name;
  std::function<void(const Battle&)> run;
};

std::vector<Named> Attacks() {
  return {
      {"http", SendMalformedHttp},
      {"http2", SendMalformedHttp2},
      {"fuzz", FuzzMethods},
      {"ghosts", [](const Battle& battle) { LeaveGhosts(battle); }},
      {"endless",
       [](const Battle& battle) {
         for (; !battle.over(); battle.Rest(seconds(2))) SendEndlessHttp(battle, 40);
       }},
      {"lists",
       [](const Battle& battle) {
         while (!battle.over()) ListWhileOthersEdit(battle, 20, seconds(5));
       }},
      {"streams", [](const Battle& battle) { HoldStreams(battle, 300); }},
      {"slow", [](const Battle& battle) { ReadSlowly(battle, 20); }},
      {"drip", [](const Battle& battle) { DripBytes(battle, 50, milliseconds(200)); }},
      {"descriptors", [](const Battle& battle) { UseUpDescriptors(battle, 1200, seconds(5)); }},
      {"joins", [](const Battle& battle) { Flood(battle, {JoinCall()}, 500); }},
      {"costly",
       [](const Battle& battle) {
         const auto channel = battle.target.NewChannel();
         Flood(battle, CostlyCalls(JoinSession(channel, 1, seconds(10))), 300);
       }},
  };
}

// All, or those that SACCADE_ATTACK_ONLY names ("ghosts,fuzz"): to find which one it was.
std::vector<Named> Wanted() {
  std::vector<Named> attacks = Attacks();
  if (const char* only = std::getenv("SACCADE_ATTACK_ONLY"); only != nullptr) {
    const std::vector<std::string> names = absl::StrSplit(only, ',');
    std::erase_if(attacks, [&](const Named& one) {
      return std::find(names.begin(), names.end(), one.name) == names.end();
    });
  }
  return attacks;
}

void Note(const char* when, const Vitals& vitals, int participants) {
  std::cout << "note: " << when << ": " << vitals.rss_kib / 1024 << " MiB, " << vitals.descriptors
            << " descriptors, " << vitals.threads << " threads, " << participants
            << " participants\n";
}

TEST_F(Siege, TheExpertLosesNothingAndTheServerIsAsBefore) {
  SteadyMemory();
  const Vitals before = target_->vitals();
  Note("before", before, Participants());
  const std::vector<Named> attacks = Wanted();
  PeakMemory peak(target_->pid());
  Run(Length(), [&](const Battle& battle) {
    std::vector<std::jthread> threads;
    for (const Named& attack : attacks) {
      threads.emplace_back([&attack, &battle] {
        GiveWay();
        attack.run(battle);
      });
    }
  });
  ASSERT_TRUE(target_->Alive()) << target_->Obituary();
  std::cout << "note: " << peak.kib() / 1024 << " MiB at the peak\n";
  EXPECT_TRUE(WaitForParticipants(1, seconds(40))) << Participants() << " participants";
  DeleteStrangersAnnotations(*target_);
  Vitals after = target_->vitals();
  // What was freed is given back every 10 s.
  for (int i = 0; i < 300 && (after.descriptors > before.descriptors + 4 ||
                              after.rss_kib > before.rss_kib + kGrownKib);
       ++i) {
    std::this_thread::sleep_for(milliseconds(100));
    after = target_->vitals();
  }
  Note("after", after, Participants());
  EXPECT_LE(after.rss_kib, before.rss_kib + kGrownKib);
  EXPECT_LE(after.descriptors, before.descriptors + 4);
  EXPECT_LE(after.threads, before.threads + 16);
}

}  // namespace
}  // namespace saccade::testing::siege_test
