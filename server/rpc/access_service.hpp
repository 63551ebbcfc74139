#pragma once

#include <functional>
#include <string>

#include "saccade/v1/access.grpc.pb.h"
#include "server/identity/access_book.hpp"
#include "server/identity/identity_provider.hpp"
#include "server/rpc/gatekeeper.hpp"
#include "server/rpc/unary_call.hpp"

namespace saccade {

/// Invites: made and revoked by the owner, redeemed by whom they are for. Answered from the book's
/// thread, after the commit. Handlers never block.
class AccessService final : public v1::AccessService::CallbackService {
 public:
  using MakeLink = std::function<std::string(AccessRole, const std::string& token)>;
  /// `make_link` may be null: then links are "#invite=TOKEN" alone. `provider` null: nobody signs
  /// in; it outlives this.
  AccessService(AccessBook& book, Gatekeeper& gate, MakeLink make_link, bool insecure,
                IdentityProvider* provider);

 private:
  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;

  Reactor* GetAccess(Context* context, const v1::GetAccessRequest* request,
                     v1::GetAccessResponse* response) override;
  Reactor* Redeem(Context* context, const v1::RedeemRequest* request,
                  v1::RedeemResponse* response) override;
  Reactor* CreateInvite(Context* context, const v1::CreateInviteRequest* request,
                        v1::CreateInviteResponse* response) override;
  Reactor* ListInvites(Context* context, const v1::ListInvitesRequest* request,
                       v1::ListInvitesResponse* response) override;
  Reactor* RevokeInvite(Context* context, const v1::RevokeInviteRequest* request,
                        v1::RevokeInviteResponse* response) override;
  Reactor* ListWaiting(Context* context, const v1::ListWaitingRequest* request,
                       v1::ListWaitingResponse* response) override;
  Reactor* Admit(Context* context, const v1::AdmitRequest* request,
                 v1::AdmitResponse* response) override;
  Reactor* ListAudit(Context* context, const v1::ListAuditRequest* request,
                     v1::ListAuditResponse* response) override;
  Reactor* BeginSignIn(Context* context, const v1::BeginSignInRequest* request,
                       v1::BeginSignInResponse* response) override;
  Reactor* FinishSignIn(Context* context, const v1::FinishSignInRequest* request,
                        v1::RedeemResponse* response) override;

  using SignedInDone = std::function<void(absl::StatusOr<SignedIn>)>;
  static absl::Status NoProvider();
  static void Tell(const Issued& issued, v1::RedeemResponse& response);
  SignedInDone LetIn(const UnaryCall& call, v1::RedeemResponse* response);

  AccessBook& book_;
  Gatekeeper& gate_;
  const MakeLink make_link_;
  const bool insecure_;
  IdentityProvider* const provider_;
};

}  // namespace saccade
