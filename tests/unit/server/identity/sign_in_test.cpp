// People who sign in, in the book of invites.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <mutex>
#include <thread>

#include "server/identity/access_book.hpp"
#include "server/identity/secret.hpp"
#include "server/store/sqlite.hpp"
#include "tests/unit/server/identity/temporary_folder.hpp"

namespace saccade::sign_in_test {
namespace {

using saccade::testing::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::atomic<std::int64_t> clock_s = 1'000'000;

AccessBook::Options Options() {
  AccessBook::Options options;
  options.token_required = true;
  options.now_unix_s = [] { return clock_s.load(); };
  return options;
}

template <typename T, typename Ask>
absl::StatusOr<T> Wait(Ask ask) {
  std::promise<absl::StatusOr<T>> answer;
  ask([&answer](absl::StatusOr<T> result) { answer.set_value(std::move(result)); });
  return answer.get_future().get();
}

SignedIn Ada(const std::string& proof, AccessRole role = AccessRole::kPilot) {
  return {Sha256Hex("issuer\n7"), "Ada Lovelace", role, clock_s + 600, Sha256Hex(proof)};
}
absl::StatusOr<Issued> SignIn(AccessBook& book, const SignedIn& person) {
  return Wait<Issued>([&](auto done) { book.SignIn(person, done); });
}
absl::StatusOr<int> Revoke(AccessBook& book, const std::string& id) {
  return Wait<int>([&](auto done) { book.Revoke(id, done); });
}
absl::StatusOr<int> LetBack(AccessBook& book, const std::string& id) {
  return Wait<int>([&](auto done) { book.LetBack(id, done); });
}

TEST(SignIn, GivesAPassThatEndsWithTheToken) {
  const auto book = AccessBook::InMemory(Options());
  const auto issued = SignIn(*book, Ada("one"));
  ASSERT_TRUE(issued.ok()) << issued.status();
  const auto access = book->Check(issued->token);
  ASSERT_TRUE(access.ok());
  EXPECT_EQ(access->role, AccessRole::kPilot);
  EXPECT_EQ(access->person, "Ada Lovelace");
  EXPECT_EQ(access->expires_unix_s, clock_s + 600);
  EXPECT_EQ(access->invite_id, issued->invite.id);
  const std::vector<InviteFacts> listed = book->Invites();
  ASSERT_EQ(listed.size(), 1u);
  EXPECT_TRUE(listed[0].person);
  EXPECT_EQ(listed[0].label, "Ada Lovelace");
  clock_s += 600;
  EXPECT_THAT(book->Check(issued->token).status().message(), HasSubstr("sign in again"));
}

TEST(SignIn, TakesATokenOnceAlsoOverARestart) {
  const TemporaryFolder folder;
  {
    const auto book = *AccessBook::Open(folder.path(), Options());
    ASSERT_TRUE(SignIn(*book, Ada("one")).ok());
    EXPECT_THAT(SignIn(*book, Ada("one")).status().message(), HasSubstr("used already"));
    ASSERT_TRUE(SignIn(*book, Ada("two")).ok());
  }
  const auto book = *AccessBook::Open(folder.path(), Options());
  EXPECT_THAT(SignIn(*book, Ada("one")).status().message(), HasSubstr("used already"));
  EXPECT_THAT(SignIn(*book, Ada("two")).status().message(), HasSubstr("used already"));
  EXPECT_TRUE(SignIn(*book, Ada("three")).ok());
  ASSERT_EQ(book->Invites().size(), 1u) << "one person, however often they sign in";
  EXPECT_EQ(book->Invites()[0].used, 3);
}

TEST(SignIn, APersonHasTheRoleOfTheLastSignIn) {
  const auto book = AccessBook::InMemory(Options());
  const auto first = SignIn(*book, Ada("one", AccessRole::kWearer));
  const auto second = SignIn(*book, Ada("two", AccessRole::kViewer));
  for (const auto& issued : {first, second}) {
    EXPECT_EQ(book->Check(issued->token)->role, AccessRole::kViewer);
  }
}

TEST(SignIn, EachPassEndsByItselfAndIsTold) {
  std::mutex mutex;
  std::vector<std::string> ended;
  const auto book = AccessBook::InMemory(Options());
  book->SetOnEnded([&](const std::vector<std::string>& ids, const absl::Status& why) {
    const std::lock_guard guard(mutex);
    EXPECT_THAT(why.message(), HasSubstr("sign-in has expired"));
    ended.insert(ended.end(), ids.begin(), ids.end());
  });
  const auto first = SignIn(*book, Ada("one"));
  clock_s += 300;
  const auto second = SignIn(*book, Ada("two"));
  clock_s += 300;
  for (int tries = 0; tries < 200; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const std::lock_guard guard(mutex);
    if (!ended.empty()) break;
  }
  EXPECT_FALSE(book->Check(first->token).ok());
  EXPECT_TRUE(book->Check(second->token).ok());
  book->SetOnEnded(nullptr);
  EXPECT_THAT(ended, ElementsAre(first->token.substr(0, first->token.find('.'))));
}

TEST(SignIn, WhoWasRevokedStaysOutUntilLetBack) {
  const TemporaryFolder folder;
  std::string id, token;
  {
    const auto book = *AccessBook::Open(folder.path(), Options());
    const auto issued = SignIn(*book, Ada("one"));
    id = issued->invite.id;
    token = issued->token;
    EXPECT_EQ(*Revoke(*book, id), 1);
    EXPECT_THAT(book->Check(token).status().message(), HasSubstr("was revoked"));
    EXPECT_THAT(SignIn(*book, Ada("two")).status().message(), HasSubstr("revoked here"));
  }
  clock_s += 60 * 86'400;  // longer than what ended is kept
  const auto book = *AccessBook::Open(folder.path(), Options());
  EXPECT_THAT(SignIn(*book, Ada("three")).status().message(), HasSubstr("revoked here"));
  ASSERT_TRUE(LetBack(*book, id).ok());
  EXPECT_FALSE(book->Check(token).ok()) << "what was revoked stays ended";
  EXPECT_TRUE(SignIn(*book, Ada("four")).ok());
  EXPECT_TRUE(absl::IsNotFound(LetBack(*book, "s0").status()));
  const auto invite = Wait<Issued>([&](auto done) {
    book->CreateInvite({AccessRole::kViewer, 60, 1, ""}, done);
  });
  EXPECT_TRUE(absl::IsInvalidArgument(LetBack(*book, invite->invite.id).status()));
}

TEST(SignIn, RevokedPassesStayEndedAfterLettingBack) {
  const TemporaryFolder folder;
  std::string token;
  {
    const auto book = *AccessBook::Open(folder.path(), Options());
    const auto issued = SignIn(*book, Ada("one"));
    token = issued->token;
    EXPECT_TRUE(Revoke(*book, issued->invite.id).ok());
    EXPECT_TRUE(LetBack(*book, issued->invite.id).ok());
    EXPECT_FALSE(book->Check(token).ok());
    ASSERT_TRUE(SignIn(*book, Ada("two")).ok());
    EXPECT_FALSE(book->Check(token).ok());
  }
  const auto book = *AccessBook::Open(folder.path(), Options());
  EXPECT_FALSE(book->Check(token).ok());
}

TEST(SignIn, APersonIsNoInvite) {
  const auto book = AccessBook::InMemory(Options());
  const auto issued = SignIn(*book, Ada("one"));
  for (const std::string& secret : {Sha256Hex("issuer\n7").substr(0, 43), std::string(43, 'A')}) {
    const auto redeemed = Wait<Issued>(
        [&](auto done) { book->Redeem(absl::StrCat(issued->invite.id, ".", secret), done); });
    EXPECT_TRUE(absl::IsUnauthenticated(redeemed.status()));
  }
}

TEST(SignIn, WaitsWhereThereIsAWaitingRoom) {
  AccessBook::Options options = Options();
  options.waiting_room = true;
  const auto book = AccessBook::InMemory(options);
  const auto issued = SignIn(*book, Ada("one"));
  EXPECT_TRUE(issued->waiting);
  EXPECT_EQ(book->Check(issued->token)->role, AccessRole::kAnyone);
  ASSERT_EQ(book->Waiting().size(), 1u);
  EXPECT_EQ(book->Waiting()[0].display_name, "Ada Lovelace");
  const auto in = Wait<WaitingFacts>(
      [&](auto done) { book->Admit(book->Waiting()[0].id, /*refuse=*/false, done); });
  EXPECT_TRUE(in.ok());
  EXPECT_EQ(book->Check(issued->token)->role, AccessRole::kPilot);
}

TEST(SignIn, OnePersonHasNoMoreThanSoManyPasses) {
  const auto book = AccessBook::InMemory(Options());
  for (int i = 0; i < 32; ++i) ASSERT_TRUE(SignIn(*book, Ada(absl::StrCat(i))).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(SignIn(*book, Ada("more")).status()));
  clock_s += 600;
  EXPECT_TRUE(SignIn(*book, Ada("later")).ok());
}

TEST(SignIn, PeopleWhoAreOutMakeRoomAndBarredOnesStay) {
  AccessBook::Options options = Options();
  options.max_invites = 3;
  const auto book = AccessBook::InMemory(options);
  const auto person = [](int number) {
    return SignedIn{Sha256Hex(absl::StrCat(number)), "p", AccessRole::kViewer, clock_s + 600,
                    Sha256Hex(absl::StrCat("token ", number))};
  };
  const auto barred = SignIn(*book, person(0));
  ASSERT_TRUE(Revoke(*book, barred->invite.id).ok());
  ASSERT_TRUE(SignIn(*book, person(1)).ok());
  ASSERT_TRUE(SignIn(*book, person(2)).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(SignIn(*book, person(3)).status()));
  clock_s += 600;
  bool room = false;
  for (int tries = 0; tries < 200 && !room; ++tries) {  // once their ends were told
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    room = SignIn(*book, person(4)).ok();
  }
  EXPECT_TRUE(room);
  EXPECT_THAT(SignIn(*book, person(0)).status().message(), HasSubstr("revoked here"));
}

TEST(SignIn, TheAuditSaysWhoSignedIn) {
  const TemporaryFolder folder;
  const auto book = *AccessBook::Open(folder.path(), Options());
  const auto issued = SignIn(*book, Ada("one"));
  AuditFacts entry;
  entry.access_id = issued->token.substr(0, issued->token.find('.'));
  entry.display_name = "somebody else";
  entry.call = "AnnotationService/Create";
  entry.outcome = "ok";
  book->Record(entry);
  const auto kept = Wait<std::vector<AuditFacts>>([&](auto done) { book->ReadAudit(10, done); });
  ASSERT_EQ(kept->size(), 1u);
  EXPECT_EQ(kept->front().display_name, "Ada Lovelace");
  EXPECT_EQ(kept->front().invite_id, issued->invite.id);
}

// As the version before left it.
TEST(SignIn, AnOlderDataBaseIsTakenOver) {
  const TemporaryFolder folder;
  std::string token;
  {
    const auto book = *AccessBook::Open(folder.path(), Options());
    const auto invite = Wait<Issued>([&](auto done) {
      book->CreateInvite({AccessRole::kPilot, 6000, 1, "kept"}, done);
    });
    token = Wait<Issued>([&](auto done) { book->Redeem(invite->token, done); })->token;
  }
  {
    const auto database = *SqliteDatabase::Open(folder / "access.sqlite");
    ASSERT_TRUE(database
                    ->Execute("ALTER TABLE passes DROP COLUMN expires_unix_s;"
                              "ALTER TABLE passes DROP COLUMN proof_sha256;"
                              "PRAGMA user_version = 2")
                    .ok());
  }
  const auto book = *AccessBook::Open(folder.path(), Options());
  EXPECT_EQ(book->Check(token)->role, AccessRole::kPilot);
  EXPECT_TRUE(SignIn(*book, Ada("one")).ok());
}

}  // namespace
}  // namespace saccade::sign_in_test
