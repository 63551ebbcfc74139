#include "tests/unit/server/mount/drivers/dynamixel_emulator.hpp"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <stdexcept>

namespace saccade {
namespace {

// Bit by bit, as the polynomial x^16 + x^15 + x^2 + 1 says.
unsigned Remainder(const std::vector<std::uint8_t>& bytes) {
  unsigned remainder = 0;
  for (const std::uint8_t byte : bytes) {
    for (int bit = 7; bit >= 0; --bit) {
      const unsigned in = (byte >> bit) & 1u;
      const unsigned out = (remainder >> 15) & 1u;
      remainder = (remainder << 1) & 0xFFFFu;
      if ((in ^ out) != 0) remainder ^= 0x8005u;
    }
  }
  return remainder;
}

int Number(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return bytes.at(at) + 256 * bytes.at(at + 1);
}

void Pause(double seconds) {
  if (seconds > 0) std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

}  // namespace

DynamixelEmulator::DynamixelEmulator(const std::vector<int>& ids) {
  for (const int id : ids) {
    Servo& servo = servos_[id];
    servo.table[0] = 0xFC;  // model 1020: XM430-W350
    servo.table[1] = 0x03;
    servo.table[6] = 45;
    servo.table[7] = static_cast<std::uint8_t>(id);
    servo.table[11] = 3;     // position mode
    servo.table[48] = 0xFF;  // limits 0 to 4095
    servo.table[49] = 0x0F;
    servo.position = 2048;
    SwitchOn(servo);
  }
  static std::atomic<int> count = 0;
  link_ = (std::filesystem::temp_directory_path() /
           ("saccade_dynamixel_" + std::to_string(getpid()) + "_" + std::to_string(++count)))
              .string();
  Open();
  thread_ = std::jthread([this](const std::stop_token& stop) { Loop(stop); });
}

DynamixelEmulator::~DynamixelEmulator() {
  thread_.request_stop();
  thread_.join();
  Unplug();
}

void DynamixelEmulator::SwitchOn(Servo& servo) {
  std::fill(servo.table.begin() + 64, servo.table.end(), 0);
  servo.table[68] = 2;  // every packet is answered
  servo.moved_ns = MonotonicNow();
}

void DynamixelEmulator::Open() {
  master_ = posix_openpt(O_RDWR | O_NOCTTY);
  if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0) {
    throw std::runtime_error("no pseudo-terminal");
  }
  // Held open here, so that the master hears no hang-up while the driver is away.
  slave_ = open(ptsname(master_), O_RDWR | O_NOCTTY);
  termios raw{};
  tcgetattr(slave_, &raw);
  cfmakeraw(&raw);
  tcsetattr(slave_, TCSANOW, &raw);
  std::filesystem::remove(link_);
  std::filesystem::create_symlink(ptsname(master_), link_);
}

void DynamixelEmulator::Close() {
  std::filesystem::remove(link_);
  if (slave_ >= 0) close(slave_);
  if (master_ >= 0) close(master_);
  master_ = slave_ = -1;
}

void DynamixelEmulator::Unplug() {
  const std::lock_guard lock(mutex_);
  Close();
}

void DynamixelEmulator::Replug() {
  const std::lock_guard lock(mutex_);
  input_.clear();
  Open();
}

std::int32_t DynamixelEmulator::Get(int id, int address, int size) {
  const std::lock_guard lock(mutex_);
  Servo& servo = servos_.at(id);
  Move(servo);
  std::uint32_t value = 0;
  for (int k = 0; k < size; ++k) {
    value |= std::uint32_t{servo.table.at(static_cast<std::size_t>(address + k))} << (8 * k);
  }
  return static_cast<std::int32_t>(value);
}

void DynamixelEmulator::Set(int id, int address, int size, std::int32_t value) {
  const std::lock_guard lock(mutex_);
  Servo& servo = servos_.at(id);
  if (address == 132) servo.position = value;
  for (int k = 0; k < size; ++k) {
    servo.table.at(static_cast<std::size_t>(address + k)) =
        static_cast<std::uint8_t>(static_cast<std::uint32_t>(value) >> (8 * k));
  }
}

void DynamixelEmulator::SetAbsent(int id, bool absent) {
  const std::lock_guard lock(mutex_);
  servos_.at(id).absent = absent;
}

void DynamixelEmulator::Overload(int id) {
  const std::lock_guard lock(mutex_);
  Servo& servo = servos_.at(id);
  Move(servo);
  servo.table[70] = 0x20;
  servo.table[64] = 0;
}

void DynamixelEmulator::PowerCycle(int id) {
  const std::lock_guard lock(mutex_);
  SwitchOn(servos_.at(id));
}

void DynamixelEmulator::Jam(int id, bool jammed) {
  const std::lock_guard lock(mutex_);
  Servo& servo = servos_.at(id);
  Move(servo);
  servo.jammed = jammed;
}

std::vector<DynamixelEmulator::Sample> DynamixelEmulator::samples() {
  const std::lock_guard lock(mutex_);
  return samples_;
}

void DynamixelEmulator::Loop(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    int master = -1;
    {
      const std::lock_guard lock(mutex_);
      master = master_;
    }
    if (master < 0) {
      Pause(0.002);
      continue;
    }
    pollfd wait{.fd = master, .events = POLLIN, .revents = 0};
    if (poll(&wait, 1, 5) <= 0 || (wait.revents & POLLIN) == 0) continue;
    const std::lock_guard lock(mutex_);
    if (master_ != master) continue;
    std::uint8_t bytes[512];
    const ssize_t count = read(master_, bytes, sizeof(bytes));
    if (count > 0) Receive(bytes, static_cast<std::size_t>(count));
  }
}

