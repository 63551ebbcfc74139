#include "server/identity/access_book.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <condition_variable>
#include <fstream>
#include <future>
#include <iterator>
#include <mutex>

#include "server/identity/secret.hpp"
#include "server/store/sqlite.hpp"
#include "tests/unit/server/identity/temporary_folder.hpp"

namespace saccade::access_book_test {
namespace {

using saccade::testing::TemporaryFolder;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::Not;

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

Issued Invite(AccessBook& book, AccessRole role, std::int64_t life_s = 3600, int uses = 1) {
  return *Wait<Issued>([&](auto done) { book.CreateInvite({role, life_s, uses, "test"}, done); });
}
absl::StatusOr<Issued> Redeem(AccessBook& book, const std::string& token) {
  return Wait<Issued>([&](auto done) { book.Redeem(token, done); });
}

std::string Text(const absl::Status& status) { return std::string(status.message()); }

TEST(Secret, TokensAreRandomAndReadBack) {
  const Token one = NewToken('p'), two = NewToken('p');
  EXPECT_NE(one.secret, two.secret);
  EXPECT_EQ(one.secret.size(), 43u) << "256 bits";
  const auto read = ParseToken(one.ToString());
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->id, one.id);
  EXPECT_EQ(read->secret, one.secret);
  for (const std::string& bad :
       {std::string(), std::string("."), one.id, one.secret, one.ToString() + "x",
        one.id + "." + one.secret.substr(1) + "\n"}) {
    EXPECT_FALSE(ParseToken(bad).has_value()) << bad;
  }
}

TEST(AccessBook, AnInviteIsRedeemedForAPassOfItsRole) {
  const auto book = AccessBook::InMemory(Options());
  const Issued invite = Invite(*book, AccessRole::kPilot);
  const auto pass = Redeem(*book, invite.token);
  ASSERT_TRUE(pass.ok()) << pass.status();
  const auto access = book->Check(pass->token);
  ASSERT_TRUE(access.ok()) << access.status();
  EXPECT_EQ(access->role, AccessRole::kPilot);
  EXPECT_EQ(access->expires_unix_s, clock_s + 3600);
  // The invite itself opens nothing: a link that leaks after use is worth nothing.
  EXPECT_FALSE(book->Check(invite.token).ok());
}

TEST(AccessBook, SaysWhyItLetsNobodyIn) {
  const auto book = AccessBook::InMemory(Options());
  const Issued once = Invite(*book, AccessRole::kViewer, 60);
  ASSERT_TRUE(Redeem(*book, once.token).ok());
  EXPECT_THAT(Text(Redeem(*book, once.token).status()), HasSubstr("used up"));
  const Issued brief = Invite(*book, AccessRole::kViewer, 60);
  clock_s += 60;
  EXPECT_THAT(Text(Redeem(*book, brief.token).status()), HasSubstr("expired"));
  EXPECT_THAT(Text(Redeem(*book, "nonsense").status()), HasSubstr("not known"));
  EXPECT_THAT(Text(book->Check("").status()), HasSubstr("invite"));
  std::string forged = once.token;
  forged.back() = forged.back() == 'A' ? 'B' : 'A';
  EXPECT_THAT(Text(Redeem(*book, forged).status()), HasSubstr("not known"));
}

TEST(AccessBook, RevokedInvitesThrowOutTheirPassesAtOnce) {
  const auto book = AccessBook::InMemory(Options());
  std::mutex mutex;
  std::vector<std::string> ended;
  book->SetOnEnded([&](const std::vector<std::string>& ids, const absl::Status& why) {
    const std::lock_guard lock(mutex);
    ended = ids;
    EXPECT_THAT(Text(why), HasSubstr("revoked"));
  });
  const Issued invite = Invite(*book, AccessRole::kAnnotator, 3600, 5);
  const Issued other = Invite(*book, AccessRole::kAnnotator);
  const std::string one = Redeem(*book, invite.token)->token;
  const std::string two = Redeem(*book, invite.token)->token;
  const std::string stays = Redeem(*book, other.token)->token;
  const std::string id = book->Check(one)->id;
  EXPECT_EQ(*Wait<int>([&](auto done) { book->Revoke(invite.invite.id, done); }), 2);
  {
    const std::lock_guard lock(mutex);
    EXPECT_THAT(ended, ::testing::Contains(id));
  }
  EXPECT_THAT(Text(book->Check(one).status()), HasSubstr("revoked"));
  EXPECT_THAT(Text(book->Check(two).status()), HasSubstr("revoked"));
  EXPECT_THAT(Text(Redeem(*book, invite.token).status()), HasSubstr("revoked"));
  EXPECT_TRUE(book->Check(stays).ok());
  const auto unknown = Wait<int>([&](auto done) { book->Revoke("i0", done); });
  EXPECT_EQ(unknown.status().code(), absl::StatusCode::kNotFound);
}

TEST(AccessBook, APassEndsWithTheLifeOfItsInviteWithoutBeingAsked) {
  const auto book = AccessBook::InMemory(Options());
  std::promise<std::vector<std::string>> ended;
  book->SetOnEnded(
      [&](const std::vector<std::string>& ids, const absl::Status&) { ended.set_value(ids); });
  const std::string pass = Redeem(*book, Invite(*book, AccessRole::kWearer, 100).token)->token;
  const std::string id = book->Check(pass)->id;
  clock_s += 100;
  EXPECT_THAT(Text(book->Check(pass).status()), HasSubstr("expired"));
  auto told = ended.get_future();
  ASSERT_EQ(told.wait_for(seconds(3)), std::future_status::ready);
  EXPECT_THAT(told.get(), ::testing::ElementsAre(id));
}

TEST(AccessBook, KeepsHashesAloneAndThemOverARestart) {
  const TemporaryFolder folder;
  std::string pass, open_invite, revoked;
  {
    auto book = *AccessBook::Open(folder.path(), Options());
    const Issued invite = Invite(*book, AccessRole::kPilot, 3600, 2);
    open_invite = invite.token;
    pass = Redeem(*book, invite.token)->token;
    const Issued other = Invite(*book, AccessRole::kViewer);
    revoked = Redeem(*book, other.token)->token;
    ASSERT_TRUE(Wait<int>([&](auto done) { book->Revoke(other.invite.id, done); }).ok());
  }
  for (const char* name : {"access.sqlite"}) {
    struct stat facts {};
    ASSERT_EQ(stat((folder / name).c_str(), &facts), 0);
    EXPECT_EQ(facts.st_mode & 0777u, 0600u) << name;
    std::ifstream in(folder / name, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    for (const std::string& token : {pass, open_invite, revoked}) {
      EXPECT_THAT(bytes, HasSubstr(token.substr(0, token.find('.'))));
      EXPECT_THAT(bytes, Not(HasSubstr(token.substr(token.find('.') + 1))));
    }
  }
  const auto book = *AccessBook::Open(folder.path(), Options());
  EXPECT_EQ(book->Check(pass)->role, AccessRole::kPilot);
  EXPECT_THAT(Text(book->Check(revoked).status()), HasSubstr("revoked"));
  EXPECT_TRUE(Redeem(*book, open_invite).ok()) << "its second use";
  EXPECT_THAT(Text(Redeem(*book, open_invite).status()), HasSubstr("used up"));
}

TEST(AccessBook, TheOwnerIsWhoStartedThisRun) {
  const auto book = AccessBook::InMemory(Options()), other = AccessBook::InMemory(Options());
  EXPECT_EQ(book->Check(book->owner_token())->role, AccessRole::kOwner);
  EXPECT_FALSE(book->Check(other->owner_token()).ok());
}

TEST(AccessBook, WhereNoTokenIsNeededABadOneKeepsNobodyOut) {
  AccessBook::Options options = Options();
  options.token_required = false;
  const auto book = AccessBook::InMemory(options);
  EXPECT_EQ(book->Check("")->role, AccessRole::kWearer);
  EXPECT_EQ(book->Check("stale")->role, AccessRole::kWearer);
  EXPECT_EQ(book->Check(book->owner_token())->role, AccessRole::kOwner);
}

TEST(InviteDraft, IsRefusedByField) {
  const auto refusal = [](AccessRole role, std::int64_t life_s, int uses, std::size_t label) {
    return Text(InviteDraft{role, life_s, uses, std::string(label, 'a')}.Validate());
  };
  EXPECT_EQ(refusal(AccessRole::kWearer, 60, 1, 60), "");
  EXPECT_THAT(refusal(AccessRole::kOwner, 60, 1, 0), HasSubstr("role"));
  EXPECT_THAT(refusal(AccessRole::kViewer, 59, 1, 0), HasSubstr("life_s"));
  EXPECT_THAT(refusal(AccessRole::kViewer, 60, 0, 0), HasSubstr("uses"));
  EXPECT_THAT(refusal(AccessRole::kViewer, 60, 1, 61), HasSubstr("label"));
}

TEST(WaitingRoom, KeepsWhoWaitsOverARestartAndForgetsWhoWasDecidedOn) {
  const TemporaryFolder folder;
  std::string ada, eve, id_of_ada;
  {
    const auto book = *AccessBook::Open(folder.path(), Options());
    const Issued invite = *Wait<Issued>([&](auto done) {
      book->CreateInvite({AccessRole::kPilot, 3600, 3, "experts", true}, done);
    });
    const auto come = [&](const std::string& name) {
      return Wait<Issued>([&](auto done) { book->Redeem(invite.token, done, name); })->token;
    };
    ada = come("Ada");
    eve = come("Eve");
    come("");
    ASSERT_EQ(book->Waiting().size(), 3u);
    for (const WaitingFacts& one : book->Waiting()) {
      if (one.display_name == "Ada") id_of_ada = one.id;
      if (one.display_name != "Eve") continue;
      EXPECT_EQ(one.label, "experts");
      const std::string id = one.id;
      EXPECT_TRUE(Wait<WaitingFacts>([&](auto done) { book->Admit(id, true, done); }).ok());
    }
  }
  const auto book = *AccessBook::Open(folder.path(), Options());
  EXPECT_EQ(book->Waiting().size(), 2u);
  EXPECT_TRUE(book->Check(ada)->waiting);
  EXPECT_THAT(Text(book->Check(eve).status()), HasSubstr("you were not let in"));
  EXPECT_TRUE(Wait<WaitingFacts>([&](auto done) { book->Admit(id_of_ada, false, done); }).ok());
  EXPECT_FALSE(book->Check(ada)->waiting);
  EXPECT_EQ(
      Wait<WaitingFacts>([&](auto done) { book->Admit(id_of_ada, true, done); }).status().code(),
      absl::StatusCode::kNotFound);
}

TEST(WaitingRoom, AsASettingHoldsEverybodyBelowTheWearer) {
  AccessBook::Options options = Options();
  options.waiting_room = true;
  const auto book = AccessBook::InMemory(options);
  EXPECT_TRUE(Redeem(*book, Invite(*book, AccessRole::kPilot).token)->waiting);
  EXPECT_FALSE(Redeem(*book, Invite(*book, AccessRole::kWearer).token)->waiting);
}

TEST(WaitingRoom, HoldsAlsoWhoComesByAnInviteThatIsOlder) {
  const TemporaryFolder folder;
  const std::string older = [&] {
    const auto book = *AccessBook::Open(folder.path(), Options());
    return Invite(*book, AccessRole::kPilot).token;
  }();
  AccessBook::Options options = Options();
  options.waiting_room = true;
  const auto book = *AccessBook::Open(folder.path(), options);
  EXPECT_TRUE(Redeem(*book, older)->waiting);
}

// Written by the version before the waiting room.
TEST(AccessBook, AnOlderFileGoesOn) {
  const TemporaryFolder folder;
  std::string pass;
  {
    const auto book = *AccessBook::Open(folder.path(), Options());
    pass = Redeem(*book, Invite(*book, AccessRole::kPilot).token)->token;
  }
  {
    const auto database = *SqliteDatabase::Open(folder / "access.sqlite");
    for (const char* step :
         {"ALTER TABLE invites DROP COLUMN waits", "ALTER TABLE passes DROP COLUMN display_name",
          "ALTER TABLE passes DROP COLUMN since_unix_s", "ALTER TABLE passes DROP COLUMN state",
          "ALTER TABLE passes DROP COLUMN expires_unix_s",
          "ALTER TABLE passes DROP COLUMN proof_sha256", "PRAGMA user_version = 1"}) {
      ASSERT_TRUE(database->Execute(step).ok()) << step;
    }
  }
  const auto book = *AccessBook::Open(folder.path(), Options());
  EXPECT_TRUE(book->Check(pass).ok());
  EXPECT_FALSE(book->Check(pass)->waiting);
}

TEST(Audit, WhoIsRefusedOverAndOverPushesNobodysDeedsOut) {
  const TemporaryFolder folder;
  const auto book = *AccessBook::Open(folder.path(), Options());
  book->Record({0, "", "Ann", "p1", "", "AnnotationService/Create", "ok"});
  for (int i = 0; i < 900; ++i) {
    book->Record({0, "", "Eve", "p2", "", "MapService/Reset", "PERMISSION_DENIED"});
  }
  book->Record({0, "", "Bob", "p3", "", "MapService/Reset", "PERMISSION_DENIED"});
  const auto entries =
      Wait<std::vector<AuditFacts>>([&](auto done) { book->ReadAudit(10'000, std::move(done)); });
  ASSERT_TRUE(entries.ok());
  int of_eve = 0, others = 0;
  bool told = false;
  for (const AuditFacts& one : *entries) {
    of_eve += one.display_name == "Eve";
    others += one.display_name == "Ann" || one.display_name == "Bob";
    told = told || one.call.find(" more that came too fast") != std::string::npos;
  }
  EXPECT_LE(of_eve, 60);
  EXPECT_GE(of_eve, 20) << "that she tried is to be seen";
  EXPECT_EQ(others, 2);
  EXPECT_TRUE(told);
}

}  // namespace
}  // namespace saccade::access_book_test
