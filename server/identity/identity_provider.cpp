#include "server/identity/identity_provider.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <utility>

#include "server/identity/id_token.hpp"
#include "server/identity/issuer_documents.hpp"
#include "server/identity/secret.hpp"
#include "server/identity/sign_in_table.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxWaiting = 64;
constexpr std::size_t kMaxCodeBytes = 4096;

std::int64_t SystemUnix_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

absl::Status Stopped() { return absl::UnavailableError("the server is shutting down"); }

std::string UrlWith(const std::string& base,
                    const std::vector<std::pair<std::string, std::string>>& query) {
  std::string url = base;
  char next = absl::StrContains(base, '?') ? '&' : '?';
  for (const auto& [name, value] : query) {
    url += std::exchange(next, '&');
    absl::StrAppend(&url, name, "=", UrlEncoded(value));
  }
  return url;
}

/// Of a refusal its code, which is one word, as far as it is one.
std::string ErrorWord(const nlohmann::json& answer) {
  if (!answer.is_object() || !answer.contains("error") || !answer["error"].is_string()) return "";
  const std::string word = answer["error"].get<std::string>().substr(0, 40);
  const bool plain = std::all_of(word.begin(), word.end(),
                                 [](char c) { return (c >= 'a' && c <= 'z') || c == '_'; });
  return plain ? word : "";
}

}  // namespace

class IdentityProvider::Impl {
 public:
  explicit Impl(IdentityProviderOptions options)
      : options_(std::move(options)), documents_(options_) {
    if (!options_.now_unix_s) options_.now_unix_s = SystemUnix_s;
    thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  }

  const std::string& name() const { return options_.name; }

  /// `job` runs on the thread; `refuse` at once, or when it stops before.
  void Post(std::function<void(const std::stop_token&)> job,
            std::function<void(absl::Status)> refuse) {
    absl::Status why = absl::ResourceExhaustedError("too many people sign in at once; try again");
    {
      const std::lock_guard guard(mutex_);
      if (stopped_) why = Stopped();
      if (!stopped_ && jobs_.size() < kMaxWaiting) {
        jobs_.push_back({std::move(job), std::move(refuse)});
        wake_.notify_one();
        return;
      }
    }
    refuse(why);
  }

  void Stop() {
    {
      const std::lock_guard guard(mutex_);
      stopped_ = true;
    }
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }

  // From here: the thread.

  absl::StatusOr<SignInStart> Begin(const std::string& redirect_uri, const std::string& challenge,
                                    const std::stop_token& stop) {
    absl::StatusOr<IssuerEndpoints> endpoints = documents_.Endpoints(stop);
    if (!endpoints.ok()) return endpoints.status();
    const SignInTable::Begun begun = sign_ins_.Begin(redirect_uri, challenge, MonotonicNow());
    return SignInStart{UrlWith(endpoints->authorization, {{"response_type", "code"},
                                                          {"client_id", options_.client_id},
                                                          {"redirect_uri", redirect_uri},
                                                          {"scope", options_.scope},
                                                          {"state", begun.state},
                                                          {"nonce", begun.nonce},
                                                          {"code_challenge", challenge},
                                                          {"code_challenge_method", "S256"}}),
                       begun.state};
  }

  absl::StatusOr<SignedIn> Finish(const std::string& state, const std::string& code,
                                  const std::string& verifier, const std::stop_token& stop) {
    const absl::StatusOr<SignInTable::Begun> begun =
        sign_ins_.Take(state, verifier, MonotonicNow());
    if (!begun.ok()) return begun.status();
    absl::StatusOr<IssuerEndpoints> endpoints = documents_.Endpoints(stop);
    if (!endpoints.ok()) return endpoints.status();
    const absl::StatusOr<HttpAnswer> answer =
        documents_.Post(endpoints->token,
                        {{"grant_type", "authorization_code"},
                         {"code", code},
                         {"redirect_uri", begun->redirect_uri},
                         {"client_id", options_.client_id},
                         {"code_verifier", verifier}},
                        stop);
    if (!answer.ok()) return answer.status();
    const nlohmann::json told =
        nlohmann::json::parse(answer->body, nullptr, /*allow_exceptions=*/false);
    if (answer->status != 200 || !told.is_object() || !told.contains("id_token") ||
        !told["id_token"].is_string()) {
      const std::string word = ErrorWord(told);
      return absl::UnauthenticatedError(
          absl::StrCat("access: ", options_.name, " gave no ID token for this sign-in",
                       word.empty() ? "" : absl::StrCat(" (", word, ")"), "; sign in again"));
    }
    // A browser's token is for the page, whatever machines may show.
    return Check(told["id_token"].get<std::string>(), begun->nonce, {options_.client_id}, stop);
  }

