// Signing in with an issuer that changes its keys, does not answer, or lies. A real one, with a
// real browser: BrowserTest.SignInByOidc.
#include "server/identity/identity_provider.hpp"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <thread>

#include "server/identity/secret.hpp"
#include "tests/unit/server/identity/issuer.hpp"
#include "tests/unit/server/identity/signed_tokens.hpp"

namespace saccade::testing::identity_provider_test {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr std::int64_t kNow = 1'800'000'000;
const std::string kVerifier(43, 'v');
const std::string kCode = "code of the provider";

template <typename T, typename Ask>
absl::StatusOr<T> Wait(Ask ask) {
  const auto answer = std::make_shared<std::promise<absl::StatusOr<T>>>();
  std::future<absl::StatusOr<T>> future = answer->get_future();
  ask([answer](absl::StatusOr<T> result) { answer->set_value(std::move(result)); });
  return future.get();
}

class Provider : public ::testing::Test {
 protected:
  Provider() {
    issuer_.SetDiscovery();
    issuer_.Set("/keys", {200, KeySetOf({&key_})});
    provider_ = std::make_unique<IdentityProvider>(Options());
  }
  IdentityProviderOptions Options() const {
    IdentityProviderOptions options;
    options.issuer = issuer_.url();
    options.client_id = "saccade";
    options.audiences = {"robots"};
    options.roles = {{"engineers", AccessRole::kPilot}, {"all", AccessRole::kViewer}};
    options.now_unix_s = [] { return kNow; };
    return options;
  }
  json Claims(const json& changes = json::object()) const {
    json claims = {{"iss", issuer_.url()}, {"aud", "saccade"},
                   {"sub", "7"},           {"exp", kNow + 600},
                   {"iat", kNow},          {"name", "Ada"},
                   {"groups", {"all"}},    {"jti", NewToken('j').secret}};
    claims.update(changes);
    return claims;
  }
  absl::StatusOr<SignInStart> Begin() {
    return Wait<SignInStart>([&](auto done) {
      provider_->Begin("https://saccade.example/", Sha256Base64Url(kVerifier), done);
    });
  }
  absl::StatusOr<SignedIn> Finish(const std::string& state,
                                  const std::string& verifier = kVerifier) {
    return Wait<SignedIn>([&](auto done) { provider_->Finish(state, kCode, verifier, done); });
  }
  absl::StatusOr<SignedIn> Verify(const std::string& token) {
    return Wait<SignedIn>([&](auto done) { provider_->Verify(token, done); });
  }
  static std::string Part(const std::string& url, const std::string& name) {
    const std::size_t at = url.find(name + "=") + name.size() + 1;
    return url.substr(at, url.find('&', at) - at);
  }
  void Answer(const std::string& id_token) {
    issuer_.Set("/token", {200, json{{"id_token", id_token}}.dump()});
  }