// FF FF FD 00, id, length low, length high, body (instruction, parameters, CRC low, CRC high).
void DynamixelEmulator::Receive(const std::uint8_t* bytes, std::size_t count) {
  input_.insert(input_.end(), bytes, bytes + count);
  while (input_.size() >= 10) {
    if (!(input_[0] == 0xFF && input_[1] == 0xFF && input_[2] == 0xFD && input_[3] == 0x00)) {
      input_.pop_front();
      continue;
    }
    const std::size_t whole = 7u + input_[5] + 256u * input_[6];
    if (input_.size() < whole) return;
    Packet packet(input_.begin(), input_.begin() + static_cast<std::ptrdiff_t>(whole));
    input_.erase(input_.begin(), input_.begin() + static_cast<std::ptrdiff_t>(whole));
    const int sent = Number(packet, whole - 2);
    packet.resize(whole - 2);
    ++packets_;
    if (static_cast<unsigned>(sent) != Remainder(packet)) {
      ++bad_packets_;
      continue;
    }
    Packet body;
    for (std::size_t k = 7; k < packet.size(); ++k) {
      body.push_back(packet[k]);
      const bool stuffed = k >= 10 && packet[k] == 0xFD && packet[k - 1] == 0xFD &&
                           packet[k - 2] == 0xFF && packet[k - 3] == 0xFF;
      if (stuffed) body.pop_back();
    }
    if (!stalled_) Execute(packet[4], body);
  }
}

void DynamixelEmulator::Execute(int id, const Packet& body) {
  if (id == 0xFE) {
    if (body[0] == 0x82) SyncRead(body);
    if (body[0] == 0x83) SyncWrite(body);
    return;
  }
  const auto found = servos_.find(id);
  if (found == servos_.end() || found->second.absent) return;
  Servo& servo = found->second;
  Move(servo);
  switch (body[0]) {
    case 0x01:
      return Answer(id, 0, {servo.table[0], servo.table[1], servo.table[6]});
    case 0x02: {
      const int address = Number(body, 1), size = Number(body, 3);
      if (address + size > 256) return Answer(id, 4, {});
      return Answer(id, 0,
                    Packet(servo.table.begin() + address, servo.table.begin() + address + size));
    }
    case 0x03: {
      const int error =
          Store(servo, Number(body, 1), body.data() + 3, static_cast<int>(body.size()) - 3);
      if (servo.table[68] == 2) Answer(id, error, {});
      return;
    }
    default:
      return Answer(id, 2, {});
  }
}

int DynamixelEmulator::Store(Servo& servo, int address, const std::uint8_t* values, int count) {
  if (address < 0 || address + count > 256) return 4;
  if (address < 64 && servo.table[64] != 0) return 7;  // EEPROM: only without torque
  if (address >= 120) return 7;                        // read only
  if (address == 64 && values[0] == 1 && servo.table[70] != 0) return 1;
  const auto number = [&](int at) {
    std::int32_t value = 0;
    for (int k = 3; k >= 0; --k) {
      value = static_cast<std::int32_t>(static_cast<std::uint32_t>(value) << 8 |
                                        servo.table[static_cast<std::size_t>(at + k)]);
    }
    return value;
  };
  const auto before = servo.table;
  std::copy(values, values + count, servo.table.begin() + address);
  const bool goal = address <= 116 && address + count >= 120;
  if (goal && servo.table[11] == 3 && (number(116) < number(52) || number(116) > number(48))) {
    servo.table = before;
    return 6;
  }
  return 0;
}

