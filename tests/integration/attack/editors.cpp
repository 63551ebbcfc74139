// Readers of the whole list while others change it.
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

#include "client/net/connection.hpp"
#include "saccade/v1/annotation.pb.h"
#include "saccade/v1/session.pb.h"
#include "tests/integration/attack/attacks.hpp"

namespace saccade::testing {
namespace {

RawReply Create(const std::shared_ptr<grpc::Channel>& channel, const std::string& session_id,
                std::string& id) {
  v1::CreateAnnotationRequest request;
  request.set_session_id(session_id);
  request.set_request_id(net::RandomUuid());
  request.mutable_draft()->set_shape(v1::ANNOTATION_SHAPE_NOTE);
  request.mutable_draft()->set_text("a stranger's " + std::string(200, 's'));
  request.mutable_draft()->mutable_target()->mutable_point_in_world_m()->set_z(1);
  v1::CreateAnnotationResponse response;
  RawReply reply = Ask(channel, "AnnotationService/Create", request, response);
  id = response.annotation().id();
  return reply;
}

RawReply Delete(const std::shared_ptr<grpc::Channel>& channel, const std::string& session_id,
                const std::string& id) {
  v1::DeleteAnnotationRequest request;
  request.set_session_id(session_id);
  request.set_id(id);
  v1::DeleteAnnotationResponse response;
  return Ask(channel, "AnnotationService/Delete", request, response);
}

// Creates until there are `wanted` more, giving way where the server says so.
void Fill(const Battle& battle, int wanted) {
  const auto channel = battle.target.NewChannel();
  const std::string session_id = JoinSession(channel, v1::ROLE_EXPERT);
  for (int made = 0; made < wanted && !battle.over();) {
    std::string id;
    const RawReply reply = Create(channel, session_id, id);
    if (reply.status.ok()) {
      ++made;
      battle.tally.Add("annotations");
    } else {
      battle.tally.Add("refused while filling");
      battle.Rest(milliseconds(50));
    }
  }
}

void Edit(const Battle& battle) {
  const auto channel = battle.target.NewChannel();
  const std::string session_id = JoinSession(channel, v1::ROLE_EXPERT);
  while (!battle.over()) {
    std::string id;
    const RawReply reply = Create(channel, session_id, id);
    battle.tally.Add(reply.status);
    if (!reply.status.ok()) {
      battle.Rest(milliseconds(20));
    } else {
      battle.tally.Add(Delete(channel, session_id, id).status);
    }
  }
}

void List(const Battle& battle) {
  const auto channel = battle.target.NewChannel();
  const std::string session_id = JoinSession(channel, v1::ROLE_VIEWER);
  while (!battle.over()) {
    v1::ListAnnotationsRequest request;
    v1::ListAnnotationsResponse response;
    const RawReply reply = Ask(channel, "AnnotationService/List", request, response);
    battle.tally.Add("lists");
    if (!reply.status.ok()) battle.Rest(milliseconds(20));
  }
}

}  // namespace

void Battle::Rest(milliseconds pause) const {
  std::this_thread::sleep_until(std::min(end, Clock::now() + pause));
}

void GiveWay() { setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10); }

void ListWhileOthersEdit(const Battle& battle, int annotations, milliseconds race) {
  constexpr int kEach = 4;
  {
    std::vector<std::jthread> fillers;
    for (int i = 0; i < kEach; ++i) {
      fillers.emplace_back([&] { Fill(battle, annotations / kEach); });
    }
  }
  const Battle racing{battle.target, battle.seed, std::min(battle.end, Clock::now() + race),
                      battle.tally};
  std::vector<std::jthread> threads;
  for (int i = 0; i < kEach; ++i) {
    threads.emplace_back([&] { List(racing); });
    threads.emplace_back([&] { Edit(racing); });
  }
}

void DeleteStrangersAnnotations(Target& target) {
  const auto channel = target.NewChannel();
  const std::string session_id = JoinSession(channel, v1::ROLE_EXPERT);
  std::vector<std::string> ids;
  v1::ListAnnotationsRequest request;
  for (int page = 0; page < 10'000; ++page) {
    v1::ListAnnotationsResponse response;
    if (!Ask(channel, "AnnotationService/List", request, response).status.ok()) break;
    for (const v1::Annotation& one : response.annotations()) {
      if (one.text().rfind("mark ", 0) != 0) ids.push_back(one.id());
    }
    if (response.next_page_token().empty()) break;
    request.set_page_token(response.next_page_token());
  }
  const auto end = Clock::now() + seconds(30);
  for (const std::string& id : ids) {
    while (Clock::now() < end &&
           Delete(channel, session_id, id).Is(grpc::StatusCode::RESOURCE_EXHAUSTED)) {
      std::this_thread::sleep_for(milliseconds(50));
    }
  }
}

}  // namespace saccade::testing
