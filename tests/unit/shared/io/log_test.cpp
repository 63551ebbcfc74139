#include "shared/io/log.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <regex>
#include <string>
#include <thread>
#include <vector>

namespace saccade::log_test {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

using Clock = std::chrono::steady_clock;
constexpr std::chrono::seconds kLong(10);

class Pipe {
 public:
  Pipe() { EXPECT_EQ(pipe2(ends_, O_CLOEXEC), 0); }
  ~Pipe() {
    close(ends_[0]);
    close(ends_[1]);
  }
  int in() const { return ends_[1]; }
  /// What is in it now.
  std::string Read() const {
    fcntl(ends_[0], F_SETFL, O_NONBLOCK);
    std::string text;
    char buffer[4096];
    for (ssize_t count = 0; (count = read(ends_[0], buffer, sizeof buffer)) > 0;) {
      text.append(buffer, static_cast<std::size_t>(count));
    }
    return text;
  }

 private:
  int ends_[2] = {-1, -1};
};

/// The sum of what the lines about lost lines say: one is told whenever there was room again.
std::uint64_t ToldDropped(const std::string& text) {
  static const std::regex told("log: ([0-9]+) lines dropped");
  std::uint64_t sum = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), told), end; it != end; ++it) {
    sum += std::stoull((*it)[1]);
  }
  return sum;
}

TEST(LineWriter, WritesLinesInOrder) {
  const Pipe pipe;
  LineWriter writer(pipe.in());
  writer.Write("one");
  writer.Write("two");
  ASSERT_TRUE(writer.Flush(kLong));
  EXPECT_EQ(pipe.Read(), "one\ntwo\n");
}

TEST(LineWriter, NeverWaitsForAReaderAndSaysWhatIsLost) {
  const Pipe pipe;  // 64 KiB, and nobody reads
  LineWriter writer(pipe.in(), 100'000);
  const std::string line(100, 'x');
  const Clock::time_point begin = Clock::now();
  for (int i = 0; i < 10'000; ++i) writer.Write(line);
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(2));
  EXPECT_FALSE(writer.Flush(std::chrono::milliseconds(50)));
  const std::uint64_t dropped = writer.dropped();
  EXPECT_GT(dropped, 8000u);
  std::string read;
  for (int i = 0; i < 1000 && !writer.Flush(std::chrono::milliseconds(10)); ++i) {
    read += pipe.Read();
  }
  writer.Write("after");
  ASSERT_TRUE(writer.Flush(kLong));
  read += pipe.Read();
  EXPECT_EQ(ToldDropped(read), dropped);
  EXPECT_THAT(read, EndsWith(" lines dropped: nobody read them in time\nafter\n"));
}

TEST(LineWriter, EndsWhileNobodyReads) {
  const Pipe pipe;
  const Clock::time_point begin = Clock::now();
  {
    LineWriter writer(pipe.in());
    for (int i = 0; i < 1000; ++i) writer.Write(std::string(1000, 'x'));
  }
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(2));
}

TEST(LineWriter, WordsOfOthersCannotMakeLines) {
  const Pipe pipe;
  LineWriter writer(pipe.in());
  writer.Write("name=Eve\n2026-11-28 rpc Delete ok\r\x1b[2J\x7f");
  writer.Write(std::string(100'000, 'y'));
  writer.Write(std::string("a\0b", 3));
  ASSERT_TRUE(writer.Flush(kLong));
  const std::string read = pipe.Read();
  EXPECT_THAT(read, HasSubstr("name=Eve\\x0a2026-11-28 rpc Delete ok\\x0d\\x1b[2J\\x7f\n"));
  EXPECT_THAT(read, HasSubstr("yyy...\n"));
  EXPECT_THAT(read, EndsWith("a\\x00b\n"));
  EXPECT_EQ(std::count(read.begin(), read.end(), '\n'), 3);
}

TEST(LineWriter, ManyThreadsLoseNothingWhileThereIsRoom) {
  const Pipe pipe;
  LineWriter writer(pipe.in());
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&writer] {
        for (int k = 0; k < 500; ++k) writer.Write("word");
      });
    }
  }
  ASSERT_TRUE(writer.Flush(kLong));
  const std::string read = pipe.Read();
  EXPECT_EQ(std::count(read.begin(), read.end(), '\n'), 2000);
}

TEST(Printable, LeavesNothingThatAReaderCouldMistake) {
  EXPECT_EQ(Printable("plain 'text'"), "plain 'text'");
  EXPECT_EQ(Printable("a\nb\\n\xe2\x80\xa8"), "a\\x0ab\\x5cn\\xe2\\x80\\xa8");
}

}  // namespace
}  // namespace saccade::log_test
