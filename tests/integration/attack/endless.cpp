// Bytes without an end, and bytes that hardly come.
#include <vector>

#include "tests/integration/attack/attacks.hpp"

namespace saccade::testing {

void SendEndlessHttp(const Battle& battle, int megabytes) {
  const int port = battle.target.http_port();
  const std::string call = HttpHead(port, "POST", "/saccade.v1.SessionService/Ping",
                                    "Content-Type: application/grpc-web\r\n"
                                    "Transfer-Encoding: chunked\r\n");
  const std::string page = "GET / HTTP/1.1\r\nHost: localhost\r\n";
  struct Endless {
    std::string name, begin, again;
  };
  const std::vector<Endless> kinds = {
      {"trailers", call + "0\r\n", "X-Trailer: " + std::string(100, 't') + "\r\n"},
      {"one trailer", call + "0\r\nX-Trailer: ", std::string(1024, 't')},
      {"chunk extensions", call, "1;x=" + std::string(2000, 'e') + "\r\na\r\n"},
      {"one chunk extension", call + "1;x=", std::string(1024, 'e')},
      {"chunks of one byte", call, "1\r\na\r\n"},
      {"headers", page, "X-Header: " + std::string(100, 'h') + "\r\n"},
      {"one header", page + "X-Header: ", std::string(1024, 'h')},
      {"folded header", page + "X-Header: a\r\n", " " + std::string(200, 'f') + "\r\n"},
  };
  const std::size_t each = (static_cast<std::size_t>(megabytes) << 20) / kinds.size();
  for (const Endless& kind : kinds) {
    std::string piece;
    while (piece.size() < 65'536) piece += kind.again;
    Socket socket(port);
    std::size_t sent = socket.Send(kind.begin);
    while (sent < each && !battle.over()) {
      const std::size_t taken = socket.Send(piece, milliseconds(500));
      sent += taken;
      if (taken < piece.size()) break;
    }
    battle.tally.Add("KiB of " + kind.name, static_cast<long>(sent >> 10));
  }
}

void DripBytes(const Battle& battle, int connections, milliseconds pause) {
  const std::string http = HttpHead(battle.target.http_port(), "POST", "/", "X: y\r\n");
  const std::string http2 = Http2Call("/saccade.v1.SessionService/Ping", "");
  std::vector<Socket> sockets(static_cast<std::size_t>(connections));
  for (std::size_t turn = 0; !battle.over(); ++turn) {
    for (std::size_t i = 0; i < sockets.size(); ++i) {
      const std::string& text = i % 2 == 0 ? http : http2;
      if (!sockets[i].ok() || turn % text.size() == 0) {
        sockets[i] = Socket(i % 2 == 0 ? battle.target.http_port() : battle.target.grpc_port());
      }
      battle.tally.Add("bytes dripped", static_cast<long>(sockets[i].Send(
                                            text.substr(turn % text.size(), 1), milliseconds(1))));
    }
    battle.Rest(pause);
  }
}

}  // namespace saccade::testing
