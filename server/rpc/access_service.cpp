#include "server/rpc/access_service.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "server/rpc/early_handler.hpp"
#include "server/rpc/unary_call.hpp"
#include "shared/wire/from_proto.hpp"

namespace saccade {
namespace {

v1::AccessRole ToProto(AccessRole role) {
  switch (role) {
    case AccessRole::kAnyone:
      return v1::ACCESS_ROLE_UNSPECIFIED;
    case AccessRole::kViewer:
      return v1::ACCESS_ROLE_VIEWER;
    case AccessRole::kAnnotator:
      return v1::ACCESS_ROLE_ANNOTATOR;
    case AccessRole::kPilot:
      return v1::ACCESS_ROLE_PILOT;
    case AccessRole::kWearer:
      return v1::ACCESS_ROLE_WEARER;
    case AccessRole::kOwner:
      return v1::ACCESS_ROLE_OWNER;
  }
  return v1::ACCESS_ROLE_UNSPECIFIED;
}

// kAnyone, which no invite is for, where it is no role of ours.
AccessRole FromProto(v1::AccessRole role) {
  for (const AccessRole known : {AccessRole::kViewer, AccessRole::kAnnotator, AccessRole::kPilot,
                                 AccessRole::kWearer, AccessRole::kOwner}) {
    if (ToProto(known) == role) return known;
  }
  return AccessRole::kAnyone;
}

void Fill(const InviteFacts& facts, v1::Invite& invite) {
  invite.set_id(facts.id);
  invite.set_role(ToProto(facts.role));
  invite.set_created_unix_s(facts.created_unix_s);
  invite.set_expires_unix_s(facts.expires_unix_s);
  invite.set_uses(static_cast<std::uint32_t>(facts.uses));
  invite.set_used(static_cast<std::uint32_t>(facts.used));
  invite.set_revoked(facts.revoked);
  invite.set_label(facts.label);
  invite.set_waiting_room(facts.waits);
  invite.set_person(facts.person);
}

void Fill(const WaitingFacts& facts, v1::WaitingPerson& person) {
  person.set_id(facts.id);
  person.set_display_name(facts.display_name);
  person.set_role(ToProto(facts.role));
  person.set_since_unix_s(facts.since_unix_s);
  person.set_invite_id(facts.invite_id);
  person.set_label(facts.label);
}

void Fill(const AuditFacts& facts, v1::AuditEntry& entry) {
  entry.set_unix_ms(facts.unix_ms);
  entry.set_participant_id(facts.participant_id);
  entry.set_display_name(facts.display_name);
  entry.set_access_id(facts.access_id);
  entry.set_invite_id(facts.invite_id);
  entry.set_call(facts.call);
  entry.set_outcome(facts.outcome);
}

constexpr int kUsualAudit = 1000;
constexpr std::uint32_t kMostAudit = 10'000;
constexpr int kMostNumber = 1'000'000'000;  // beyond every limit, and within int

absl::StatusOr<InviteDraft> FromProto(const v1::CreateInviteRequest& request) {
  InviteDraft draft;
  draft.role = FromProto(request.role());
  if (request.life_s() != 0) draft.life_s = request.life_s();
  if (request.uses() != 0) {
    draft.uses = static_cast<int>(std::min<std::uint32_t>(request.uses(), kMostNumber));
  }
  absl::Status label = wire::CheckText(request.label(), wire::kMaxNameBytes, "label");
  if (!label.ok()) return label;
  draft.label = request.label();
  draft.waits = request.waiting_room();
  if (absl::Status valid = draft.Validate(); !valid.ok()) return valid;
  return draft;
}

}  // namespace

AccessService::AccessService(AccessBook& book, Gatekeeper& gate, MakeLink make_link, bool insecure,
                             IdentityProvider* provider)
    : book_(book),
      gate_(gate),
      make_link_(std::move(make_link)),
      insecure_(insecure),
      provider_(provider) {
  // By their numbers in the proto; limits_test calls every one.
  MarkMethodCallback(0, Early(gate, "AccessService/GetAccess", this, &AccessService::GetAccess));
  MarkMethodCallback(1, Early(gate, "AccessService/Redeem", this, &AccessService::Redeem));
  MarkMethodCallback(2,
                     Early(gate, "AccessService/CreateInvite", this, &AccessService::CreateInvite));
  MarkMethodCallback(3,
                     Early(gate, "AccessService/ListInvites", this, &AccessService::ListInvites));
  MarkMethodCallback(4,
                     Early(gate, "AccessService/RevokeInvite", this, &AccessService::RevokeInvite));
  MarkMethodCallback(5,
                     Early(gate, "AccessService/ListWaiting", this, &AccessService::ListWaiting));
  MarkMethodCallback(6, Early(gate, "AccessService/Admit", this, &AccessService::Admit));
  MarkMethodCallback(7, Early(gate, "AccessService/ListAudit", this, &AccessService::ListAudit));
  MarkMethodCallback(8,
                     Early(gate, "AccessService/BeginSignIn", this, &AccessService::BeginSignIn));
  MarkMethodCallback(9,
                     Early(gate, "AccessService/FinishSignIn", this, &AccessService::FinishSignIn));
}

grpc::ServerUnaryReactor* AccessService::GetAccess(Context* context,
                                                   const v1::GetAccessRequest* /*request*/,
                                                   v1::GetAccessResponse* response) {
  UnaryCall call(*context, "AccessService/GetAccess", UnaryCall::Log::kNothing);
  if (const auto entered = call.Enter(gate_, Toll::kRead); !entered.ok()) {
    return call.Finish(entered.status());
  }
  response->set_token_required(book_.token_required());
  response->set_insecure(insecure_);
  if (provider_ != nullptr) response->set_sign_in_name(provider_->name());
  const absl::StatusOr<Access> access = gate_.Who(*context);
  if (access.ok()) {
    response->set_waiting(access->waiting);
    response->set_role(ToProto(access->role));
    response->set_expires_unix_s(access->expires_unix_s);
  } else {
    response->set_refusal(std::string(access.status().message()));
  }
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* AccessService::Redeem(Context* context, const v1::RedeemRequest* request,
                                                v1::RedeemResponse* response) {
  UnaryCall call(*context, "AccessService/Redeem", UnaryCall::Log::kAll);
  if (const auto entered = call.Enter(gate_, Toll::kRedeem); !entered.ok()) {
    return call.Finish(entered.status());
  }
  if (absl::Status name = CheckDisplayName(request->display_name()); !name.ok()) {
    return call.Finish(name);
  }
  if (!request->id_token().empty()) {
    if (!request->invite().empty()) {
      return call.Finish(absl::InvalidArgumentError("id_token: give either this or an invite"));
    }
    if (provider_ == nullptr) return call.Finish(NoProvider());
    provider_->Verify(request->id_token(), LetIn(call, response));
    return call.reactor();
  }
  const auto fill = [response](const Issued& issued) { Tell(issued, *response); };
  book_.Redeem(request->invite(), call.Answer<Issued>(fill), request->display_name());
  return call.reactor();
}

void AccessService::Tell(const Issued& issued, v1::RedeemResponse& response) {
  response.set_token(issued.token);
  response.set_role(ToProto(issued.invite.role));
  response.set_expires_unix_s(issued.invite.expires_unix_s);
  response.set_waiting(issued.waiting);
}

grpc::ServerUnaryReactor* AccessService::CreateInvite(Context* context,
                                                      const v1::CreateInviteRequest* request,
                                                      v1::CreateInviteResponse* response) {
  UnaryCall call(*context, "AccessService/CreateInvite", UnaryCall::Log::kAll);
  if (const auto entered = call.Enter(gate_, Toll::kRead); !entered.ok()) {
    return call.Finish(entered.status());
  }
  absl::StatusOr<InviteDraft> draft = FromProto(*request);
  if (!draft.ok()) return call.Finish(draft.status());
  book_.CreateInvite(*std::move(draft), call.Answer<Issued>([this, response](const Issued& issued) {
    Fill(issued.invite, *response->mutable_invite());
    response->set_link(make_link_ ? make_link_(issued.invite.role, issued.token)
                                  : absl::StrCat("#invite=", issued.token));
  }));
  return call.reactor();
}

grpc::ServerUnaryReactor* AccessService::ListInvites(Context* context,
                                                     const v1::ListInvitesRequest* /*request*/,
                                                     v1::ListInvitesResponse* response) {
  UnaryCall call(*context, "AccessService/ListInvites", UnaryCall::Log::kRefusals);
  if (const auto entered = call.Enter(gate_, Toll::kRead); !entered.ok()) {
    return call.Finish(entered.status());
  }
  for (const InviteFacts& facts : book_.Invites()) Fill(facts, *response->add_invites());
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* AccessService::RevokeInvite(Context* context,
                                                      const v1::RevokeInviteRequest* request,
                                                      v1::RevokeInviteResponse* response) {
  UnaryCall call(*context, "AccessService/RevokeInvite", UnaryCall::Log::kAll);
  if (const auto entered = call.Enter(gate_, Toll::kRead); !entered.ok()) {
    return call.Finish(entered.status());
  }
  const auto answer = call.Answer<int>(
      [response](int passes) { response->set_passes(static_cast<std::uint32_t>(passes)); });
  if (request->undo()) {
    book_.LetBack(request->id(), answer);
  } else {
    book_.Revoke(request->id(), answer);
  }
  return call.reactor();
}

grpc::ServerUnaryReactor* AccessService::ListWaiting(Context* context,
                                                     const v1::ListWaitingRequest* /*request*/,
                                                     v1::ListWaitingResponse* response) {
  // A wearer's page asks all the time.
  UnaryCall call(*context, "AccessService/ListWaiting", UnaryCall::Log::kNothing);
  if (const auto entered = call.Enter(gate_, Toll::kRead); !entered.ok()) {
    return call.Finish(entered.status());
  }
  for (const WaitingFacts& facts : book_.Waiting()) Fill(facts, *response->add_people());
  return call.Finish(absl::OkStatus());
}

grpc::ServerUnaryReactor* AccessService::Admit(Context* context, const v1::AdmitRequest* request,
                                               v1::AdmitResponse* response) {
  UnaryCall call(*context, "AccessService/Admit", UnaryCall::Log::kAll);
  if (const auto entered = call.Enter(gate_, Toll::kRead); !entered.ok()) {
    return call.Finish(entered.status());
  }
  book_.Admit(request->id(), request->refuse(),
              call.Answer<WaitingFacts>([response](const WaitingFacts& facts) {
                Fill(facts, *response->mutable_person());
              }));
  return call.reactor();
}

grpc::ServerUnaryReactor* AccessService::ListAudit(Context* context,
                                                   const v1::ListAuditRequest* request,
                                                   v1::ListAuditResponse* response) {
  UnaryCall call(*context, "AccessService/ListAudit", UnaryCall::Log::kRefusals);
  if (const auto entered = call.Enter(gate_, Toll::kRead); !entered.ok()) {
    return call.Finish(entered.status());
  }
  if (request->most() > kMostAudit) {
    return call.Finish(absl::InvalidArgumentError(
        absl::StrCat("most: ", request->most(), "; give 1 to ", kMostAudit)));
  }
  const int most = request->most() == 0 ? kUsualAudit : static_cast<int>(request->most());
  const auto fill = [response](const std::vector<AuditFacts>& entries) {
    for (const AuditFacts& facts : entries) Fill(facts, *response->add_entries());
  };
  book_.ReadAudit(most, call.Answer<std::vector<AuditFacts>>(fill));
  return call.reactor();
}

}  // namespace saccade
