#include "server/identity/certificate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/x509_vfy.h>
#include <sys/stat.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>

#include "server/identity/certificate_files.hpp"
#include "server/identity/openssl_owners.hpp"
#include "tests/unit/server/identity/temporary_folder.hpp"

namespace saccade::certificate_test {
namespace {

using saccade::testing::TemporaryFolder;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr std::int64_t kDay_s = 86'400;
const std::int64_t kNow = std::chrono::duration_cast<std::chrono::seconds>(
                              std::chrono::system_clock::now().time_since_epoch())
                              .count();
const ServerNames kNames{{"localhost", "box"}, {"127.0.0.1", "::1", "10.1.2.3"}};

TEST(Certificate, OfTheAuthorityNamesTheServerAndHoldsThirteenMonths) {
  const auto authority = MakeAuthority("Saccade on box");
  ASSERT_TRUE(authority.ok()) << authority.status();
  const auto server = MakeServerCertificate(*authority, kNames);
  ASSERT_TRUE(server.ok()) << server.status();
  EXPECT_TRUE(SignedBy(server->certificate_pem, authority->certificate_pem));
  EXPECT_TRUE(CheckPair(server->certificate_pem, server->key_pem).ok());
  EXPECT_FALSE(CheckPair(server->certificate_pem, authority->key_pem).ok());
  const auto facts = InspectCertificate(server->certificate_pem);
  ASSERT_TRUE(facts.ok());
  EXPECT_EQ(facts->names.dns, kNames.dns);
  EXPECT_EQ(facts->names.addresses, kNames.addresses);
  EXPECT_LE(facts->not_after_unix_s - facts->not_before_unix_s, 398 * kDay_s);
  EXPECT_GT(facts->not_after_unix_s, kNow + 390 * kDay_s);
  EXPECT_EQ(facts->sha256.size(), 95u);
}

/// OpenSSL's own judgement of a server's certificate.
int Verify(const std::string& certificate_pem, const std::string& root_pem) {
  const X509Owner certificate = ReadCertificate(certificate_pem), root = ReadCertificate(root_pem);
  const std::unique_ptr<X509_STORE, decltype(&X509_STORE_free)> store(X509_STORE_new(),
                                                                      X509_STORE_free);
  X509_STORE_add_cert(store.get(), root.get());
  const std::unique_ptr<X509_STORE_CTX, decltype(&X509_STORE_CTX_free)> context(
      X509_STORE_CTX_new(), X509_STORE_CTX_free);
  X509_STORE_CTX_init(context.get(), store.get(), certificate.get(), nullptr);
  X509_STORE_CTX_set_purpose(context.get(), X509_PURPOSE_SSL_SERVER);
  X509_verify_cert(context.get());
  return X509_STORE_CTX_get_error(context.get());
}

TEST(NameConstraints, AnAuthorityVouchesForItsOwnNamesAndPrivateAddresses) {
  const ServerNames own{{"localhost", "box"}, {"127.0.0.1", "203.0.113.5", "2001:db8:1:2::5"}};
  const auto authority = MakeAuthority("Saccade on box", own);
  ASSERT_TRUE(authority.ok()) << authority.status();
  const auto judge = [&](const ServerNames& names) {
    return Verify(MakeServerCertificate(*authority, names)->certificate_pem,
                  authority->certificate_pem);
  };
  EXPECT_EQ(judge(own), X509_V_OK);
  EXPECT_EQ(judge({{"box.local"}, {"10.20.30.40", "192.168.1.9", "fd00::7", "::1"}}), X509_V_OK)
      << "the next network needs no new authority";
  EXPECT_EQ(judge({{}, {"2001:db8:1:2:9999::1"}}), X509_V_OK) << "the same network";
  for (const ServerNames& foreign :
       {ServerNames{{"www.example.com"}, {}}, ServerNames{{"box", "example.com"}, {}},
        ServerNames{{}, {"203.0.113.6"}}, ServerNames{{}, {"2001:db8:1:3::5"}},
        ServerNames{{"notbox"}, {}}}) {
    EXPECT_EQ(judge(foreign), X509_V_ERR_PERMITTED_VIOLATION) << foreign.All().back();
  }
}

TEST(NameConstraints, WhatAnAuthorityMayNotNameIsLeftOutAndSaid) {
  const TemporaryFolder folder;
  const auto first = EnsureServerIdentity(folder.path(), kNames, kNow);
  ASSERT_TRUE(first.ok());
  EXPECT_TRUE(first->not_named.empty());
  ServerNames more = kNames;
  more.Add("saccade.example.org");
  more.Add("10.200.0.1");
  const auto later = EnsureServerIdentity(folder.path(), more, kNow);
  ASSERT_TRUE(later.ok());
  EXPECT_EQ(later->not_named, std::vector<std::string>{"saccade.example.org"});
  EXPECT_EQ(later->root_pem, first->root_pem) << "who trusts it need not do so again";
  EXPECT_EQ(Verify(later->chain_pem, later->root_pem), X509_V_OK);
  EXPECT_THAT(InspectCertificate(later->chain_pem)->names.addresses, Contains("10.200.0.1"));
  const auto again = EnsureServerIdentity(folder.path(), more, kNow);
  EXPECT_EQ(again->chain_pem, later->chain_pem) << "asked again, nothing is made";
}

TEST(NameConstraints, AnOlderAuthorityWithoutThemIsKept) {
  const auto authority = MakeAuthority("old");
  EXPECT_EQ(
      PermittedBy(authority->certificate_pem, {{"any.example"}, {"203.0.113.5"}}).All().size(), 2u);
}

TEST(Certificate, OfAnotherAuthorityIsNotOurs) {
  const auto ours = MakeAuthority("a"), other = MakeAuthority("a");
  const auto server = MakeServerCertificate(*other, kNames);
  EXPECT_FALSE(SignedBy(server->certificate_pem, ours->certificate_pem));
}

TEST(Certificate, ThisMachineIsCalledByItsAddresses) {
  const ServerNames names = ServerNames::OfThisMachine();
  EXPECT_THAT(names.dns, Contains("localhost"));
  EXPECT_THAT(names.addresses, Contains("127.0.0.1"));
}

TEST(ServerIdentity, IsMadeOnceForItsOwnerAlone) {
  const TemporaryFolder folder;
  const auto first = EnsureServerIdentity(folder.path(), kNames, kNow);
  ASSERT_TRUE(first.ok()) << first.status();
  for (const char* name : {"authority.pem", "authority.key", "server.pem", "server.key"}) {
    struct stat facts {};
    ASSERT_EQ(stat((folder / ("tls/" + std::string(name))).c_str(), &facts), 0) << name;
    EXPECT_EQ(facts.st_mode & 0777u, 0600u) << name;
  }
  const auto second = EnsureServerIdentity(folder.path(), kNames, kNow + 300 * kDay_s);
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(second->chain_pem, first->chain_pem);
  EXPECT_EQ(second->key_pem, first->key_pem);
}

TEST(ServerIdentity, IsRenewedWhenItExpiresOrANameIsNewAndTheRootStays) {
  const TemporaryFolder folder;
  const auto first = EnsureServerIdentity(folder.path(), kNames, kNow);
  ASSERT_TRUE(first.ok()) << first.status();
  const auto later = EnsureServerIdentity(folder.path(), kNames, kNow + 380 * kDay_s);
  ASSERT_TRUE(later.ok());
  EXPECT_NE(later->chain_pem, first->chain_pem);
  EXPECT_EQ(later->root_pem, first->root_pem);
  ServerNames moved = kNames;
  moved.addresses.push_back("10.9.9.9");
  const auto elsewhere = EnsureServerIdentity(folder.path(), moved, kNow);
  ASSERT_TRUE(elsewhere.ok());
  EXPECT_THAT(InspectCertificate(elsewhere->chain_pem)->names.addresses, Contains("10.9.9.9"));
  EXPECT_EQ(elsewhere->root_pem, first->root_pem);
}

TEST(ServerIdentity, AnAuthorityIsReplacedInItsLastMonthAndThatIsSaidAMonthBefore) {
  const TemporaryFolder folder;
  const auto first = EnsureServerIdentity(folder.path(), kNames, kNow);
  ASSERT_TRUE(first.ok());
  const std::int64_t end = InspectCertificate(first->root_pem)->not_after_unix_s;
  EXPECT_EQ(ExpiryWarning(*first, end - 61 * kDay_s), "");
  EXPECT_THAT(ExpiryWarning(*first, end - 59 * kDay_s),
              HasSubstr("in 29 days a new one is made, which everybody has to trust anew"));
  const auto kept = EnsureServerIdentity(folder.path(), kNames, end - 31 * kDay_s);
  EXPECT_EQ(kept->root_pem, first->root_pem);
  const auto next = EnsureServerIdentity(folder.path(), kNames, end - 29 * kDay_s);
  ASSERT_TRUE(next.ok());
  EXPECT_NE(next->root_pem, first->root_pem);
  EXPECT_NE(next->root_sha256, first->root_sha256);
  EXPECT_TRUE(SignedBy(next->chain_pem, next->root_pem));
}

TEST(ServerIdentity, TheEndOfAGivenCertificateIsSaidTwoWeeksBefore) {
  const auto authority = MakeAuthority("Somebody's");
  const auto pair = MakeServerCertificate(*authority, kNames);
  const ServerIdentity given{pair->certificate_pem, pair->key_pem, "", "", {}};
  const std::int64_t end = InspectCertificate(given.chain_pem)->not_after_unix_s;
  EXPECT_EQ(ExpiryWarning(given, end - 15 * kDay_s), "");
  EXPECT_THAT(ExpiryWarning(given, end - 13 * kDay_s), HasSubstr("in 13 days; put a new one"));
  EXPECT_THAT(ExpiryWarning(given, end + 1), HasSubstr("nobody can connect; put a new one"));
}

TEST(ServerIdentity, ADamagedAuthorityIsSaidAndNotReplaced) {
  const TemporaryFolder folder;
  ASSERT_TRUE(EnsureServerIdentity(folder.path(), kNames, kNow).ok());
  std::ofstream(folder / "tls/authority.pem") << "broken";
  const auto identity = EnsureServerIdentity(folder.path(), kNames, kNow);
  ASSERT_EQ(identity.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(identity.status().message()), HasSubstr("authority.pem"));
}

TEST(ServerIdentity, AGivenCertificateIsCheckedBeforeItIsServed) {
  const TemporaryFolder folder;
  ASSERT_TRUE(EnsureServerIdentity(folder.path(), kNames, kNow).ok());
  const std::string pem = folder / "tls/server.pem", key = folder / "tls/server.key";
  const auto good = LoadServerIdentity(pem, key, kNow);
  ASSERT_TRUE(good.ok()) << good.status();
  EXPECT_EQ(good->root_pem, "") << "whoever gave it knows whom to trust";
  EXPECT_THAT(std::string(LoadServerIdentity(pem, key, kNow + 500 * kDay_s).status().message()),
              HasSubstr("expired"));
  EXPECT_THAT(
      std::string(LoadServerIdentity(pem, folder / "tls/authority.key", kNow).status().message()),
      HasSubstr("not of the same pair"));
}

}  // namespace
}  // namespace saccade::certificate_test