void DynamixelEmulator::Move(Servo& servo) {
  const Timestamp now = MonotonicNow();
  const double dt = Seconds(now - servo.moved_ns);
  servo.moved_ns = now;
  const auto number = [&](std::size_t at) {
    return static_cast<std::int32_t>(servo.table[at] | servo.table[at + 1] << 8 |
                                     servo.table[at + 2] << 16 |
                                     static_cast<std::uint32_t>(servo.table[at + 3]) << 24);
  };
  double moved = 0;
  if (servo.table[64] == 1 && !servo.jammed) {
    // Profile velocity in 0.229 rpm; zero is as fast as it can.
    const double rpm = number(112) == 0 ? 77.0 : 0.229 * number(112);
    const double most = rpm / 60.0 * 4096.0 * dt;
    moved = std::clamp(number(116) - servo.position, -most, most);
    servo.position += moved;
  }
  const auto put = [&](std::size_t at, double value) {
    const auto whole = static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(value)));
    for (std::size_t k = 0; k < 4; ++k) {
      servo.table[at + k] = static_cast<std::uint8_t>(whole >> (8 * k));
    }
  };
  put(132, servo.position);
  put(128, dt > 0 ? moved / 4096.0 / dt * 60.0 / 0.229 : 0.0);
  servo.table[126] = servo.jammed ? 100 : 0;
}

void DynamixelEmulator::SyncRead(const Packet& body) {
  const int address = Number(body, 1), size = Number(body, 3);
  Pause(0.5 * answer_time_s_);
  std::vector<std::pair<int, Packet>> answers;
  for (std::size_t k = 5; k < body.size(); ++k) {
    const auto found = servos_.find(body[k]);
    if (found == servos_.end() || found->second.absent) break;  // those after it wait in vain
    Move(found->second);
    const auto begin = found->second.table.begin() + address;
    answers.emplace_back(body[k], Packet(begin, begin + size));
    if (k == 5 && address <= 132) {
      samples_.push_back(
          {MonotonicNow(), static_cast<std::int32_t>(std::lround(found->second.position))});
    }
  }
  Pause(0.5 * answer_time_s_);
  for (const auto& [id, parameters] : answers) Answer(id, 0, parameters);
}

void DynamixelEmulator::SyncWrite(const Packet& body) {
  const int address = Number(body, 1), size = Number(body, 3);
  for (std::size_t k = 5; k + static_cast<std::size_t>(size) < body.size();
       k += static_cast<std::size_t>(size) + 1) {
    const auto found = servos_.find(body[k]);
    if (found == servos_.end() || found->second.absent) continue;
    Move(found->second);
    Store(found->second, address, body.data() + k + 1, size);
  }
}

void DynamixelEmulator::Answer(int id, int error, const Packet& parameters) {
  if (servos_.at(id).table[70] != 0) error |= 0x80;
  Packet body = {0x55, static_cast<std::uint8_t>(error)};
  for (const std::uint8_t byte : parameters) {
    body.push_back(byte);
    const std::size_t n = body.size();
    if (n >= 3 && body[n - 3] == 0xFF && body[n - 2] == 0xFF && body[n - 1] == 0xFD) {
      body.push_back(0xFD);
    }
  }
  Packet packet = {0xFF, 0xFF, 0xFD, 0x00, static_cast<std::uint8_t>(id)};
  packet.push_back(static_cast<std::uint8_t>((body.size() + 2) % 256));
  packet.push_back(static_cast<std::uint8_t>((body.size() + 2) / 256));
  packet.insert(packet.end(), body.begin(), body.end());
  const unsigned remainder = Remainder(packet);
  packet.push_back(static_cast<std::uint8_t>(remainder & 0xFF));
  packet.push_back(static_cast<std::uint8_t>(remainder >> 8));
  // A different place each time: header, length, parameters and CRC all have their turn.
  const auto place = static_cast<std::size_t>(packets_) % packet.size();
  if (damage_ > 0) {
    --damage_;
    packet[place] ^= 0x10;
  } else if (lose_ > 0) {
    --lose_;
    packet.erase(packet.begin() + static_cast<std::ptrdiff_t>(place));
  }
  if (master_ < 0) return;
  const ssize_t written = write(master_, packet.data(), packet.size());
  if (written < 0) return;
}

}  // namespace saccade