  absl::StatusOr<SignedIn> Verify(const std::string& id_token, const std::stop_token& stop) {
    std::vector<std::string> audiences = options_.audiences;
    audiences.push_back(options_.client_id);
    return Check(id_token, "", std::move(audiences), stop);
  }

 private:
  struct Job {
    std::function<void(const std::stop_token&)> run;
    std::function<void(absl::Status)> refuse;
  };

  void Run(const std::stop_token& stop) {
    for (;;) {
      std::optional<Job> job;
      {
        std::unique_lock guard(mutex_);
        wake_.wait(guard, stop, [this] { return !jobs_.empty(); });
        if (jobs_.empty()) return;
        job = std::move(jobs_.front());
        jobs_.pop_front();
      }
      if (stop.stop_requested()) {
        job->refuse(Stopped());
      } else {
        job->run(stop);
      }
    }
  }

  absl::StatusOr<SignedIn> Check(const std::string& token, const std::string& nonce,
                                 std::vector<std::string> audiences, const std::stop_token& stop) {
    const absl::StatusOr<std::string> payload = documents_.Payload(token, stop);
    if (!payload.ok()) return payload.status();
    const IdTokenRules rules{options_.issuer, std::move(audiences), options_.role_claim, nonce};
    const absl::StatusOr<IdTokenClaims> claims =
        CheckClaims(*payload, rules, options_.now_unix_s());
    if (!claims.ok()) return claims.status();
    AccessRole role = options_.other_role;
    for (const std::string& value : claims->roles) {
      const auto mapped = options_.roles.find(value);
      if (mapped != options_.roles.end()) role = std::max(role, mapped->second);
    }
    if (role == AccessRole::kAnyone) {
      return absl::PermissionDeniedError(
          absl::StrCat("access: ", options_.name,
                       " gives you none of the roles that are let in "
                       "here; ask who looks after them there, or for an invite"));
    }
    // What was signed, not the signature: of that there may be several.
    const std::string signed_part = token.substr(0, token.rfind('.'));
    return SignedIn{Sha256Hex(absl::StrCat(options_.issuer, "\n", claims->subject)), claims->name,
                    role, claims->expires_unix_s + kClockSkew_s, Sha256Hex(signed_part)};
  }

  IdentityProviderOptions options_;
  IssuerDocuments documents_;  // of the thread, as the next
  SignInTable sign_ins_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<Job> jobs_;  // guarded by mutex_, as the next
  bool stopped_ = false;
  std::jthread thread_;  // last: uses everything above
};

IdentityProvider::IdentityProvider(IdentityProviderOptions options)
    : impl_(std::make_unique<Impl>(std::move(options))) {}
IdentityProvider::~IdentityProvider() { Stop(); }

const std::string& IdentityProvider::name() const { return impl_->name(); }
void IdentityProvider::Stop() { impl_->Stop(); }

void IdentityProvider::Begin(std::string redirect_uri, std::string code_challenge,
                             Done<SignInStart> done) {
  if (absl::Status valid = CheckSignInRequest(redirect_uri, code_challenge); !valid.ok()) {
    return done(valid);
  }
  impl_->Post([this, redirect_uri, code_challenge,
               done](const auto& stop) { done(impl_->Begin(redirect_uri, code_challenge, stop)); },
              done);
}

void IdentityProvider::Finish(std::string state, std::string code, std::string code_verifier,
                              Done<SignedIn> done) {
  if (code.empty() || code.size() > kMaxCodeBytes) {
    return done(absl::InvalidArgumentError(
        absl::StrCat("code: ", code.size(), " bytes; give what the provider gave")));
  }
  impl_->Post(
      [this, state = std::move(state), code = std::move(code), verifier = std::move(code_verifier),
       done](const auto& stop) { done(impl_->Finish(state, code, verifier, stop)); },
      done);
}

void IdentityProvider::Verify(std::string id_token, Done<SignedIn> done) {
  impl_->Post([this, token = std::move(id_token),
               done](const auto& stop) { done(impl_->Verify(token, stop)); },
              done);
}

}  // namespace saccade
