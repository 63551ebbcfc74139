// Tokens that somebody else made, or made up.
#include "server/identity/id_token.hpp"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/server/identity/signed_tokens.hpp"

namespace saccade::testing::id_token_test {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::int64_t kNow = 1'800'000'000;
const char kIssuer[] = "https://login.firm.example";

json Claims(const json& changes = json::object()) {
  json claims = {{"iss", kIssuer},
                 {"aud", "saccade"},
                 {"sub", "7"},
                 {"exp", kNow + 3600},
                 {"iat", kNow - 5},
                 {"nonce", "n-1"},
                 {"name", "Ada Lovelace"},
                 {"groups", {"engineers", "all"}}};
  claims.update(changes);
  for (auto at = claims.begin(); at != claims.end();) at = at->is_null() ? claims.erase(at) : ++at;
  return claims;
}

IdTokenRules Rules() { return {kIssuer, {"saccade", "robots"}, "groups", "n-1"}; }

absl::StatusOr<IdTokenClaims> Check(const json& changes, const IdTokenRules& rules = Rules(),
                                    std::int64_t now = kNow) {
  return CheckClaims(Claims(changes).dump(), rules, now);
}

std::string Base64(const std::string& text) { return absl::WebSafeBase64Escape(text); }

class IdToken : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    rsa_ = new SigningKey(SigningKey::Rsa("r1"));
    ec_ = new SigningKey(SigningKey::P256("e1"));
    keys_ = *IssuerKeys::Parse(KeySetOf({rsa_, ec_}));
  }
  static void TearDownTestSuite() {
    delete rsa_;
    delete ec_;
    keys_.reset();
  }
  static absl::Status Verify(const std::string& token) {
    return VerifiedPayload(token, *keys_).status();
  }
  static SigningKey *rsa_, *ec_;
  static std::shared_ptr<const IssuerKeys> keys_;
};
SigningKey *IdToken::rsa_ = nullptr, *IdToken::ec_ = nullptr;
std::shared_ptr<const IssuerKeys> IdToken::keys_;

TEST_F(IdToken, IsTakenWithEitherAlgorithmAndTellsWhoItIs) {
  for (const SigningKey* key : {rsa_, ec_}) {
    const auto payload = VerifiedPayload(key->Sign(Claims()), *keys_);
    ASSERT_TRUE(payload.ok()) << payload.status();
    const auto claims = CheckClaims(*payload, Rules(), kNow);
    ASSERT_TRUE(claims.ok()) << claims.status();
    EXPECT_EQ(claims->subject, "7");
    EXPECT_EQ(claims->name, "Ada Lovelace");
    EXPECT_THAT(claims->roles, ElementsAre("engineers", "all"));
    EXPECT_EQ(claims->expires_unix_s, kNow + 3600);
  }
}

TEST_F(IdToken, WithoutASignatureOrWithASharedSecretIsRefused) {
  const std::string payload = Base64(Claims().dump());
  for (const char* none : {"none", "None", "NONE", "nOnE"}) {
    const std::string header = Base64(json{{"alg", none}, {"kid", "r1"}}.dump());
    for (const std::string& signature : {std::string(), Base64("x")}) {
      const absl::Status status = Verify(absl::StrCat(header, ".", payload, ".", signature));
      EXPECT_FALSE(status.ok()) << none;
      EXPECT_FALSE(absl::IsNotFound(status)) << none;
    }
  }
  // What everybody knows of the key, as the secret of an HMAC.
  for (const std::string& known :
       {rsa_->Public().dump(), rsa_->Public()["n"].get<std::string>(), std::string("secret")}) {
    for (const char* id : {"r1", "e1", "h1"}) {
      const absl::Status status = Verify(SigningKey::Hmac(id, known).Sign(Claims()));
      EXPECT_TRUE(absl::IsUnauthenticated(status)) << status;
      EXPECT_THAT(status.message(), HasSubstr("RS256 or ES256"));
    }
  }
}

