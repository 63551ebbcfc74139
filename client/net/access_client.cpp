#include "client/net/access_client.hpp"

#include <grpcpp/grpcpp.h>

#include <array>
#include <chrono>
#include <utility>

#include "client/net/channel.hpp"
#include "saccade/v1/access.grpc.pb.h"

namespace saccade::net {
namespace {

constexpr std::array<std::pair<v1::AccessRole, const char*>, 5> kRoles = {
    {{v1::ACCESS_ROLE_VIEWER, "viewer"},
     {v1::ACCESS_ROLE_ANNOTATOR, "annotator"},
     {v1::ACCESS_ROLE_PILOT, "pilot"},
     {v1::ACCESS_ROLE_WEARER, "wearer"},
     {v1::ACCESS_ROLE_OWNER, "owner"}}};

std::string WordOf(v1::AccessRole role) {
  for (const auto& [known, word] : kRoles) {
    if (known == role) return word;
  }
  return "unknown";
}

v1::AccessRole RoleOf(const std::string& word) {
  for (const auto& [known, name] : kRoles) {
    if (name == word) return known;
  }
  return v1::ACCESS_ROLE_UNSPECIFIED;
}

Invite FromProto(const v1::Invite& message) {
  return {message.id(),
          WordOf(message.role()),
          message.label(),
          message.created_unix_s(),
          message.expires_unix_s(),
          message.uses(),
          message.used(),
          message.revoked(),
          message.waiting_room(),
          message.person()};
}

Waiting FromProto(const v1::WaitingPerson& message) {
  return {message.id(),        message.display_name(), WordOf(message.role()),
          message.invite_id(), message.label(),        message.since_unix_s()};
}

}  // namespace

class AccessClient::Impl {
 public:
  explicit Impl(const ConnectionOptions& options)
      : options_(options), stub_(v1::AccessService::NewStub(MakeChannel(options))) {}

  template <typename Request, typename Response>
  absl::StatusOr<Response> Call(grpc::Status (v1::AccessService::Stub::*method)(
                                    grpc::ClientContext*, const Request&, Response*),
                                const Request& request) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + options_.deadline);
    Authorise(options_, context);
    Response response;
    const grpc::Status status = ((*stub_).*method)(&context, request, &response);
    if (!status.ok()) return Explain(options_, status);
    return response;
  }

  absl::StatusOr<Pass> Redeem(const v1::RedeemRequest& request) {
    const auto response = Call(&v1::AccessService::Stub::Redeem, request);
    if (!response.ok()) return response.status();
    return Pass{response->token(), WordOf(response->role()), response->expires_unix_s(),
                response->waiting()};
  }

 private:
  const ConnectionOptions options_;
  const std::unique_ptr<v1::AccessService::Stub> stub_;
};

AccessClient::AccessClient(const ConnectionOptions& options)
    : impl_(std::make_unique<Impl>(options)) {}
AccessClient::~AccessClient() = default;

absl::StatusOr<Pass> AccessClient::Redeem(const std::string& invite,
                                          const std::string& display_name) {
  static const std::string kMark = "#invite=";
  v1::RedeemRequest request;
  const std::size_t at = invite.find(kMark);
  request.set_invite(at == std::string::npos ? invite : invite.substr(at + kMark.size()));
  request.set_display_name(display_name);
  return impl_->Redeem(request);
}

absl::StatusOr<Pass> AccessClient::RedeemIdToken(const std::string& id_token) {
  v1::RedeemRequest request;
  request.set_id_token(id_token);
  return impl_->Redeem(request);
}

absl::StatusOr<bool> AccessClient::Waits() {
  const auto response = impl_->Call(&v1::AccessService::Stub::GetAccess, v1::GetAccessRequest());
  if (!response.ok()) return response.status();
  return response->waiting();
}

absl::StatusOr<NewInvite> AccessClient::Create(const std::string& role, std::uint32_t life_s,
                                               std::uint32_t uses, const std::string& label,
                                               bool waiting_room) {
  v1::CreateInviteRequest request;
  request.set_role(RoleOf(role));
  request.set_life_s(life_s);
  request.set_uses(uses);
  request.set_label(label);
  request.set_waiting_room(waiting_room);
  const auto response = impl_->Call(&v1::AccessService::Stub::CreateInvite, request);
  if (!response.ok()) return response.status();
  return NewInvite{FromProto(response->invite()), response->link()};
}

absl::StatusOr<std::vector<Invite>> AccessClient::List() {
  const auto response =
      impl_->Call(&v1::AccessService::Stub::ListInvites, v1::ListInvitesRequest());
  if (!response.ok()) return response.status();
  std::vector<Invite> all;
  for (const v1::Invite& invite : response->invites()) all.push_back(FromProto(invite));
  return all;
}

absl::StatusOr<std::vector<Waiting>> AccessClient::WaitingRoom() {
  const auto response =
      impl_->Call(&v1::AccessService::Stub::ListWaiting, v1::ListWaitingRequest());
  if (!response.ok()) return response.status();
  std::vector<Waiting> all;
  for (const v1::WaitingPerson& person : response->people()) all.push_back(FromProto(person));
  return all;
}

absl::StatusOr<Waiting> AccessClient::Admit(const std::string& id, bool refuse) {
  v1::AdmitRequest request;
  request.set_id(id);
  request.set_refuse(refuse);
  const auto response = impl_->Call(&v1::AccessService::Stub::Admit, request);
  if (!response.ok()) return response.status();
  return FromProto(response->person());
}

absl::StatusOr<int> AccessClient::Revoke(const std::string& id, bool undo) {
  v1::RevokeInviteRequest request;
  request.set_id(id);
  request.set_undo(undo);
  const auto response = impl_->Call(&v1::AccessService::Stub::RevokeInvite, request);
  if (!response.ok()) return response.status();
  return static_cast<int>(response->passes());
}

absl::StatusOr<std::vector<AuditEntry>> AccessClient::Audit(std::uint32_t most) {
  v1::ListAuditRequest request;
  request.set_most(most);
  const auto response = impl_->Call(&v1::AccessService::Stub::ListAudit, request);
  if (!response.ok()) return response.status();
  std::vector<AuditEntry> all;
  for (const v1::AuditEntry& entry : response->entries()) {
    all.push_back({entry.unix_ms(), entry.participant_id(), entry.display_name(), entry.invite_id(),
                   entry.call(), entry.outcome()});
  }
  return all;
}

}  // namespace saccade::net
