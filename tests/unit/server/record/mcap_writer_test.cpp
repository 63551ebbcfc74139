// Files as the specification says, and what becomes of them when writing ends somewhere.
#include "server/record/mcap_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>
#include <zlib.h>

#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "server/record/mcap_reader.hpp"
#include "server/record/recorded_stream.hpp"

namespace saccade::mcap_writer_test {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::size_t kMagic = 8;

struct Record {
  int opcode = 0;
  std::size_t at = 0;
  std::string content;
};

template <typename T>
T NumberAt(const std::string& bytes, std::size_t at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

/// Whole records after the magic.
std::vector<Record> RecordsOf(const std::string& file) {
  std::vector<Record> records;
  for (std::size_t at = kMagic; at + 9 <= file.size();) {
    const auto size = NumberAt<std::uint64_t>(file, at + 1);
    if (size > file.size() - at - 9) break;
    records.push_back({static_cast<unsigned char>(file[at]), at, file.substr(at + 9, size)});
    at += 9 + size;
  }
  return records;
}

std::uint32_t Crc(const std::string& bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

class McapWriterTest : public ::testing::Test {
 protected:
  McapWriterTest()
      : file_(fs::path(::testing::TempDir()) /
              ("mcap_" + std::to_string(::getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::remove(file_);
  }
  ~McapWriterTest() override { fs::remove(file_); }
  std::string Read() const {
    std::ifstream in(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::unique_ptr<McapWriter> Make() {
    auto writer = McapWriter::Create(file_, "test");
    EXPECT_TRUE(writer.ok()) << writer.status();
    return *std::move(writer);
  }

  const fs::path file_;
};

TEST_F(McapWriterTest, AFileIsChunksWithChecksumsAndIndexesThenASummary) {
  {
    const auto writer = Make();
    writer->AddMetadata("from", {{"source", "sim:desk"}});
    const auto channel = writer->AddChannel(writer->AddSchema("a.B", "protobuf", "x"), "/b", "pb");
    ASSERT_TRUE(writer->Write(channel, 30, "one").ok());
    ASSERT_TRUE(writer->Write(channel, 20, "two").ok());
    ASSERT_TRUE(writer->Flush().ok());
    ASSERT_TRUE(writer->Write(channel, 40, "three").ok());
    ASSERT_TRUE(writer->Close().ok());
    EXPECT_EQ(writer->bytes(), fs::file_size(file_));
  }
  EXPECT_EQ(fs::status(file_).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  const std::string file = Read();
  EXPECT_EQ(file.substr(0, kMagic), std::string("\x89MCAP0\r\n", kMagic));
  EXPECT_EQ(file.substr(file.size() - kMagic), file.substr(0, kMagic));
  const std::vector<Record> records = RecordsOf(file);
  std::vector<int> opcodes;
  for (const Record& record : records) opcodes.push_back(record.opcode);
  EXPECT_THAT(opcodes, ElementsAre(1, 0x0c, 3, 4, 6, 7, 6, 7, 0x0f,  // data
                                   3, 4, 0x0b, 8, 8, 0x0d,           // summary
                                   0x0e, 0x0e, 0x0e, 0x0e, 0x0e, 2));
  const std::string& chunk = records[4].content;
  EXPECT_EQ(NumberAt<std::uint64_t>(chunk, 0), 20U) << "first time";
  EXPECT_EQ(NumberAt<std::uint64_t>(chunk, 8), 30U) << "last time";
  const std::string messages = chunk.substr(8 + 8 + 8 + 4 + 4 + 8);
  EXPECT_EQ(NumberAt<std::uint64_t>(chunk, 16), messages.size());
  EXPECT_EQ(NumberAt<std::uint32_t>(chunk, 24), Crc(messages));
  // The index of the first chunk leads to its second message.
  const std::string& index = records[5].content;
  EXPECT_EQ(NumberAt<std::uint32_t>(index, 2), 32U);
  EXPECT_EQ(NumberAt<std::uint64_t>(index, 6 + 16), 20U);
  const auto second = NumberAt<std::uint64_t>(index, 6 + 24);
  EXPECT_EQ(messages.substr(second + 9 + 22, 3), "two");
  // The summary's index leads to the chunk, and its own checksum holds.
  EXPECT_EQ(NumberAt<std::uint64_t>(records[12].content, 16), records[4].at);
  const std::string& footer = records.back().content;
  const auto begin = NumberAt<std::uint64_t>(footer, 0);
  EXPECT_EQ(begin, records[9].at);
  EXPECT_EQ(NumberAt<std::uint32_t>(footer, 16),
            Crc(file.substr(begin, records.back().at + 9 + 16 - begin)));
}

TEST_F(McapWriterTest, WhatWasFlushedIsThereWhateverHappensNext) {
  const auto writer = Make();
  const auto channel = writer->AddChannel(writer->AddSchema("a.B", "protobuf", "x"), "/b", "pb");
  ASSERT_TRUE(writer->Write(channel, 1, "kept").ok());
  ASSERT_TRUE(writer->Flush().ok());
  ASSERT_TRUE(writer->Write(channel, 2, "waits").ok());
  const std::string file = Read();  // as after kill -9
  EXPECT_THAT(file, HasSubstr("kept"));
  EXPECT_EQ(file.find("waits"), std::string::npos);
  EXPECT_EQ(RecordsOf(file).back().opcode, 7) << "nothing is cut";
  // A chunk that is large enough needs nobody to flush it.
  ASSERT_TRUE(writer->Write(channel, 3, std::string(2 << 20, 'x')).ok());
  EXPECT_THAT(Read(), HasSubstr("waits"));
}

TEST_F(McapWriterTest, AFullDiskIsSaidWithTheRemedy) {
  EXPECT_EQ(McapWriter::Create("/nowhere/a.mcap", "test").status().code(),
            absl::StatusCode::kUnavailable);
  const auto writer = Make();
  EXPECT_FALSE(McapWriter::Create(file_, "test").ok()) << "never in place of another";
  const auto channel = writer->AddChannel(writer->AddSchema("a.B", "protobuf", "x"), "/b", "pb");
  // As a full disk: no file may be larger.
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{64 * 1024, before.rlim_max};
  std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  ASSERT_TRUE(writer->Write(channel, 1, std::string(100'000, 'x')).ok());
  const absl::Status full = writer->Flush();
  const absl::Status after = writer->Write(channel, 2, "more");
  const absl::Status closed = writer->Close();
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted) << full;
  EXPECT_THAT(std::string(full.message()), HasSubstr("make room"));
  EXPECT_EQ(after, full);
  EXPECT_EQ(closed, full);
}

TEST_F(McapWriterTest, WhatIsCutOffIsReadToItsLastWholeChunkAndDamageIsSaid) {
  {
    const auto writer = Make();
    const auto channel = writer->AddChannel(writer->AddSchema("a.B", "protobuf", "x"), "/b", "pb");
    for (int k = 0; k < 12; ++k) {
      ASSERT_TRUE(writer->Write(channel, 100 + k, std::to_string(k)).ok());
      if (k % 3 == 2) {
        ASSERT_TRUE(writer->Flush().ok());
      }
    }
  }
  const std::string whole = Read();
  std::vector<std::string> read;
  const auto read_all = [&](const std::string& bytes) -> absl::Status {
    std::ofstream(file_, std::ios::binary) << bytes;
    read.clear();
    const auto reader = McapReader::Open(file_);
    if (!reader.ok()) return reader.status();
    return (*reader)->Read(
        (*reader)->first_ns(), (*reader)->last_ns(),
        [&](const McapReader::Message& message) { read.emplace_back(message.data); });
  };
  ASSERT_TRUE(read_all(whole).ok());
  ASSERT_EQ(read.size(), 12U);
  EXPECT_EQ(read[11], "11");
  std::size_t most = 0;
  for (std::size_t size = kMagic; size < whole.size(); size += 3) {
    ASSERT_TRUE(read_all(whole.substr(0, size)).ok()) << size;
    EXPECT_EQ(read.size() % 3, 0U) << "whole chunks alone";
    EXPECT_GE(read.size(), most);
    most = std::max(most, read.size());
  }
  EXPECT_EQ(most, 12U);
  int refused = 0;
  for (std::size_t at = 0; at < whole.size(); at += 3) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x41);
    if (!read_all(damaged).ok()) ++refused;
    for (const std::string& each : read) {
      EXPECT_TRUE(!each.empty() && each.size() <= 2 && each < "9z") << at;
    }
  }
  EXPECT_GT(refused, 40);
  // Between two times: by the index.
  ASSERT_TRUE(read_all(whole).ok());
  const auto reader = McapReader::Open(file_);
  std::vector<Timestamp> times;
  ASSERT_TRUE(
      (*reader)
          ->Read(104, 106, [&](const McapReader::Message& m) { times.push_back(m.time_ns); })
          .ok());
  EXPECT_THAT(times, ElementsAre(104, 105, 106));
}

TEST(RecordQueue, TakesNoMoreThanItMay) {
  RecordQueue queue(100);
  const auto push = [&queue](std::size_t bytes) {
    RecordedEvent event;
    event.event.tail = std::string(bytes, 'x');
    queue.Push(std::move(event));
  };
  push(60);
  push(60);
  push(40);
  EXPECT_EQ(queue.lost(), 1U);
  EXPECT_EQ(queue.TakeAll(std::chrono::milliseconds(0)).size(), 2U);
  push(100);
  EXPECT_EQ(queue.lost(), 1U) << "there is room again";
}

}  // namespace
}  // namespace saccade::mcap_writer_test
