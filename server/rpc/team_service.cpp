#include "server/rpc/team_service.hpp"

#include <algorithm>
#include <deque>

#include "server/rpc/early_handler.hpp"
#include "server/rpc/team_messages.hpp"
#include "server/rpc/unary_call.hpp"
#include "shared/wire/from_proto.hpp"

namespace saccade {
namespace {

constexpr char kTell[] = "TeamService/Tell", kFollow[] = "TeamService/Follow",
               kGetTeam[] = "TeamService/GetTeam";
constexpr std::size_t kMaxWaiting = 64;  // news of one follower; 45 KB a keyframe

absl::Status NoTeam() {
  return absl::FailedPreconditionError(
      "team: this server takes part in none; start it with --team");
}

}  // namespace

/// One Follow: at most one write under way. Owns itself from Keep until OnDone.
class TeamService::Follower final : public grpc::ServerWriteReactor<grpc::ByteBuffer>,
                                    public std::enable_shared_from_this<Follower> {
 public:
  explicit Follower(TeamService& service) : service_(service) {}
  std::string access_id;

  /// Until OnDone.
  void Keep(std::shared_ptr<Follower> self) { self_ = std::move(self); }
  void Begin(TeamPort& team) {
    listening_ = team.Listen([weak = weak_from_this()](const auto& news) {
      if (const auto follower = weak.lock()) follower->Add(news);
    });
  }
  void End(const grpc::Status& status) {
    {
      const std::lock_guard lock(mutex_);
      if (ending_ || finished_) return;
      if (writing_) {
        ending_ = status;
        return;
      }
      finished_ = true;
    }
    Finish(status);
  }

 private:
  void Add(const std::shared_ptr<const TeamNews>& news) {
    {
      const std::lock_guard lock(mutex_);
      for (const auto& part : InParts(news)) waiting_.push_back(part);
      while (waiting_.size() > kMaxWaiting) waiting_.pop_front();
    }
    Pump();
  }
  void Pump() {
    {
      const std::lock_guard lock(mutex_);
      if (writing_ || finished_ || ending_ || waiting_.empty()) return;
      const grpc::Slice bytes(ToProto(*waiting_.front()).SerializeAsString());
      news_ = grpc::ByteBuffer(&bytes, 1);
      waiting_.pop_front();
      writing_ = true;
    }
    StartWrite(&news_);
  }
  void OnWriteDone(bool ok) override {
    std::optional<grpc::Status> end;
    {
      const std::lock_guard lock(mutex_);
      writing_ = false;
      if (finished_) return;
      if (ending_) end = ending_;
      if (!ok && !end) end = grpc::Status::CANCELLED;
      finished_ = end.has_value();
    }
    end ? Finish(*end) : Pump();
  }
  void OnCancel() override { End(grpc::Status::CANCELLED); }
  void OnDone() override {
    service_.Forget(this);
    listening_.reset();
    // The port's thread may hold a reference for the length of one Add.
    const std::shared_ptr<Follower> last = std::move(self_);
  }

  TeamService& service_;
  std::shared_ptr<Follower> self_;
  std::shared_ptr<void> listening_;
  std::mutex mutex_;
  std::deque<std::shared_ptr<const TeamNews>> waiting_;
  grpc::ByteBuffer news_;  // being written while writing_
  bool writing_ = false, finished_ = false;
  std::optional<grpc::Status> ending_;
};

TeamService::TeamService(TeamPort* team, Gatekeeper& gate) : team_(team), gate_(gate) {
  MarkMethodCallback(0, Early(gate, kTell, this, &TeamService::Tell));
  MarkMethodCallback(2, Early(gate, kGetTeam, this, &TeamService::GetTeam));
}

grpc::ServerUnaryReactor* TeamService::Tell(grpc::CallbackServerContext* context,
                                            const v1::TellTeamRequest* request,
                                            v1::TellTeamResponse* response) {
  UnaryCall call(*context, kTell, UnaryCall::Log::kRefusals);
  if (const auto entered = call.Enter(gate_, Toll::kPoint); !entered.ok()) {
    return call.Finish(entered.status());
  }
  if (team_ == nullptr) return call.Finish(NoTeam());
  absl::StatusOr<TeamNews> news = FromProto(request->news(), "news");
  if (!news.ok()) return call.Finish(news.status());
  if (news->device_id == team_->device_id()) {
    return call.Finish(absl::InvalidArgumentError("news.device_id: is this server's own"));
  }
  team_->Hear(std::make_shared<const TeamNews>(*std::move(news)));
  response->set_device_id(team_->device_id());
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* TeamService::GetTeam(grpc::CallbackServerContext* context,
                                               const v1::GetTeamRequest* /*request*/,
                                               v1::GetTeamResponse* response) {
  UnaryCall call(*context, kGetTeam, UnaryCall::Log::kRefusals);
  if (const auto entered = call.Enter(gate_, Toll::kRead); !entered.ok()) {
    return call.Finish(entered.status());
  }
  if (team_ == nullptr) return call.Finish(NoTeam());
  *response = ToProto(team_->State());
  return call.Finish(absl::OkStatus());
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* TeamService::Follow(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* encoded) {
  auto follower = std::make_shared<Follower>(*this);
  Follower* const reactor = follower.get();
  absl::Status status = gate_.Arrive(*context, encoded->Length());
  v1::FollowTeamRequest request;
  grpc::ByteBuffer buffer = *encoded;  // the same bytes: reading one empties it
  if (status.ok() &&
      !grpc::SerializationTraits<v1::FollowTeamRequest>::Deserialize(&buffer, &request).ok()) {
    status = absl::InvalidArgumentError("request: is no FollowTeamRequest");
  }
  if (status.ok()) {
    const absl::StatusOr<Access> access = gate_.Enter(*context, kFollow, Toll::kSubscribe);
    status = access.status();
    if (access.ok()) follower->access_id = access->id;
  }
  if (status.ok() && team_ == nullptr) status = NoTeam();
  if (status.ok()) status = wire::CheckUuid(request.device_id(), "device_id");
  {
    const std::lock_guard guard(mutex_);
    if (status.ok() && stopped_) status = absl::UnavailableError("the server is shutting down");
    if (status.ok() && followers_.size() >= kMaxFollowers) {
      status = absl::ResourceExhaustedError("team: 16 follow already, as many as may");
    }
    followers_.push_back(reactor);
  }
  reactor->Keep(follower);
  Audit(kFollow, "", status);
  if (status.ok()) {
    reactor->Begin(*team_);
  } else {
    reactor->End(ToGrpc(status));
  }
  return reactor;
}

void TeamService::Stop() {
  const std::lock_guard guard(mutex_);
  stopped_ = true;
  const grpc::Status why(grpc::StatusCode::UNAVAILABLE, "the server is shutting down");
  for (Follower* follower : followers_) follower->End(why);
}

void TeamService::End(const std::vector<std::string>& access_ids, const absl::Status& why) {
  const std::lock_guard guard(mutex_);
  for (Follower* follower : followers_) {
    const bool theirs =
        std::find(access_ids.begin(), access_ids.end(), follower->access_id) != access_ids.end();
    if (theirs && !follower->access_id.empty()) follower->End(ToGrpc(why));
  }
}

void TeamService::Forget(Follower* follower) {
  const std::lock_guard guard(mutex_);
  std::erase(followers_, follower);
}

}  // namespace saccade
