// The calls of AccessService by which people sign in with their firm's provider.
#include "server/rpc/access_service.hpp"
#include "server/rpc/unary_call.hpp"

namespace saccade {

absl::Status AccessService::NoProvider() {
  return absl::FailedPreconditionError(
      "access: nobody signs in here: this server has no [oidc]; ask for an invite");
}

AccessService::SignedInDone AccessService::LetIn(const UnaryCall& call,
                                                 v1::RedeemResponse* response) {
  return [this, call, response](absl::StatusOr<SignedIn> person) {
    if (!person.ok()) {
      call.Finish(person.status());
      return;
    }
    // Names come from people's own accounts, and go into others' lists.
    if (!CheckDisplayName(person->name).ok()) person->name = "person " + person->key.substr(0, 12);
    const auto fill = [response](const Issued& issued) { Tell(issued, *response); };
    book_.SignIn(*std::move(person), call.Answer<Issued>(fill));
  };
}

grpc::ServerUnaryReactor* AccessService::BeginSignIn(Context* context,
                                                     const v1::BeginSignInRequest* request,
                                                     v1::BeginSignInResponse* response) {
  UnaryCall call(*context, "AccessService/BeginSignIn", UnaryCall::Log::kAll);
  if (const auto entered = call.Enter(gate_, Toll::kRedeem); !entered.ok()) {
    return call.Finish(entered.status());
  }
  if (provider_ == nullptr) return call.Finish(NoProvider());
  const auto fill = [response](const SignInStart& start) {
    response->set_url(start.url);
    response->set_state(start.state);
  };
  provider_->Begin(request->redirect_uri(), request->code_challenge(),
                   call.Answer<SignInStart>(fill));
  return call.reactor();
}

grpc::ServerUnaryReactor* AccessService::FinishSignIn(Context* context,
                                                      const v1::FinishSignInRequest* request,
                                                      v1::RedeemResponse* response) {
  UnaryCall call(*context, "AccessService/FinishSignIn", UnaryCall::Log::kAll);
  if (const auto entered = call.Enter(gate_, Toll::kRedeem); !entered.ok()) {
    return call.Finish(entered.status());
  }
  if (provider_ == nullptr) return call.Finish(NoProvider());
  provider_->Finish(request->state(), request->code(), request->code_verifier(),
                    LetIn(call, response));
  return call.reactor();
}

}  // namespace saccade
