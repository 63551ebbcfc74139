#include "server/rpc/persons.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "server/rpc/session_table.hpp"
#include "shared/wire/from_proto.hpp"

namespace saccade::persons_test {
namespace {

const std::string kAnn(32, 'a');
const std::string kBob(43, 'b');

v1::JoinRequest With(const std::string& key) {
  v1::JoinRequest request;
  request.set_person_key(key);
  return request;
}

TEST(Persons, AKeyIsNamedWhenItIsBadAndNeverQuoted) {
  SessionTable sessions;
  for (const std::string& bad : {std::string(31, 'k'), std::string(65, 'k'), std::string(40, ' '),
                                 "secret" + std::string(40, '/'), std::string(32, '\0')}) {
    const absl::Status status = sessions.Join(With(bad)).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), ::testing::StartsWith("person_key: "));
    EXPECT_THAT(std::string(status.message()), ::testing::Not(::testing::HasSubstr("secret")));
  }
  EXPECT_TRUE(sessions.Join(With(std::string(64, '_'))).ok());
  EXPECT_TRUE(sessions.Join(With("AZaz09-_AZaz09-_AZaz09-_AZaz09-_")).ok());
}

TEST(Persons, TheSameKeyIsTheSamePersonAndTellsNothingOfItself) {
  SessionTable sessions;
  const Session one = *sessions.Join(With(kAnn)), two = *sessions.Join(With(kAnn));
  EXPECT_NE(one.id, two.id);
  EXPECT_NE(one.participant_id, two.participant_id);
  EXPECT_EQ(one.person_id, two.person_id);
  EXPECT_EQ(one.color_rgba, two.color_rgba);
  EXPECT_NE(one.person_id, sessions.Join(With(kBob))->person_id);
  EXPECT_TRUE(wire::CheckUuid(one.person_id, "person_id").ok()) << one.person_id;
  EXPECT_EQ(one.person_id[14], '8');
  EXPECT_EQ(one.person_id.find("aaaa"), std::string::npos);
  EXPECT_EQ(PersonIdOf(kAnn), one.person_id) << "over a restart of the server, too";
}

TEST(Persons, WithoutAKeyEverySessionIsAnotherAndResumingGoesOnWithIt) {
  SessionTable sessions;
  const Session first = *sessions.Join({}), second = *sessions.Join({});
  EXPECT_NE(first.person_id, second.person_id);
  v1::JoinRequest again;
  again.set_resume_session_id(first.id);
  EXPECT_EQ(sessions.Join(again)->person_id, first.person_id);
  again.set_person_key(kAnn);
  EXPECT_EQ(sessions.Join(again)->person_id, PersonIdOf(kAnn));
  again.clear_person_key();
  EXPECT_EQ(sessions.Join(again)->person_id, PersonIdOf(kAnn)) << "it keeps what it was given";
}

TEST(Persons, HaveDifferentColoursAsLongAsThereAreSome) {
  SessionTable sessions;
  std::set<std::uint32_t> colors;
  std::vector<std::shared_ptr<void>> held;
  for (std::size_t i = 0; i < PersonColors().size(); ++i) {
    const Session session = *sessions.Join(With(std::string(32, static_cast<char>('a' + i))));
    held.push_back(sessions.Hold(session.id));
    EXPECT_TRUE(colors.insert(session.color_rgba).second) << i;
  }
  EXPECT_NE(sessions.Join(With(kBob))->color_rgba, 0u) << "then they share";
}

// Red, blue, yellow and green say where a feature comes from.
TEST(Persons, ColoursKeepOffThoseOfTheFeatures) {
  const auto part = [](std::uint32_t rgba, int i) {
    return static_cast<double>(rgba >> (24 - 8 * i) & 0xff);
  };
  for (const std::uint32_t color : PersonColors()) {
    EXPECT_EQ(color & 0xff, 0xffu);
    for (const std::uint32_t source : {0xff5a4dffu, 0x4da3ffffu, 0xffd84dffu, 0x5ae06affu}) {
      double square = 0;
      for (int i = 0; i < 3; ++i) square += std::pow(part(color, i) - part(source, i), 2);
      EXPECT_GT(std::sqrt(square), 60.0) << std::hex << color << " " << source;
    }
  }
}

}  // namespace
}  // namespace saccade::persons_test