TEST_F(IdToken, OfAStrangersKeyIsRefused) {
  // Under a name that is known, and under one that is not.
  EXPECT_THAT(Verify(SigningKey::Rsa("r1").Sign(Claims())).message(), HasSubstr("signature"));
  EXPECT_THAT(Verify(SigningKey::P256("e1").Sign(Claims())).message(), HasSubstr("signature"));
  EXPECT_TRUE(absl::IsNotFound(Verify(SigningKey::Rsa("r2").Sign(Claims()))));
  // The name of a key for the other algorithm.
  EXPECT_TRUE(absl::IsNotFound(Verify(SigningKey::P256("r1").Sign(Claims()))));
  EXPECT_TRUE(absl::IsNotFound(Verify(SigningKey::Rsa("e1").Sign(Claims()))));
}

TEST_F(IdToken, ChangedAnywhereIsRefused) {
  for (const SigningKey* key : {rsa_, ec_}) {
    const std::string token = key->Sign(Claims());
    int refused = 0, tried = 0;
    for (std::size_t at = 0; at < token.size(); at += 7) {
      std::string changed = token;
      changed[at] = changed[at] == 'A' ? 'B' : 'A';
      // The last character of a part holds bits that mean nothing.
      const bool last = at + 1 == token.size() || token[at + 1] == '.';
      if (last) continue;
      ++tried;
      refused += Verify(changed).ok() ? 0 : 1;
    }
    EXPECT_EQ(refused, tried);
    EXPECT_GT(tried, 40);
    const std::string forged = Base64(Claims({{"groups", "admins"}}).dump());
    const std::size_t first = token.find('.'), second = token.rfind('.');
    EXPECT_FALSE(Verify(token.substr(0, first + 1) + forged + token.substr(second)).ok());
  }
}