  const SigningKey key_ = SigningKey::P256("k1");
  Issuer issuer_;
  std::unique_ptr<IdentityProvider> provider_;
};

TEST_F(Provider, ACodeIsTakenToTheIssuerWithItsVerifier) {
  const auto begun = Begin();
  ASSERT_TRUE(begun.ok()) << begun.status();
  EXPECT_THAT(begun->url, HasSubstr(issuer_.url() + "/auth?response_type=code&client_id=saccade"));
  EXPECT_EQ(Part(begun->url, "state"), begun->state);
  EXPECT_EQ(Part(begun->url, "code_challenge"), Sha256Base64Url(kVerifier));
  EXPECT_EQ(Part(begun->url, "code_challenge_method"), "S256");
  EXPECT_EQ(Part(begun->url, "redirect_uri"), "https%3A%2F%2Fsaccade.example%2F");
  Answer(key_.Sign(Claims({{"nonce", Part(begun->url, "nonce")}, {"groups", {"x", "engineers"}}})));
  const auto person = Finish(begun->state);
  ASSERT_TRUE(person.ok()) << person.status();
  EXPECT_EQ(person->name, "Ada");
  EXPECT_EQ(person->role, AccessRole::kPilot);
  EXPECT_EQ(person->expires_unix_s, kNow + 600 + 60);
  EXPECT_THAT(issuer_.last_body(), HasSubstr("grant_type=authorization_code"));
  EXPECT_THAT(issuer_.last_body(), HasSubstr("code=code%20of%20the%20provider"));
  EXPECT_THAT(issuer_.last_body(), HasSubstr("code_verifier=" + kVerifier));
  // The same once more.
  EXPECT_THAT(Finish(begun->state).status().message(), HasSubstr("not begun here, or is over"));
}

TEST_F(Provider, AnotherBrowsersCodeOpensNothing) {
  const auto begun = Begin();
  const int before = issuer_.asked("/token");
  const auto other = Finish(begun->state, std::string(43, 'w'));
  EXPECT_THAT(other.status().message(), HasSubstr("begun by another browser"));
  EXPECT_TRUE(absl::IsUnauthenticated(Finish("made up").status()));
  EXPECT_EQ(issuer_.asked("/token"), before) << "and nobody is asked";
}

TEST_F(Provider, ATokenOfAnotherSignInOpensNothing) {
  const auto first = Begin(), second = Begin();
  ASSERT_NE(first->state, second->state);
  const std::string token = key_.Sign(Claims({{"nonce", Part(first->url, "nonce")}}));
  Answer(token);
  EXPECT_TRUE(Finish(first->state).ok());
  EXPECT_THAT(Finish(second->state).status().message(), HasSubstr("id_token: nonce"));
  // One for machines alone is no browser's.
  const auto third = Begin();
  Answer(key_.Sign(Claims({{"nonce", Part(third->url, "nonce")}, {"aud", "robots"}})));
  EXPECT_THAT(Finish(third->state).status().message(), HasSubstr("id_token: aud"));
}

TEST_F(Provider, MachinesBringTheirTokenThemselves) {
  EXPECT_TRUE(Verify(key_.Sign(Claims({{"aud", "robots"}}))).ok());
  EXPECT_TRUE(absl::IsUnauthenticated(Verify(key_.Sign(Claims({{"aud", "else"}}))).status()));
  const auto nobody = Verify(key_.Sign(Claims({{"groups", {"strangers"}}})));
  EXPECT_TRUE(absl::IsPermissionDenied(nobody.status()));
  EXPECT_THAT(nobody.status().message(), HasSubstr("none of the roles"));
  // The same signature in another form is the same token.
  const std::string token = key_.Sign(Claims());
  EXPECT_EQ(Verify(token)->proof, Verify(token)->proof);
  EXPECT_NE(Verify(token)->proof, Verify(key_.Sign(Claims()))->proof);
}

TEST_F(Provider, NewKeysAreFetchedAndOldOnesForgotten) {
  ASSERT_TRUE(Verify(key_.Sign(Claims())).ok());
  EXPECT_EQ(issuer_.asked("/keys"), 1);
  const SigningKey next = SigningKey::Rsa("k2");
  issuer_.Set("/keys", {200, KeySetOf({&next})});
  // Who makes up names of keys does not make the server ask each time.
  for (int i = 0; i < 20; ++i) {
    const auto unknown = Verify(SigningKey::P256(absl::StrCat("u", i)).Sign(Claims()));
    EXPECT_TRUE(absl::IsUnauthenticated(unknown.status()));
  }
  EXPECT_EQ(issuer_.asked("/keys"), 1);
  std::this_thread::sleep_for(milliseconds(5100));
  EXPECT_TRUE(Verify(next.Sign(Claims())).ok());
  EXPECT_EQ(issuer_.asked("/keys"), 2);
  EXPECT_TRUE(absl::IsUnauthenticated(Verify(key_.Sign(Claims())).status())) << "the old key";
}

TEST_F(Provider, AnIssuerThatIsNotWhatItShouldBeIsNamed) {
  const auto status = [this] {
    provider_ = std::make_unique<IdentityProvider>(Options());
    return Begin().status();
  };
  issuer_.SetDiscovery({{"issuer", "https://login.other.example"}});
  EXPECT_THAT(status().message(), HasSubstr("another issuer"));
  issuer_.SetDiscovery({{"token_endpoint", "http://login.firm.example/token"}});
  EXPECT_THAT(status().message(), HasSubstr("not https"));
  issuer_.SetDiscovery({{"jwks_uri", "file:///etc/passwd"}});
  EXPECT_THAT(status().message(), HasSubstr("not https"));
  const std::string path = "/.well-known/openid-configuration";
  issuer_.Set(path, {302, "", "Location: " + issuer_.url() + "/elsewhere\r\n"});
  EXPECT_THAT(status().message(), HasSubstr("answered 302"));
  EXPECT_EQ(issuer_.asked("/elsewhere"), 0) << "redirects are not followed";
  issuer_.Set(path, {200, std::string(300'000, ' ')});
  EXPECT_THAT(status().message(), HasSubstr("larger than 262144"));
  issuer_.Set(path, {500, "no"});
  EXPECT_THAT(status().message(), HasSubstr("answered 500"));
}

TEST_F(Provider, WhoDoesNotAnswerIsNotAskedAgainAtOnce) {
  const std::string path = "/.well-known/openid-configuration";
  issuer_.Set(path, {500, ""});
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(absl::IsUnavailable(Begin().status()));
  EXPECT_EQ(issuer_.asked(path), 1);
}

TEST_F(Provider, StopsWhileTheIssuerIsSlow) {
  issuer_.Set("/.well-known/openid-configuration", {200, "{}", "", 3000});
  const auto answer = std::make_shared<std::promise<absl::Status>>();
  std::future<absl::Status> future = answer->get_future();
  provider_->Begin("https://saccade.example/", Sha256Base64Url(kVerifier),
                   [answer](auto start) { answer->set_value(start.status()); });
  std::this_thread::sleep_for(milliseconds(200));
  const auto begin = std::chrono::steady_clock::now();
  provider_->Stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, milliseconds(2000));
  EXPECT_TRUE(absl::IsUnavailable(future.get()));
  EXPECT_TRUE(absl::IsUnavailable(Begin().status())) << "and whoever comes";
}

TEST(IdentityProviderOptions, SayWhichKeyIsWrong) {
  IdentityProviderOptions good;
  good.issuer = "https://login.firm.example";
  good.client_id = "saccade";
  good.roles = {{"all", AccessRole::kViewer}};
  EXPECT_TRUE(good.Validate().ok());
  const auto problem = [&good](auto change) {
    IdentityProviderOptions options = good;
    change(options);
    return std::string(options.Validate().message());
  };
  EXPECT_THAT(problem([](auto& o) { o.issuer = "http://login.firm.example"; }),
              HasSubstr("oidc.issuer"));
  EXPECT_THAT(problem([](auto& o) { o.issuer = "http://localhost.evil.example"; }),
              HasSubstr("oidc.issuer"));
  EXPECT_THAT(problem([](auto& o) { o.client_id.clear(); }), HasSubstr("oidc.client_id"));
  EXPECT_THAT(problem([](auto& o) { o.scope = "profile"; }), HasSubstr("oidc.scope"));
  EXPECT_THAT(problem([](auto& o) { o.roles.clear(); }), HasSubstr("oidc.roles"));
}

TEST_F(Provider, RefusesWhatIsNoRequest) {
  for (const char* uri : {"", "https://", "https:///", "https://host", "https://host/a/",
                          "https://me@host/", "javascript:alert(1)/", "ftp://host/"}) {
    const auto begun = Wait<SignInStart>(
        [&](auto done) { provider_->Begin(uri, Sha256Base64Url(kVerifier), done); });
    EXPECT_THAT(begun.status().message(), HasSubstr("redirect_uri")) << uri;
  }
  const auto begun =
      Wait<SignInStart>([&](auto done) { provider_->Begin("https://host/", "short", done); });
  EXPECT_THAT(begun.status().message(), HasSubstr("code_challenge"));
  const auto huge = Wait<SignedIn>(
      [&](auto done) { provider_->Finish("state", std::string(5000, 'c'), kVerifier, done); });
  EXPECT_THAT(huge.status().message(), HasSubstr("code: 5000 bytes"));
}

}  // namespace
}  // namespace saccade::testing::identity_provider_test
