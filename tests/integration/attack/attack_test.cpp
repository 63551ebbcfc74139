#include "tests/integration/attack/attack_test.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <iostream>
#include <thread>

#include "saccade/v1/session.pb.h"

namespace saccade::testing {

void AttackTest::Begin(const TargetOptions& options) {
  // Our own peers are many; never more than these.
  const rlimit descriptors{4096, 4096};
  setrlimit(RLIMIT_NOFILE, &descriptors);
  target_ = std::make_unique<Target>(options);
  expert_ = std::make_unique<GoodExpert>(*target_);
  ASSERT_GT(expert_->received().poses, 0) << "no pose came to the good expert";
  expert_->PlaceMarks(kMarks, milliseconds(100));
}

void AttackTest::TearDown() {
  if (target_ == nullptr) return;
  ASSERT_TRUE(target_->Alive()) << target_->Obituary();
  // Twice more where the machine was late, not the server.
  std::string unwell = target_->Unwell();
  for (int i = 0; i < 2 && !unwell.empty() && target_->Alive(); ++i) unwell = target_->Unwell();
  EXPECT_EQ(unwell, "");
  EXPECT_EQ(expert_->Verdict(), "");
  EXPECT_EQ(expert_->marks(), kMarks);
  const Received got = expert_->received();
  std::cout << "note: seed " << kSeed << "; " << tally_.ToString() << "; the expert got "
            << got.poses << " poses, " << got.pictures << " pictures, placed " << expert_->marks()
            << " marks\n";
}

void AttackTest::Run(milliseconds span, const std::function<void(const Battle&)>& attack) {
  const Battle battle{*target_, kSeed, Clock::now() + span, tally_};
  std::thread thread([&] {
    GiveWay();
    attack(battle);
  });
  thread.join();
}

void AttackTest::SendAll(const std::vector<HttpCase>& cases) {
  for (const HttpCase& one : cases) {
    const std::string answer = AnswerTo(target_->http_port(), one.bytes, milliseconds(300));
    tally_.Add(answer);
    // A server that falls takes a moment to be gone.
    if (answer == "closed") std::this_thread::sleep_for(milliseconds(20));
    ASSERT_TRUE(target_->Alive() && answer != "refused") << one.name << ": " << target_->Obituary();
    const bool wanted = std::find(one.wanted.begin(), one.wanted.end(), answer) != one.wanted.end();
    EXPECT_TRUE(wanted) << one.name << " got " << answer;
  }
}

long AttackTest::SteadyMemory() {
  long before_kib = 0, now_kib = target_->vitals().rss_kib;
  for (int i = 0; i < 10 && now_kib > before_kib + 2048; ++i) {
    std::this_thread::sleep_for(seconds(2));
    before_kib = std::exchange(now_kib, target_->vitals().rss_kib);
  }
  return now_kib;
}

int AttackTest::Participants() {
  v1::GetStatusResponse response;
  const RawReply reply =
      Ask(target_->NewChannel(), "SessionService/GetStatus", v1::GetStatusRequest(), response);
  return reply.status.ok() ? response.presence().participants_size() : -1;
}

bool AttackTest::WaitForParticipants(int count, milliseconds limit) {
  const auto end = Clock::now() + limit;
  while (Participants() != count) {
    if (Clock::now() >= end) return false;
    std::this_thread::sleep_for(milliseconds(100));
  }
  return true;
}

}  // namespace saccade::testing
