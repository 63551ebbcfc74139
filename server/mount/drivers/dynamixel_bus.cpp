#include "server/mount/drivers/dynamixel_bus.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>

namespace saccade::dynamixel {
namespace {

constexpr int kTries = 3;
constexpr std::size_t kAnswerOverhead = 11;  // header, id, length, instruction, error, CRC
constexpr double kBitsPerByte = 10;          // 8N1

}  // namespace

SerialLine::Clock::time_point Bus::Deadline(std::size_t bytes) const {
  const double seconds = static_cast<double>(bytes) * kBitsPerByte / baud_ + answer_timeout_s_;
  return SerialLine::Clock::now() +
         std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * seconds));
}

absl::Status Bus::Send(const Bytes& packet) {
  // Late answers to a question of before would be taken for answers to this one.
  parser_.Clear();
  line_.DropInput();
  return line_.Write(packet, Deadline(packet.size()));
}

absl::StatusOr<Answer> Bus::Ask(int id, Instruction instruction,
                                std::span<const std::uint8_t> parameters, int answer_size) {
  absl::Status problem;
  const Bytes packet = Encode(id, instruction, parameters);
  for (int k = 0; k < kTries; ++k) {
    problem = Send(packet);
    const auto deadline =
        Deadline(packet.size() + kAnswerOverhead + static_cast<std::size_t>(answer_size));
    while (problem.ok()) {
      const std::optional<Answer> answer = parser_.Next();
      if (!answer) {
        Bytes bytes;
        problem = line_.Read(bytes, deadline);
        parser_.Add(bytes);
        continue;
      }
      if (answer->id != id) continue;
      if (answer->error == 0 && std::ssize(answer->parameters) == answer_size) return *answer;
      problem =
          absl::FailedPreconditionError(absl::StrCat("servo ", id, ": ", ErrorText(answer->error)));
    }
    if (absl::IsUnavailable(problem)) break;
  }
  return problem;
}

absl::Status Bus::Ping(int id) { return Ask(id, Instruction::kPing, {}, 3).status(); }

absl::StatusOr<std::int64_t> Bus::Read(int id, Register what) {
  Bytes parameters;
  Append(parameters, what.address, 2);
  Append(parameters, what.size, 2);
  const absl::StatusOr<Answer> answer = Ask(id, Instruction::kRead, parameters, what.size);
  if (!answer.ok()) return answer.status();
  return SignedAt(answer->parameters, 0, what.size);
}

absl::Status Bus::Write(int id, Register what, std::int64_t value) {
  Bytes parameters;
  Append(parameters, what.address, 2);
  Append(parameters, value, what.size);
  return Ask(id, Instruction::kWrite, parameters, 0).status();
}

absl::Status Bus::SyncWrite(int address, int size, std::span<const std::uint8_t> parameters) {
  Bytes all;
  Append(all, address, 2);
  Append(all, size, 2);
  all.insert(all.end(), parameters.begin(), parameters.end());
  return Send(Encode(kBroadcast, Instruction::kSyncWrite, all));
}

absl::StatusOr<Bus::SyncAnswer> Bus::SyncRead(int address, int size, const std::vector<int>& ids) {
  Bytes parameters;
  Append(parameters, address, 2);
  Append(parameters, size, 2);
  for (const int id : ids) Append(parameters, id, 1);
  const Bytes packet = Encode(kBroadcast, Instruction::kSyncRead, parameters);
  const Timestamp begin = MonotonicNow();
  absl::Status problem = Send(packet);
  const auto deadline =
      Deadline(packet.size() + ids.size() * (kAnswerOverhead + static_cast<std::size_t>(size)));
  SyncAnswer result;
  while (problem.ok() && result.answers.size() < ids.size()) {
    std::optional<Answer> answer = parser_.Next();
    if (!answer) {
      Bytes bytes;
      problem = line_.Read(bytes, deadline);
      parser_.Add(bytes);
      continue;
    }
    const bool asked = std::find(ids.begin(), ids.end(), answer->id) != ids.end();
    const bool before = std::any_of(result.answers.begin(), result.answers.end(),
                                    [&](const Answer& one) { return one.id == answer->id; });
    if (!asked || before || answer->error != 0 || std::ssize(answer->parameters) != size) continue;
    result.answers.push_back(*std::move(answer));
  }
  if (absl::IsUnavailable(problem)) return problem;
  result.time_ns = begin + (MonotonicNow() - begin) / 2;
  return result;
}

}  // namespace saccade::dynamixel
