// Peers that go without a word, stay without a word, or take the last descriptor with them.
#include <sys/socket.h>

#include <deque>

#include "saccade/v1/session.pb.h"
#include "tests/integration/attack/attacks.hpp"

namespace saccade::testing {
namespace {

std::string SubscribeRequestOf(const std::string& session_id) {
  v1::SubscribeRequest request;
  request.set_session_id(session_id);
  request.set_window(1);  // after one event the stream holds: nothing is written that could fail
  return request.SerializeAsString();
}

void Reset(Socket& socket) {
  const linger at_once{1, 0};
  setsockopt(socket.fd(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  socket.Close();
}

}  // namespace

void LeaveGhosts(const Battle& battle, long most) {
  const auto channel = battle.target.NewChannel();
  const int port = battle.target.http_port();
  std::string session_id;
  for (int turn = 0; !battle.over() && battle.tally.of("ghosts") < most; ++turn) {
    if (turn % 8 == 0) session_id = JoinSession(channel, v1::ROLE_VIEWER, milliseconds(200));
    Socket socket(port);
    const bool watch = turn % 3 == 2;
    socket.Send(GrpcWebCall(
        port, watch ? "/grpc.health.v1.Health/Watch" : "/saccade.v1.SessionService/Subscribe",
        watch ? "" : SubscribeRequestOf(session_id)));
    // Nothing may be left unread, or the system says more than a mere end.
    while (turn % 4 != 3 && !socket.Receive(milliseconds(10)).empty()) {
    }
    socket.Send("x");
    if (turn % 5 == 4) {
      Reset(socket);
    } else {
      socket.Close();
    }
    battle.tally.Add("ghosts");
    battle.Rest(milliseconds(2));
  }
}

void UseUpDescriptors(const Battle& battle, int connections, milliseconds hold) {
  while (!battle.over()) {
    std::deque<Socket> idle;
    for (int i = 0; i < connections && !battle.over(); ++i) {
      idle.emplace_back(i % 2 == 0 ? battle.target.grpc_port() : battle.target.http_port());
      battle.tally.Add(idle.back().ok() ? "connected" : "refused");
    }
    battle.Rest(hold);
    idle.clear();
    battle.Rest(hold);
  }
}

void HoldStreams(const Battle& battle, int streams) {
  const std::string reflection = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";
  const std::string health = "/grpc.health.v1.Health/Watch";
  HeldStreams held;
  std::vector<std::shared_ptr<grpc::Channel>> channels;
  for (int i = 0; i < streams; ++i) {
    if (i % 100 == 0) channels.push_back(battle.target.NewChannel());
    if (i % 2 == 0) {
      held.Open(channels.back(), reflection, std::string("\x3a\0", 2));
    } else {
      held.Open(channels.back(), health, "");
    }
  }
  int most = 0;
  while (!battle.over()) most = std::max(most, held.open(milliseconds(100)));
  battle.tally.Add("streams held at once", most);
}

void ReadSlowly(const Battle& battle, int subscribers) {
  const auto channel = battle.target.NewChannel();
  const int port = battle.target.http_port();
  std::deque<Socket> sockets;
  for (int i = 0; i < subscribers && !battle.over(); ++i) {
    const std::string session_id = JoinSession(channel, v1::ROLE_VIEWER, seconds(5));
    if (session_id.empty()) break;
    sockets.emplace_back(port, 2048);
    const std::string subscribe =
        GrpcWebCall(port, "/saccade.v1.SessionService/Subscribe", SubscribeRequestOf(session_id));
    sockets.back().Send(subscribe);
  }
  battle.tally.Add("slow readers", static_cast<long>(sockets.size()));
  while (!battle.over()) {
    for (Socket& socket : sockets) {
      const std::string byte = socket.Receive(milliseconds(0), {}, 1);
      battle.tally.Add("bytes read slowly", static_cast<long>(byte.size()));
    }
    battle.Rest(seconds(1));
  }
}

}  // namespace saccade::testing
