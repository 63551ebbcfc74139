// What may stand in an HTTP request and must not end the server.
#include <absl/strings/escaping.h>

#include "tests/integration/attack/attacks.hpp"

namespace saccade::testing {
namespace {

constexpr char kPing[] = "/saccade.v1.SessionService/Ping";

std::string Post(int port, const std::string& method, const std::string& type,
                 const std::string& body, const std::string& headers = "") {
  return HttpHead(port, "POST", method,
                  "Content-Type: " + type + "\r\nConnection: close\r\nContent-Length: " +
                      std::to_string(body.size()) + "\r\n" + headers) +
         body;
}

std::string Printable(const std::string& bytes) {
  return bytes.size() > 40 ? std::to_string(bytes.size()) + " bytes" : absl::CHexEscape(bytes);
}

}  // namespace

std::vector<HttpCase> ForwardedHeaderCases(int port) {
  std::vector<HttpCase> cases;
  std::vector<std::string> bad = {"a\tb", "\t", "a\x80", "\xff\xfe", "caf\xc3\xa9"};
  for (int byte = 0x80; byte < 0x100; byte += 17)
    bad.push_back(std::string(3, static_cast<char>(byte)));
  const std::vector<std::string> doubtful = {"a\x01z",
                                             "a\x7fz",
                                             std::string("a\0z", 3),
                                             "a\rz",
                                             "",
                                             " ",
                                             std::string(15'000, 'x'),
                                             std::string(16'384, 'x'),
                                             "a\r\n folded"};
  for (const std::string name : {"authorization", "traceparent", "tracestate", "x-request-id"}) {
    const auto add = [&](const std::string& value, std::vector<std::string> wanted) {
      cases.push_back({name + ": " + Printable(value),
                       GrpcWebCall(port, kPing, "", name + ": " + value + "\r\n"),
                       std::move(wanted)});
    };
    // "\t" alone is trimmed: no value.
    for (const std::string& value : bad) {
      add(value,
          value == "\t" ? std::vector<std::string>{"200", "400"} : std::vector<std::string>{"400"});
    }
    for (const std::string& value : doubtful) add(value, {"200", "400", "431", "closed"});
    add("plain", {"200"});
    cases.push_back({name + " a thousand times",
                     GrpcWebCall(port, kPing, "",
                                 [&] {
                                   std::string many;
                                   for (int i = 0; i < 1000; ++i) many += name + ": a\r\n";
                                   return many;
                                 }()),
                     {"200", "400", "431", "closed"}});
  }
  return cases;
}

std::vector<HttpCase> GrpcWebCases(int port) {
  const std::string type = "application/grpc-web", text = "application/grpc-web-text";
  const std::string frame = GrpcWebFrame("");
  const std::vector<std::string> any = {"200", "400", "404", "413", "415", "431", "closed"};
  std::vector<HttpCase> cases = {
      {"frame that claims 4 GiB", Post(port, kPing, type, std::string("\0\xff\xff\xff\xff", 5)),
       any},
      {"frame cut short", Post(port, kPing, type, std::string("\0\0", 2)), any},
      {"no body at all", Post(port, kPing, type, ""), any},
      {"two frames", Post(port, kPing, type, frame + frame), any},
      {"compressed frame", Post(port, kPing, type, GrpcWebFrame("zip", 1)), any},
      {"trailer frame", Post(port, kPing, type, GrpcWebFrame("grpc-status: 0\r\n", '\x80')), any},
      {"flags of 255", Post(port, kPing, type, GrpcWebFrame("", '\xff')), any},
      {"base64 that is none", Post(port, kPing, text, "%%%%"), any},
      {"base64 of one letter", Post(port, kPing, text, "A"), any},
      {"base64 padding alone", Post(port, kPing, text, "===="), any},
      {"base64 padding, 1 MB", Post(port, kPing, text, std::string(1'000'000, '=')), any},
      {"base64 of many pieces",
       Post(port, kPing, text,
            [] {
              std::string many;
              for (int i = 0; i < 100'000; ++i) many += "AA==";
              return many;
            }()),
       any},
      {"method without a service", Post(port, "/Ping", type, frame), any},
      {"method with dots", Post(port, "/../../etc/passwd", type, frame), any},
      {"method unknown", Post(port, "/saccade.v1.SessionService/Explode", type, frame), any},
      {"method of a foreign service", Post(port, "/a.b/C", type, frame), any},
      {"method with bytes above 127", Post(port, "/saccade.v1.\xff\xfe/Ping", type, frame), any},
      {"method with a zero", Post(port, std::string("/saccade.v1.S\0/P", 16), type, frame), any},
      {"method with control bytes", Post(port, "/saccade.v1.S\x01\x7f/P", type, frame), any},
      {"method of 12 KB", Post(port, "/a." + std::string(12'000, 'b') + "/C", type, frame), any},
      {"method with %0d%0a", Post(port, "/saccade.v1.S%0d%0aX: y/P", type, frame), any},
      {"method in absolute form",
       Post(port, "http://127.0.0.1/saccade.v1.SessionService/Ping", type, frame), any},
      {"reflection over HTTP",
       Post(port, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", type,
            GrpcWebFrame(std::string("\x3a\0", 2))),
       any},
      {"content type with rubbish", Post(port, kPing, type + "; a=\xff\x80;;;", frame), any},
  };
  for (const std::string timeout :
       {"", "S", "0n", "-1S", "99999999H", "999999999999999999999S", "1e9S", "1X", "\xff", "1 S",
        "0S", "NaNS", "18446744073709551616n", "+1S"}) {
    cases.push_back({"grpc-timeout: " + Printable(timeout),
                     Post(port, kPing, type, frame, "grpc-timeout: " + timeout + "\r\n"), any});
  }
  return cases;
}

std::vector<HttpCase> HttpCases(int port) {
  const std::string host = "Host: 127.0.0.1:" + std::to_string(port) + "\r\n";
  const std::string chunked =
      "Content-Type: application/grpc-web\r\nTransfer-Encoding: chunked\r\n";
  const std::string head = HttpHead(port, "POST", kPing, chunked);
  const std::vector<std::string> no = {"400", "404", "405", "413", "414",
                                       "421", "431", "501", "505", "closed"};
  std::vector<std::string> no_or_silent = no;
  no_or_silent.push_back("silent");
  std::vector<std::string> any = no_or_silent;
  any.push_back("200");
  const std::string body = std::string("5\r\n\0\0\0\0\0\r\n", 10);
  std::vector<HttpCase> cases = {
      {"trailer of 64 KiB", head + body + "0\r\nX: " + std::string(65'536, 'x') + "\r\n\r\n", any},
      {"trailer of 64 KiB, foreign host",
       "POST / HTTP/1.1\r\nHost: evil.example\r\n" + chunked + "\r\n" + body +
           "0\r\nX: " + std::string(65'536, 'x') + "\r\n\r\n",
       no},
      {"trailer with a name of 64 KiB",
       head + body + "0\r\n" + std::string(65'536, 'x') + ": x\r\n\r\n", any},
      {"header with a name of 70 KB",
       HttpHead(port, "GET", "/", std::string(70'000, 'n') + ": x\r\n"), no},
      {"header of 70 KB", HttpHead(port, "GET", "/", "X: " + std::string(70'000, 'n') + "\r\n"),
       no},
      {"target of 70 KB", HttpHead(port, "GET", "/" + std::string(70'000, 'n')), no},
      {"method of 70 KB", HttpHead(port, std::string(70'000, 'M'), "/"), no},
      {"no host", "GET / HTTP/1.1\r\n\r\n", no},
      {"two hosts", "GET / HTTP/1.1\r\n" + host + "Host: evil.example\r\n\r\n", any},
      {"two lengths",
       HttpHead(port, "POST", kPing, "Content-Length: 5\r\nContent-Length: 6\r\n") + "abcde", no},
      {"length and chunked",
       HttpHead(port, "POST", kPing, "Content-Length: 5\r\n" + chunked) + body + "0\r\n\r\n", any},
      {"negative length", HttpHead(port, "POST", kPing, "Content-Length: -1\r\n"), no},
      {"length of 2^64", HttpHead(port, "POST", kPing, "Content-Length: 18446744073709551616\r\n"),
       no},
      {"length of 2^63, nothing sent",
       HttpHead(port, "POST", kPing, "Content-Length: 9223372036854775807\r\n"), no_or_silent},
      {"HTTP/0.9", "GET /\r\n", no},
      {"HTTP/9.9", "GET / HTTP/9.9\r\n" + host + "\r\n", no},
      {"HTTP/2's preface", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", no},
      {"TLS hello", std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11), no_or_silent},
      {"bare line feeds", "GET / HTTP/1.1\n" + host + "\n\n", no_or_silent},
      {"transfer coding unknown",
       HttpHead(port, "POST", kPing, "Transfer-Encoding: gzip, gzip\r\n"), no_or_silent},
      {"upgrade to a web socket",
       HttpHead(port, "GET", "/", "Connection: Upgrade\r\nUpgrade: websocket\r\n"), any},
      {"expects 100-continue",
       HttpHead(port, "POST", kPing, "Expect: 100-continue\r\nContent-Length: 5\r\n"), any},
      {"CONNECT", "CONNECT evil.example:80 HTTP/1.1\r\n" + host + "\r\n", no},
      {"4 KB of 0xff", std::string(4096, '\xff'), no},
      {"zeros", std::string(4096, '\0'), no},
  };
  for (const std::string size : {"ffffffffffffffff", "fffffffffffffffff", "7fffffffffffffff",
                                 "80000000", "-1", "0x10", "g", "", " 5", "5 5"}) {
    cases.push_back({"chunk size '" + size + "'", head + size + "\r\nabcde\r\n",
                     size.size() > 7 ? any : no_or_silent});
  }
  cases.push_back(
      {"chunk size of 100000 zeros", head + std::string(100'000, '0') + "5\r\n", no_or_silent});
  cases.push_back({"chunk without its end", head + "5\r\nabcdeXX0\r\n\r\n", no_or_silent});
  cases.push_back({"extension of 1 MB",
                   head + "5;x=" + std::string(1'000'000, 'e') + "\r\nabcde\r\n0\r\n\r\n", any});
  cases.push_back({"extension in quotes, never closed", head + "5;x=\"" + std::string(100'000, 'q'),
                   no_or_silent});
  return cases;
}

void SendMalformedHttp(const Battle& battle) {
  const int port = battle.target.http_port();
  while (!battle.over()) {
    for (const auto& cases : {ForwardedHeaderCases(port), GrpcWebCases(port), HttpCases(port)}) {
      for (const HttpCase& one : cases) {
        if (battle.over()) return;
        battle.tally.Add("HTTP " + AnswerTo(port, one.bytes, milliseconds(200)));
      }
    }
  }
}

}  // namespace saccade::testing
