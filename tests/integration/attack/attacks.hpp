#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/integration/attack/calls.hpp"
#include "tests/integration/attack/target.hpp"

namespace saccade::testing {

/// One attack on one server, bounded in time. What it got is counted in `tally`.
struct Battle {
  Target& target;
  std::uint32_t seed;
  Clock::time_point end;
  Tally& tally;

  bool over() const { return Clock::now() >= end || !target.Alive(); }
  /// Sleeps, but not beyond the end.
  void Rest(milliseconds pause) const;
};

/// One thing to send to the HTTP port, and what may come back: status codes, "closed" or "silent".
struct HttpCase {
  std::string name, bytes;
  std::vector<std::string> wanted;
};
std::vector<HttpCase> ForwardedHeaderCases(int port);
std::vector<HttpCase> GrpcWebCases(int port);
std::vector<HttpCase> HttpCases(int port);

/// One thing to send to the gRPC port in place of HTTP/2.
struct Http2Case {
  std::string name, bytes;
};
std::vector<Http2Case> Http2Cases();
/// A call as HTTP/2 sends it, with preface and settings, and no more after it.
std::string Http2Call(const std::string& method, const std::string& payload);

/// Full names, "/saccade.v1.SessionService/Join", of every method of every service.
std::vector<std::string> MethodNames();
/// The request of `method` with every field filled with what nobody should send. Strings that want
/// a session get `session_id` most of the time.
std::string FuzzedRequest(const std::string& method, const std::string& session_id,
                          std::uint32_t seed);
/// The request of `method` with `text` in every string field.
std::string RequestWithText(const std::string& method, const std::string& text);

// The attacks. Each runs until battle.over() and takes back what it made.
void SendMalformedHttp(const Battle& battle);
void SendMalformedHttp2(const Battle& battle);
void FuzzMethods(const Battle& battle);
/// Header-like bytes without an end, each kind once: `megabytes` altogether unless it is hung up
/// on.
void SendEndlessHttp(const Battle& battle, int megabytes);
/// Fills first, then lists and edits for `race`.
void ListWhileOthersEdit(const Battle& battle, int annotations, milliseconds race);
void LeaveGhosts(const Battle& battle, long most = 1'000'000);
void UseUpDescriptors(const Battle& battle, int connections, milliseconds hold);
void HoldStreams(const Battle& battle, int streams);
/// `calls` in turn, many under way at once, as near to `per_second` as this machine comes.
struct FloodCall {
  std::string method, request;
};
void Flood(const Battle& battle, const std::vector<FloodCall>& calls, double per_second);
FloodCall JoinCall();
/// Everything that costs the server work, from one session.
std::vector<FloodCall> CostlyCalls(const std::string& session_id);
void QueueForLease(const Battle& battle, int sessions);
void ReadSlowly(const Battle& battle, int subscribers);
/// Connections that send a byte now and then.
void DripBytes(const Battle& battle, int connections, milliseconds pause);

/// From here this thread gives way to the server and the good expert: an attack that takes their
/// processor says nothing about the server.
void GiveWay();
/// Deletes every annotation whose text does not begin with "mark ".
void DeleteStrangersAnnotations(Target& target);

}  // namespace saccade::testing
