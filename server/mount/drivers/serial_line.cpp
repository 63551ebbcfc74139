#include "server/mount/drivers/serial_line.hpp"

#include <absl/strings/str_cat.h>
#include <termios.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/serial_port.hpp>
#include <boost/asio/write.hpp>
#include <optional>
#include <utility>

namespace saccade {
namespace net = boost::asio;

struct SerialLine::Port {
  explicit Port(std::string name) : device(std::move(name)), port(io) {}

  const std::string device;
  net::io_context io{1};
  net::serial_port port;
  std::array<std::uint8_t, 512> input{};

  /// Runs what was begun until it is done or the deadline; then it is over either way,
  /// and nothing of it reaches into the caller's stack any more.
  absl::Status Finish(const std::optional<boost::system::error_code>& done,
                      Clock::time_point deadline) {
    io.restart();
    while (!done && Clock::now() < deadline) {
      if (io.run_one_until(deadline) == 0) break;
    }
    const bool late = !done;
    if (late) {
      boost::system::error_code ignored;
      port.cancel(ignored);
      io.restart();
      io.run();
    }
    if (late) return absl::DeadlineExceededError(absl::StrCat(device, ": no answer"));
    if (*done) {
      return absl::UnavailableError(
          absl::StrCat(device, ": gone (", done->message(), "); plug it in again"));
    }
    return absl::OkStatus();
  }
};

SerialLine::SerialLine(std::unique_ptr<Port> port) : port_(std::move(port)) {}
SerialLine::~SerialLine() = default;

absl::StatusOr<std::unique_ptr<SerialLine>> SerialLine::Open(const std::string& device, int baud) {
  auto port = std::make_unique<Port>(device);
  boost::system::error_code error;
  port->port.open(device, error);
  if (error == boost::system::errc::permission_denied) {
    return absl::PermissionDeniedError(absl::StrCat(
        device, ": may not be opened; add the user to the group that owns it (dialout)"));
  }
  if (error == boost::system::errc::no_such_file_or_directory) {
    return absl::NotFoundError(absl::StrCat(device, ": no such device; plug the adapter in"));
  }
  if (error) {
    return absl::UnavailableError(
        absl::StrCat(device, ": cannot be opened (", error.message(), "); is it a serial port?"));
  }
  using Base = net::serial_port_base;
  port->port.set_option(Base::baud_rate(static_cast<unsigned>(baud)), error);
  if (error) {
    return absl::InvalidArgumentError(absl::StrCat(
        "baud: ", baud, ": ", device, " cannot do that; give 57600, 115200 or 1000000"));
  }
  port->port.set_option(Base::character_size(8), error);
  if (!error) port->port.set_option(Base::parity(Base::parity::none), error);
  if (!error) port->port.set_option(Base::stop_bits(Base::stop_bits::one), error);
  if (!error) port->port.set_option(Base::flow_control(Base::flow_control::none), error);
  if (error) {
    return absl::UnavailableError(
        absl::StrCat(device, ": cannot be set up (", error.message(), ")"));
  }
  return std::unique_ptr<SerialLine>(new SerialLine(std::move(port)));
}

absl::Status SerialLine::Write(std::span<const std::uint8_t> bytes, Clock::time_point deadline) {
  std::optional<boost::system::error_code> done;
  net::async_write(port_->port, net::buffer(bytes.data(), bytes.size()),
                   [&done](const boost::system::error_code& error, std::size_t) { done = error; });
  return port_->Finish(done, deadline);
}

absl::Status SerialLine::Read(std::vector<std::uint8_t>& bytes, Clock::time_point deadline) {
  std::optional<boost::system::error_code> done;
  std::size_t count = 0;
  port_->port.async_read_some(net::buffer(port_->input),
                              [&](const boost::system::error_code& error, std::size_t size) {
                                done = error;
                                count = size;
                              });
  absl::Status status = port_->Finish(done, deadline);
  bytes.insert(bytes.end(), port_->input.begin(),
               port_->input.begin() + static_cast<std::ptrdiff_t>(count));
  return status;
}

void SerialLine::DropInput() { tcflush(port_->port.native_handle(), TCIFLUSH); }

}  // namespace saccade
