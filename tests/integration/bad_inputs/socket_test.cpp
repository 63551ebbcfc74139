// Rubbish on the wire and clients that die or stop.
#include <absl/strings/escaping.h>
#include <absl/strings/str_split.h>
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "tests/integration/bad_inputs/table.hpp"
#include "tests/integration/support/small_dataset.hpp"

namespace saccade::testing::socket_test {
namespace {

int Port(std::string address) {
  while (!address.empty() && address.back() == '/') address.pop_back();
  return std::stoi(address.substr(address.rfind(':') + 1));
}

int Connect(int port) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  return fd;
}

// Sends all of it and returns what came back until the peer closed or a second passed.
std::string Exchange(int port, const std::string& bytes) {
  const int fd = Connect(port);
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t count = send(fd, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) break;
    sent += static_cast<std::size_t>(count);
  }
  std::string answer;
  pollfd poller{fd, POLLIN, 0};
  while (poll(&poller, 1, 1000) > 0 && answer.size() < (1u << 20)) {
    char buffer[4096];
    const ssize_t count = recv(fd, buffer, sizeof buffer, 0);
    if (count <= 0) break;
    answer.append(buffer, static_cast<std::size_t>(count));
  }
  close(fd);
  return answer;
}

std::string FirstLine(const std::string& answer) {
  return answer.empty() ? "closed without an answer" : answer.substr(0, answer.find('\r'));
}

class BadSocket : public ::testing::Test {
 protected:
  BadSocket() {
    WriteSmallDataset(folder_ / "set", {.frames = 300});
    server_ = std::make_unique<Server>(std::vector<std::string>{
        "--source", "dataset:" + (folder_ / "set"), "--data-dir", folder_ / "data"});
  }
  ~BadSocket() override { EXPECT_TRUE(IsWell(*server_)) << server_->process().err(); }

  std::string Host() const { return "127.0.0.1:" + std::to_string(Port(server_->http())); }
  void Http(const std::string& input, const std::string& request, const std::string& status) {
    const std::string line = FirstLine(Exchange(Port(server_->http()), request));
    Row("http", input, line,
        status.empty() ? line.find(" 200") == std::string::npos
                       : line.find(status) != std::string::npos);
  }
  std::size_t Present() {
    const RunResult result =
        RunProgram({SACCADE_PROGRAM, "--server", server_->grpc(), "status", "--json"});
    const auto json = nlohmann::json::parse(result.out, nullptr, false);
    return json.is_discarded() ? 999 : json["participants"].size();
  }

  TemporaryFolder folder_;
  std::unique_ptr<Server> server_;
};

TEST_F(BadSocket, HttpThatIsNoneIsRefused) {
  const std::string host = "Host: " + Host() + "\r\n";
  Http("page asked for properly (control)", "GET / HTTP/1.1\r\n" + host + "\r\n", "HTTP/1.1 ");
  Http("2 KiB of rubbish", std::string(2048, '\x03'), "");
  Http("path out of the page's folder", "GET /../../../../etc/passwd HTTP/1.1\r\n" + host + "\r\n",
       "");
  Http("the same, escaped", "GET /%2e%2e/%2e%2e/etc/passwd HTTP/1.1\r\n" + host + "\r\n", "");
  Http("header of 1 MiB",
       "GET / HTTP/1.1\r\n" + host + "X: " + std::string(1 << 20, 'x') + "\r\n\r\n", "");
  Http("Host of another site (DNS rebinding)", "GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n", "");
  Http("DELETE", "DELETE / HTTP/1.1\r\n" + host + "\r\n", "");
}

// "grpc-status: 3" wherever the answer holds it: header, trailer frame, or that in base64.
std::string GrpcStatus(const std::string& answer) {
  std::vector<std::string> texts = {answer};
  for (const absl::string_view line : absl::StrSplit(answer, "\r\n")) {  // chunks are lines
    absl::Base64Unescape(line, &texts.emplace_back());
  }
  for (const std::string& text : texts) {
    const auto at = text.find("grpc-status:");
    if (at != std::string::npos) return text.substr(at, text.find('\r', at) - at);
  }
  return "";
}

TEST_F(BadSocket, GrpcWebThatIsNoneIsRefused) {
  const auto call = [&](const std::string& input, const std::string& type, const std::string& body,
                        std::uint64_t claimed = 0) {
    const std::string answer =
        Exchange(Port(server_->http()),
                 "POST /saccade.v1.SessionService/GetStatus HTTP/1.1\r\nHost: " + Host() +
                     "\r\nContent-Type: " + type +
                     "\r\nContent-Length: " + std::to_string(claimed ? claimed : body.size()) +
                     "\r\nConnection: close\r\n\r\n" + body);
    const std::string status = GrpcStatus(answer);
    const bool refused = answer.find("HTTP/1.1 4") == 0 ||
                         (!status.empty() && status.find(": 0") == std::string::npos &&
                          status.find(":0") == std::string::npos);
    Row("http", input, FirstLine(answer) + (status.empty() ? "" : ", " + status), refused);
  };
  const std::string proto = "application/grpc-web+proto";
  call("gRPC-Web frame cut short", proto,
       std::string("\0\0\0\0\x10"
                   "ab",
                   7));
  call("gRPC-Web frame that claims 4 GiB", proto, std::string("\0\xff\xff\xff\xff", 5));
  call("gRPC-Web with no frame", proto, "");
  call("body that claims 4 GiB", proto, "", 4294967295);
  call("gRPC-Web-text that is not base64", "application/grpc-web-text", "***");
  call("JSON to a gRPC method", "application/json", "{}");
}

TEST_F(BadSocket, RubbishOnTheGrpcPortIsClosed) {
  const std::string answer = Exchange(Port(server_->grpc()), std::string(4096, '\x7f'));
  Row("wire", "4 KiB of rubbish on the gRPC port",
      answer.empty() ? "closed"
                     : "an HTTP/2 farewell of " + std::to_string(answer.size()) + " bytes, closed",
      IsWell(*server_));
  std::vector<int> fds;
  for (int i = 0; i < 200; ++i) {
    fds.push_back(Connect(Port(i % 2 ? server_->grpc() : server_->http())));
  }
  Row("wire", "200 connections that say nothing", "others are served meanwhile", IsWell(*server_));
  for (const int fd : fds) close(fd);
}

TEST_F(BadSocket, ClientsThatDieOrStopDisturbNobody) {
  const std::vector<std::string> watch = {SACCADE_PROGRAM, "--server", server_->grpc(), "watch",
                                          "--json"};
  auto dying = std::make_unique<Process>(watch);
  auto stopping = std::make_unique<Process>(watch);
  Process other(watch);
  for (Process* process : {dying.get(), stopping.get(), &other}) {
    ASSERT_TRUE(process->WaitForLine("pose", std::chrono::seconds(5)));
  }
  stopping->Signal(SIGSTOP);
  dying->Signal(SIGKILL);
  dying->Wait(std::chrono::seconds(2));
  std::size_t present = 3;
  for (int i = 0; i < 50 && present > 2; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    present = Present();
  }
  Row("client", "subscriber killed with SIGKILL", std::to_string(present) + " of 3 left within 5 s",
      present == 2);
  const std::size_t before = other.out().size();
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  const std::size_t grown = other.out().size() - before;
  Row("client", "subscriber stopped (SIGSTOP) with its socket open",
      grown > 0 ? "the others go on" : "the others starve", grown > 0);
  stopping->Signal(SIGCONT);
}

}  // namespace
}  // namespace saccade::testing::socket_test
