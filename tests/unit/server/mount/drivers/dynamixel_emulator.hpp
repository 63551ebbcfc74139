#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "shared/time/timestamp.hpp"

namespace saccade {

/// Dynamixel X servos behind a pseudo-terminal, written from the description of Protocol 2.0 alone:
/// it shares no code with the driver. In a sync read a servo waits for those listed before it, so
/// that a silent one silences those after it.
class DynamixelEmulator {
 public:
  explicit DynamixelEmulator(const std::vector<int>& ids);
  ~DynamixelEmulator();

  /// A link to the pseudo-terminal that stays the same when it is unplugged and plugged in again.
  const std::string& device() const { return link_; }

  // Registers, as the servo holds them.
  std::int32_t Get(int id, int address, int size);
  void Set(int id, int address, int size, std::int32_t value);
  std::int32_t Position(int id) { return Get(id, 132, 4); }

  // Faults.
  void Unplug();
  void Replug();
  void SetStalled(bool stalled) { stalled_ = stalled; }
  /// Of the next `count` answers one byte is left out, or one bit turned over.
  void LoseBytes(int count) { lose_ = count; }
  void DamageAnswers(int count) { damage_ = count; }
  void SetAbsent(int id, bool absent);
  /// Hardware error status, and the torque off, as a servo does it.
  void Overload(int id);
  /// RAM back to what it is after switching on; errors gone.
  void PowerCycle(int id);
  void Jam(int id, bool jammed);

  /// An answer to a sync read leaves this long after the question; positions are sampled half way.
  void SetAnswerTime(double seconds) { answer_time_s_ = seconds; }
  struct Sample {
    Timestamp time_ns;
    std::int32_t position;
  };
  /// Of the first servo, for each sync read of positions.
  std::vector<Sample> samples();

  int packets() const { return packets_; }
  int bad_packets() const { return bad_packets_; }

 private:
  struct Servo {
    std::array<std::uint8_t, 256> table{};
    bool absent = false, jammed = false;
    double position = 0;  // [tick]
    Timestamp moved_ns = 0;
  };
  using Packet = std::vector<std::uint8_t>;

  void Open();
  void Close();
  void Loop(const std::stop_token& stop);
  void Receive(const std::uint8_t* bytes, std::size_t count);
  void Execute(int id, const Packet& body);
  void SyncRead(const Packet& body);
  void SyncWrite(const Packet& body);
  int Store(Servo& servo, int address, const std::uint8_t* values, int count);
  void Answer(int id, int error, const Packet& parameters);
  void Move(Servo& servo);
  static void SwitchOn(Servo& servo);

  std::mutex mutex_;
  std::map<int, Servo> servos_;
  std::deque<std::uint8_t> input_;
  std::vector<Sample> samples_;
  int master_ = -1, slave_ = -1;
  std::string link_;
  std::atomic<bool> stalled_ = false;
  std::atomic<int> lose_ = 0, damage_ = 0, packets_ = 0, bad_packets_ = 0;
  std::atomic<double> answer_time_s_ = 0;
  std::jthread thread_;
};

}  // namespace saccade
