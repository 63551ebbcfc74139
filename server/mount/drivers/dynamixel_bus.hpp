#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <span>
#include <vector>

#include "server/mount/drivers/dynamixel_protocol.hpp"
#include "server/mount/drivers/serial_line.hpp"
#include "shared/time/timestamp.hpp"

namespace saccade::dynamixel {

/// One register of a servo's control table.
struct Register {
  int address, size;
};

/// Questions and answers on one line. One thread; blocks for as long as an answer may take.
/// Errors: Unavailable, the line is gone; DeadlineExceeded, no (whole) answer; FailedPrecondition,
/// the servo refuses, with its reason.
class Bus {
 public:
  /// `answer_timeout_s`: beyond the time that the bytes take on the wire. `line` outlives this.
  Bus(SerialLine& line, int baud, double answer_timeout_s)
      : line_(line), baud_(baud), answer_timeout_s_(answer_timeout_s) {}

  // Asked up to three times: damaged packets are nothing unusual.
  absl::Status Ping(int id);
  absl::StatusOr<std::int64_t> Read(int id, Register what);
  absl::Status Write(int id, Register what, std::int64_t value);

  /// Nobody answers to this. `parameters`: for each servo its id and `size` bytes.
  absl::Status SyncWrite(int address, int size, std::span<const std::uint8_t> parameters);

  struct SyncAnswer {
    Timestamp time_ns = 0;        // middle of the transaction
    std::vector<Answer> answers;  // of those that answered, `size` bytes each, in no order
  };
  /// Asks once. Some or all answers may be missing: only a line that is gone is an error.
  absl::StatusOr<SyncAnswer> SyncRead(int address, int size, const std::vector<int>& ids);

 private:
  absl::StatusOr<Answer> Ask(int id, Instruction instruction,
                             std::span<const std::uint8_t> parameters, int answer_size);
  absl::Status Send(const Bytes& packet);
  SerialLine::Clock::time_point Deadline(std::size_t bytes) const;

  SerialLine& line_;
  const int baud_;
  const double answer_timeout_s_;
  AnswerParser parser_;
};

}  // namespace saccade::dynamixel
