#pragma once

#include <mutex>
#include <vector>

#include "saccade/v1/team.grpc.pb.h"
#include "server/pipeline/team_port.hpp"
#include "server/rpc/gatekeeper.hpp"

namespace saccade {

/// Follow gets its bytes unparsed: who is refused costs no parsing.
using TeamServiceBase =
    v1::TeamService::WithCallbackMethod_Tell<v1::TeamService::WithRawCallbackMethod_Follow<
        v1::TeamService::WithCallbackMethod_GetTeam<v1::TeamService::Service>>>;

/// saccade.v1.TeamService: another wearer's server, over `server/app/team_runner`. Handlers run on
/// gRPC's threads and never block; a follower who reads too slowly misses keyframes, oldest first.
class TeamService final : public TeamServiceBase {
 public:
  static constexpr std::size_t kMaxFollowers = 16;

  /// `team` outlives the service; null: this server takes part in none.
  TeamService(TeamPort* team, Gatekeeper& gate);

  grpc::ServerUnaryReactor* Tell(grpc::CallbackServerContext* context,
                                 const v1::TellTeamRequest* request,
                                 v1::TellTeamResponse* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* Follow(grpc::CallbackServerContext* context,
                                                     const grpc::ByteBuffer* encoded) override;
  grpc::ServerUnaryReactor* GetTeam(grpc::CallbackServerContext* context,
                                    const v1::GetTeamRequest* request,
                                    v1::GetTeamResponse* response) override;

  /// Ends all streams, and those that come.
  void Stop();
  /// Those of tokens that are not valid any more.
  void End(const std::vector<std::string>& access_ids, const absl::Status& why);

 private:
  class Follower;
  void Forget(Follower* follower);

  TeamPort* const team_;
  Gatekeeper& gate_;
  std::mutex mutex_;
  std::vector<Follower*> followers_;
  bool stopped_ = false;
};

}  // namespace saccade
