// Frames that are not as HTTP/2 wants them, for the gRPC port.
#include "tests/integration/attack/attacks.hpp"

namespace saccade::testing {
namespace {

constexpr char kPreface[] = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
enum Type : unsigned char {
  kData,
  kHeaders,
  kPriority,
  kReset,
  kSettings,
  kPush,
  kPingFrame,
  kGoAway,
  kWindow,
  kContinuation
};

std::string Number(std::uint32_t value, int bytes) {
  std::string out;
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8)
    out += static_cast<char>(value >> shift);
  return out;
}

std::string Frame(Type type, int flags, std::uint32_t stream, const std::string& payload,
                  std::uint32_t claimed = 0) {
  const auto size = claimed != 0 ? claimed : static_cast<std::uint32_t>(payload.size());
  return Number(size, 3) + static_cast<char>(type) + static_cast<char>(flags) + Number(stream, 4) +
         payload;
}

// A header field that no table holds, neither part compressed; both shorter than 127 bytes.
std::string Field(const std::string& name, const std::string& value) {
  return std::string(1, '\0') + static_cast<char>(name.size()) + name +
         static_cast<char>(value.size()) + value;
}

std::string CallHeaders(const std::string& method) {
  return Field(":method", "POST") + Field(":scheme", "http") + Field(":path", method) +
         Field(":authority", "127.0.0.1") + Field("content-type", "application/grpc") +
         Field("te", "trailers");
}

std::string Repeat(int times, const std::function<std::string(std::uint32_t)>& make) {
  std::string out;
  for (int i = 0; i < times; ++i) out += make(static_cast<std::uint32_t>(i));
  return out;
}

}  // namespace

std::string Http2Call(const std::string& method, const std::string& payload) {
  return kPreface + Frame(kSettings, 0, 0, "") + Frame(kHeaders, 4, 1, CallHeaders(method)) +
         Frame(kData, 1, 1, GrpcWebFrame(payload));
}

// Of streams reset at once gRPC 1.51 keeps some 20 KB each until it has come to them, and has no
// limit for them: 20000 are 400 MB. No more here than a server must bear without one.
std::vector<Http2Case> Http2Cases() {
  const std::string begin = kPreface + Frame(kSettings, 0, 0, "");
  const std::string ping = "/saccade.v1.SessionService/Ping";
  const std::string headers = CallHeaders(ping);
  const auto with = [&](const std::string& field) {
    return begin + Frame(kHeaders, 5, 1, headers + field);
  };
  return {
      {"rubbish in place of a preface", std::string(5000, '\x03')},
      {"HTTP/1.1", "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"},
      {"preface cut short", std::string(kPreface).substr(0, 10)},
      {"frame that claims 16 MiB", begin + Frame(kData, 0, 1, "x", 0xffffff)},
      {"settings of 5 bytes", std::string(kPreface) + Frame(kSettings, 0, 0, "abcde")},
      {"settings with a frame size of 0",
       std::string(kPreface) + Frame(kSettings, 0, 0, Number(5, 2) + Number(0, 4))},
      {"settings with a window of 2^32 - 1",
       std::string(kPreface) + Frame(kSettings, 0, 0, Number(4, 2) + Number(~0u, 4))},
      {"settings with a header table of 2^32 - 1",
       std::string(kPreface) + Frame(kSettings, 0, 0, Number(1, 2) + Number(~0u, 4))},
      {"20000 settings", begin + Repeat(20'000, [](auto) { return Frame(kSettings, 0, 0, ""); })},
      {"5000 pings",
       begin + Repeat(5000, [](auto) { return Frame(kPingFrame, 0, 0, "abcdefgh"); })},
      {"headers on stream 0", begin + Frame(kHeaders, 5, 0, headers)},
      {"headers that are no HPACK", begin + Frame(kHeaders, 5, 1, std::string(400, '\xff'))},
      {"headers without a path", begin + Frame(kHeaders, 5, 1, Field(":method", "POST"))},
      {"path with bytes above 127",
       begin + Frame(kHeaders, 5, 1, CallHeaders("/saccade.v1.\xff\xfe\x80/\x01"))},
      {"metadata with control bytes", with(Field("x-request-id", "a\tb\x01\x7f\xff"))},
      {"metadata name with control bytes", with(Field("x\x01\xff", "a"))},
      {"metadata name in capitals", with(Field("X-Request-Id", "a"))},
      {"grpc-timeout of nonsense", with(Field("grpc-timeout", "\xff-1e9Q"))},
      {"binary metadata that is none", with(Field("x-bin", "%%%"))},
      {"trace context that is none", with(Field("grpc-trace-bin", "!!"))},
      {"message encoding unknown", with(Field("grpc-encoding", "lzma"))},
      {"compressed without an encoding",
       begin + Frame(kHeaders, 4, 1, headers) + Frame(kData, 1, 1, GrpcWebFrame("x", 1))},
      {"message that claims 4 GiB", begin + Frame(kHeaders, 4, 1, headers) +
                                        Frame(kData, 1, 1, std::string("\0\xff\xff\xff\xff", 5))},
      {"data before headers", begin + Frame(kData, 1, 1, "abc")},
      {"data on an even stream", begin + Frame(kData, 1, 2, "abc")},
      {"continuations without an end", begin + Frame(kHeaders, 0, 1, headers) +
                                           Repeat(2000,
                                                  [](auto) {
                                                    return Frame(kContinuation, 0, 1,
                                                                 Field("a", std::string(120, 'x')));
                                                  })},
      {"2000 streams reset at once",
       begin + Repeat(2000,
                      [&](std::uint32_t i) {
                        return Frame(kHeaders, 4, 2 * i + 1, headers) +
                               Frame(kReset, 0, 2 * i + 1, Number(8, 4));
                      })},
      {"2000 streams left open",
       begin +
           Repeat(2000, [&](std::uint32_t i) { return Frame(kHeaders, 4, 2 * i + 1, headers); })},
      {"window above its end", begin + Frame(kWindow, 0, 0, Number(0x7fffffff, 4)) +
                                   Frame(kWindow, 0, 0, Number(0x7fffffff, 4))},
      {"window of 0", begin + Frame(kWindow, 0, 1, Number(0, 4))},
      {"push promise", begin + Frame(kPush, 4, 1, Number(2, 4) + headers)},
      {"priority on itself", begin + Frame(kPriority, 0, 1, Number(1, 4) + "x")},
      {"farewell, then a call",
       begin + Frame(kGoAway, 0, 0, Number(0, 4) + Number(0, 4)) + Frame(kHeaders, 5, 1, headers)},
      {"frame of type 255", begin + Frame(static_cast<Type>(255), 255, 77, std::string(1000, 'z'))},
  };
}

void SendMalformedHttp2(const Battle& battle) {
  const std::vector<Http2Case> cases = Http2Cases();
  for (std::size_t i = 0; !battle.over(); ++i) {
    Socket socket(battle.target.grpc_port());
    socket.Send(cases[i % cases.size()].bytes, milliseconds(500));
    battle.tally.Add(socket.ClosedByPeer(milliseconds(100)) ? "HTTP/2 closed" : "HTTP/2 held");
  }
}

}  // namespace saccade::testing
