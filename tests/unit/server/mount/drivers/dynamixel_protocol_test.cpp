#include "server/mount/drivers/dynamixel_protocol.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace saccade::dynamixel::dynamixel_protocol_test {
namespace {

using ::testing::ElementsAre;

// Worked examples of the protocol's manual ("Instruction Packet", "Status Packet").
TEST(DynamixelProtocol, EncodesTheManualsExamples) {
  EXPECT_THAT(Encode(1, Instruction::kPing, {}),
              ElementsAre(0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4E));
  EXPECT_THAT(Encode(1, Instruction::kRead, Bytes{0x84, 0x00, 0x04, 0x00}),
              ElementsAre(0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x07, 0x00, 0x02, 0x84, 0x00, 0x04, 0x00,
                          0x1D, 0x15));
  EXPECT_THAT(Encode(1, Instruction::kWrite, Bytes{0x74, 0x00, 0x00, 0x02, 0x00, 0x00}),
              ElementsAre(0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x09, 0x00, 0x03, 0x74, 0x00, 0x00, 0x02,
                          0x00, 0x00, 0xCA, 0x89));
  EXPECT_THAT(Encode(kBroadcast, Instruction::kSyncRead, Bytes{0x84, 0x00, 0x04, 0x00, 0x01, 0x02}),
              ElementsAre(0xFF, 0xFF, 0xFD, 0x00, 0xFE, 0x09, 0x00, 0x82, 0x84, 0x00, 0x04, 0x00,
                          0x01, 0x02, 0xCE, 0xFA));
}

TEST(DynamixelProtocol, ParsesTheManualsAnswers) {
  AnswerParser parser;
  parser.Add(
      Bytes{0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x07, 0x00, 0x55, 0x00, 0x06, 0x04, 0x26, 0x65, 0x5D});
  parser.Add(Bytes{0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x08, 0x00, 0x55, 0x00, 0xA6, 0x00, 0x00, 0x00,
                   0x8C, 0xC0});
  const auto ping = parser.Next();
  ASSERT_TRUE(ping);
  EXPECT_EQ(ping->id, 1);
  EXPECT_EQ(ping->error, 0);
  EXPECT_THAT(ping->parameters, ElementsAre(0x06, 0x04, 0x26));
  const auto position = parser.Next();
  ASSERT_TRUE(position);
  EXPECT_EQ(SignedAt(position->parameters, 0, 4), 166);
  EXPECT_FALSE(parser.Next());
  EXPECT_EQ(parser.corrupt(), 0u);
}

/// An answer with any parameters: an instruction packet whose instruction is "status", whose first
/// parameter is the error.
Bytes AnswerOf(int id, std::uint8_t error, const Bytes& parameters) {
  Bytes all = {error};
  all.insert(all.end(), parameters.begin(), parameters.end());
  return Encode(id, Instruction::kStatus, all);
}

TEST(DynamixelProtocol, StuffsHeadersInParametersAndTakesThemOutAgain) {
  const Bytes tricky[] = {{0xFF, 0xFF, 0xFD},
                          {0xFF, 0xFF, 0xFD, 0xFD},
                          {0xFF, 0xFF, 0xFD, 0x00, 0xFF, 0xFF, 0xFD, 0x00},
                          {0xFF, 0xFF, 0xFF, 0xFD, 0xFF, 0xFF, 0xFD}};
  for (const Bytes& parameters : tricky) {
    const Bytes packet = AnswerOf(7, 0x80, parameters);
    // No header but the first.
    const Bytes header = {0xFF, 0xFF, 0xFD, 0x00};
    EXPECT_EQ(std::search(packet.begin() + 1, packet.end(), header.begin(), header.end()),
              packet.end());
    AnswerParser parser;
    parser.Add(packet);
    const auto answer = parser.Next();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->parameters, parameters);
    EXPECT_TRUE(answer->alert);
    EXPECT_EQ(answer->error, 0);
  }
  const Bytes write = Encode(1, Instruction::kWrite, Bytes{0x74, 0x00, 0xFF, 0xFF, 0xFD, 0x01});
  EXPECT_EQ(write[5], 10);  // the length counts the stuffing
  EXPECT_EQ(write[13], 0xFD);
}

TEST(DynamixelProtocol, LosesOnlyTheDamagedPacket) {
  const Bytes good = AnswerOf(2, 0, {1, 2, 3, 4});
  for (std::size_t k = 0; k < good.size(); ++k) {
    Bytes lost = good, turned = good;
    lost.erase(lost.begin() + static_cast<std::ptrdiff_t>(k));
    turned[k] ^= 0x04;
    for (const Bytes& damaged : {lost, turned}) {
      AnswerParser parser;
      parser.Add(damaged);
      parser.Add(AnswerOf(3, 0, {9}));
      // Where the length is damaged it may take more bytes to notice.
      for (int more = 0; more < 60; ++more) parser.Add(AnswerOf(4, 0, {5, 6}));
      std::vector<int> ids;
      while (const auto answer = parser.Next()) {
        ids.push_back(answer->id);
        if (answer->id == 2) {
          EXPECT_THAT(answer->parameters, ElementsAre(1, 2, 3, 4));
        }
      }
      EXPECT_EQ(std::count(ids.begin(), ids.end(), 2), 0) << "byte " << k;
      EXPECT_GE(std::count(ids.begin(), ids.end(), 4), 30) << "byte " << k;
    }
  }
}

TEST(DynamixelProtocol, SkipsEchoesAndSurvivesAnyBytes) {
  AnswerParser parser;
  parser.Add(Encode(1, Instruction::kPing, {}));
  parser.Add(AnswerOf(1, 0, {1, 2, 3}));
  const auto answer = parser.Next();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->parameters.size(), 3u);
  std::mt19937 rng(1);
  std::uniform_int_distribution<int> byte(0, 255), choice(0, 5);
  const Bytes header = {0xFF, 0xFF, 0xFD, 0x00};
  for (int k = 0; k < 20000; ++k) {
    if (choice(rng) == 0) parser.Add(header);
    parser.Add(Bytes{static_cast<std::uint8_t>(byte(rng))});
    while (parser.Next()) {
    }
  }
  for (int k = 0; k < 600; ++k) parser.Add(Bytes{0});  // ends whatever had begun
  while (parser.Next()) {
  }
  parser.Add(AnswerOf(9, 0, {7}));
  const auto after = parser.Next();
  ASSERT_TRUE(after);
  EXPECT_EQ(after->id, 9);
}

TEST(DynamixelProtocol, NumbersAreSignedAndLittleEndian) {
  Bytes bytes;
  Append(bytes, -2, 4);
  Append(bytes, 300, 2);
  EXPECT_THAT(bytes, ElementsAre(0xFE, 0xFF, 0xFF, 0xFF, 0x2C, 0x01));
  EXPECT_EQ(SignedAt(bytes, 0, 4), -2);
  EXPECT_EQ(SignedAt(bytes, 4, 2), 300);
}

}  // namespace
}  // namespace saccade::dynamixel::dynamixel_protocol_test