TEST_F(IdToken, ThatIsNoneOrHugeIsRefused) {
  for (const std::string& text :
       {std::string(), std::string("."), std::string(".."), std::string("a.b.c"),
        std::string("...."), std::string("iab.SECRET"), std::string(3, '\0'),
        Base64("{") + "." + Base64("{") + ".x", std::string("\xff\xfe.\xff.\xff"),
        Base64("[]") + "." + Base64("[]") + "." + Base64("[]")}) {
    EXPECT_FALSE(Verify(text).ok()) << absl::CEscape(text);
  }
  const std::string huge = rsa_->Sign(Claims({{"name", std::string(20'000, 'x')}}));
  EXPECT_THAT(Verify(huge).message(), HasSubstr("at most 16384"));
  const std::string deep = Base64(std::string(3000, '[') + std::string(3000, ']'));
  EXPECT_FALSE(Verify(absl::StrCat(deep, ".", deep, ".x")).ok());
}

TEST_F(IdToken, OfAnotherKindOrWithUnknownExtensionsIsRefused) {
  EXPECT_TRUE(Verify(rsa_->Sign(Claims(), {{"typ", "JWT"}})).ok());
  EXPECT_THAT(Verify(rsa_->Sign(Claims(), {{"typ", "at+jwt"}})).message(), HasSubstr("typ"));
  EXPECT_THAT(Verify(rsa_->Sign(Claims(), {{"crit", {"exp"}}, {"exp", 1}})).message(),
              HasSubstr("crit"));
  // A key that the token brings along is nobody's.
  const SigningKey own = SigningKey::Rsa("mine");
  EXPECT_TRUE(absl::IsNotFound(Verify(own.Sign(Claims(), {{"jwk", own.Public()}}))));
}

TEST_F(IdToken, WithoutAKeyIdIsTakenWhereThereIsOneKey) {
  EXPECT_TRUE(Verify(rsa_->Sign(Claims(), {{"kid", nullptr}})).ok());
  const SigningKey second = SigningKey::Rsa("r2");
  const auto both = *IssuerKeys::Parse(KeySetOf({rsa_, &second}));
  const auto status = VerifiedPayload(rsa_->Sign(Claims(), {{"kid", nullptr}}), *both).status();
  EXPECT_THAT(status.message(), HasSubstr("kid"));
}

TEST(IssuerKeys, LeavesOutWhatIsNotForThis) {
  const SigningKey rsa = SigningKey::Rsa("r1"), small = SigningKey::Rsa("small", 1024);
  json secret = SigningKey::Hmac("h", "0123456789").Public(), coding = rsa.Public();
  coding["use"] = "enc";
  json other = rsa.Public();
  other["alg"] = "RS512";
  for (const json& useless : {small.Public(), secret, coding, other, json(7), json::object()}) {
    EXPECT_FALSE(IssuerKeys::Parse(json{{"keys", {useless}}}.dump()).ok()) << useless;
  }
  for (const char* none : {"", "[]", "{}", "{\"keys\": 3}", "{\"keys\": []}", "<html>"}) {
    EXPECT_FALSE(IssuerKeys::Parse(none).ok()) << none;
  }
  EXPECT_TRUE(IssuerKeys::Parse(json{{"keys", {secret, rsa.Public()}}}.dump()).ok());
}

struct Bad {
  json changes;
  const char* claim;
};

TEST(IdTokenClaims, EachThatIsNotAsItHasToBeIsNamed) {
  for (const Bad& bad : std::vector<Bad>{{{{"iss", "https://login.other.example"}}, "iss"},
                                         {{{"iss", "https://login.firm.example/"}}, "iss"},
                                         {{{"iss", nullptr}}, "iss"},
                                         {{{"aud", "another"}}, "aud"},
                                         {{{"aud", nullptr}}, "aud"},
                                         {{{"aud", json::array()}}, "aud"},
                                         {{{"aud", {"saccade", "another"}}}, "aud"},
                                         {{{"aud", {"saccade", 7}}}, "aud"},
                                         {{{"azp", "another"}}, "azp"},
                                         {{{"azp", 7}}, "azp"},
                                         {{{"exp", nullptr}}, "exp"},
                                         {{{"exp", "soon"}}, "exp"},
                                         {{{"exp", -1}}, "exp"},
                                         {{{"exp", 1e300}}, "exp"},
                                         {{{"exp", kNow - 60}}, "exp"},
                                         {{{"exp", kNow + 30 * 86'400}}, "exp"},
                                         {{{"iat", nullptr}}, "iat"},
                                         {{{"iat", kNow + 61}}, "iat"},
                                         {{{"nbf", kNow + 61}}, "nbf"},
                                         {{{"nbf", "then"}}, "nbf"},
                                         {{{"nonce", "n-2"}}, "nonce"},
                                         {{{"nonce", nullptr}}, "nonce"},
                                         {{{"sub", nullptr}}, "sub"},
                                         {{{"sub", ""}}, "sub"},
                                         {{{"sub", std::string(256, 's')}}, "sub"}}) {
    const auto claims = Check(bad.changes);
    EXPECT_TRUE(absl::IsUnauthenticated(claims.status())) << bad.changes;
    EXPECT_THAT(claims.status().message(), HasSubstr(absl::StrCat("id_token: ", bad.claim, ":")))
        << bad.changes;
  }
  EXPECT_FALSE(CheckClaims("[]", Rules(), kNow).ok());
  EXPECT_FALSE(CheckClaims("", Rules(), kNow).ok());
}

TEST(IdTokenClaims, ClocksMayDifferByAMinute) {
  EXPECT_TRUE(Check({{"exp", kNow - 59}}).ok());
  EXPECT_TRUE(Check({{"iat", kNow + 59}}).ok());
  EXPECT_TRUE(Check({{"nbf", kNow + 59}}).ok());
  EXPECT_TRUE(Check({{"aud", {"saccade", "robots"}}, {"azp", "robots"}}).ok());
}

TEST(IdTokenClaims, RolesAreFoundAlsoInAnotherClaim) {
  IdTokenRules rules = Rules();
  rules.role_claim = "realm_access.roles";
  EXPECT_THAT(Check({{"realm_access", {{"roles", {"a", 7, "b"}}}}}, rules)->roles,
              ElementsAre("a", "b"));
  EXPECT_TRUE(Check({{"realm_access", "roles"}}, rules)->roles.empty());
  // A claim whose name has dots.
  EXPECT_THAT(Check({{"realm_access.roles", "c"}}, rules)->roles, ElementsAre("c"));
}

TEST(IdTokenClaims, NamesAreCutBetweenCharacters) {
  EXPECT_EQ(Check({{"name", "  "}, {"email", "ada@firm.example"}})->name, "ada@firm.example");
  EXPECT_EQ(Check({{"name", nullptr}})->name, "7");
  std::string umlauts;
  for (int i = 0; i < 40; ++i) umlauts += "\xc3\xa4";
  EXPECT_EQ(Check({{"name", "x" + umlauts}})->name, "x" + umlauts.substr(0, 58));
}

}  // namespace
}  // namespace saccade::testing::id_token_test
