#include "server/rpc/team_link.hpp"

#include <absl/strings/str_cat.h>
#include <grpcpp/grpcpp.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "saccade/v1/access.grpc.pb.h"
#include "saccade/v1/team.grpc.pb.h"
#include "server/rpc/team_messages.hpp"
#include "shared/io/log.hpp"

namespace saccade {
namespace {

constexpr auto kAnswer = std::chrono::seconds(3);  // of one Tell; then the other is gone
constexpr auto kAgain = std::chrono::seconds(1);
constexpr std::size_t kMaxOnLink = 256;

/// What waits to be told. Outlives the link where the port's thread still holds it.
struct Outbox {
  std::mutex mutex;
  std::condition_variable_any changed;
  std::deque<std::shared_ptr<const TeamNews>> news;

  void Put(const std::shared_ptr<const TeamNews>& whole) {
    {
      const std::lock_guard lock(mutex);
      for (const auto& part : InParts(whole)) news.push_back(part);
      while (news.size() > kMaxOnLink) news.pop_front();
    }
    changed.notify_all();
  }
  /// Null: stopped.
  std::shared_ptr<const TeamNews> Take(const std::stop_token& stop) {
    std::unique_lock lock(mutex);
    if (!changed.wait(lock, stop, [this] { return !news.empty(); })) return nullptr;
    auto next = news.front();
    news.pop_front();
    return next;
  }
};

}  // namespace

class TeamLink::Impl {
 public:
  Impl(TeamLinkOptions options, TeamPort& team)
      : options_(std::move(options)),
        team_(team),
        token_(options_.token),
        thread_([this](const std::stop_token& stop) { Run(stop); }) {}
  ~Impl() {
    thread_.request_stop();
    Cancel();
    thread_.join();
  }

 private:
  void Run(const std::stop_token& stop) {
    bool told = false;
    while (!stop.stop_requested()) {
      const grpc::Status ended = Connect(stop);
      if (stop.stop_requested()) return;
      if (!std::exchange(told, true) || was_there_) {
        Log(absl::StrCat("team: ", options_.address,
                         was_there_ ? " is gone: " : " is not there: ", ended.error_message(),
                         "; the map goes on alone, tried again every second"));
      }
      was_there_ = false;
      std::mutex mutex;
      std::unique_lock lock(mutex);
      std::condition_variable_any().wait_for(lock, stop, kAgain, [] { return false; });
    }
  }

  /// Makes a token of the invite, where there is none yet.
  grpc::Status Enter(const std::shared_ptr<grpc::Channel>& channel) {
    if (!token_.empty() || options_.invite.empty()) return grpc::Status::OK;
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kAnswer);
    v1::RedeemRequest request;
    request.set_invite(options_.invite);
    request.set_display_name(options_.name);
    v1::RedeemResponse response;
    const grpc::Status redeemed =
        v1::AccessService::NewStub(channel)->Redeem(&context, request, &response);
    if (!redeemed.ok()) return redeemed;
    token_ = response.token();
    options_.keep_token(token_);
    return grpc::Status::OK;
  }

  /// One connection, until it ends.
  grpc::Status Connect(const std::stop_token& stop) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    grpc::SslCredentialsOptions tls;
    tls.pem_root_certs = options_.root_pem;
    const std::shared_ptr<grpc::Channel> channel = grpc::CreateCustomChannel(
        options_.address,
        options_.root_pem.empty() ? grpc::InsecureChannelCredentials() : grpc::SslCredentials(tls),
        arguments);
    if (!channel->WaitForConnected(std::chrono::system_clock::now() + kAgain)) {
      return {grpc::StatusCode::UNAVAILABLE,
              options_.root_pem.empty() ? "no answer; one that speaks TLS needs --team-trust"
                                        : "no answer, or not the certificate of --team-trust"};
    }
    if (const grpc::Status entered = Enter(channel); !entered.ok()) return entered;
    const auto stub = v1::TeamService::NewStub(channel);
    grpc::ClientContext context;
    Authorise(context);
    if (!SetFollowing(&context)) return grpc::Status::CANCELLED;
    const auto outbox = std::make_shared<Outbox>();
    const std::shared_ptr<void> listening =
        team_.Listen([outbox](const auto& news) { outbox->Put(news); });
    std::jthread teller([&](const std::stop_token& ended) {
      while (const auto news = outbox->Take(ended)) {
        if (Tell(*stub, *news, ended)) continue;
        context.TryCancel();
        return;
      }
    });
    v1::FollowTeamRequest request;
    request.set_device_id(team_.device_id());
    const auto reader = stub->Follow(&context, request);
    v1::TeamNews message;
    while (!stop.stop_requested() && reader->Read(&message)) {
      absl::StatusOr<TeamNews> news = FromProto(message, "news");
      if (!news.ok() || news->device_id == team_.device_id()) {
        context.TryCancel();
        reader->Finish();
        SetFollowing(nullptr);
        return {grpc::StatusCode::INVALID_ARGUMENT,
                news.ok() ? "it is this server itself" : std::string(news.status().message())};
      }
      if (!std::exchange(was_there_, true)) {
        Log(absl::StrCat("team: linked with ", options_.address));
      }
      team_.Hear(std::make_shared<const TeamNews>(*std::move(news)));
    }
    const grpc::Status status = reader->Finish();
    SetFollowing(nullptr);
    return status;
  }

  bool Tell(v1::TeamService::Stub& stub, const TeamNews& news, const std::stop_token& ended) {
    grpc::ClientContext context;
    const std::stop_callback cancel(ended, [&context] { context.TryCancel(); });
    Authorise(context);
    context.set_deadline(std::chrono::system_clock::now() + kAnswer);
    v1::TellTeamRequest request;
    *request.mutable_news() = ToProto(news);
    v1::TellTeamResponse response;
    const grpc::Status status = stub.Tell(&context, request, &response);
    // Too often: what was told is lost, the other is there.
    return status.ok() || status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED;
  }

  void Authorise(grpc::ClientContext& context) const {
    if (!token_.empty()) {
      context.AddMetadata("authorization", absl::StrCat("Bearer ", token_));
    }
  }

  bool SetFollowing(grpc::ClientContext* context) {
    const std::lock_guard lock(mutex_);
    following_ = context;
    return context == nullptr || !cancelled_;
  }
  void Cancel() {
    const std::lock_guard lock(mutex_);
    cancelled_ = true;
    if (following_ != nullptr) following_->TryCancel();
  }

  const TeamLinkOptions options_;
  TeamPort& team_;
  std::string token_;  // link's thread, but in Authorise of Tell: set before that begins
  std::mutex mutex_;
  grpc::ClientContext* following_ = nullptr;
  bool cancelled_ = false;
  bool was_there_ = false;  // link's thread
  std::jthread thread_;
};

TeamLink::TeamLink(TeamLinkOptions options, TeamPort& team)
    : impl_(std::make_unique<Impl>(std::move(options), team)) {}
TeamLink::~TeamLink() = default;

}  // namespace saccade
