#include "server/app/front_door.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/strip.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <future>
#include <mutex>
#include <nlohmann/json.hpp>

#include "server/store/store_files.hpp"
#include "shared/io/log.hpp"
#include "shared/io/private_file.hpp"
#include "shared/io/qr_code.hpp"

namespace saccade {
namespace {

constexpr std::chrono::seconds kPatience(5);  // of a disk, for one invite
constexpr std::chrono::seconds kLook(10);     // for another certificate
constexpr std::int64_t kConsoleLife_s = 8 * 3600;

std::int64_t NowUnix_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

bool IsEveryAddress(const std::string& host) { return host == "0.0.0.0" || host == "::"; }

// Where this machine reaches a server that listens there.
std::string LocalAddress(Address address, int port) {
  if (address.host == "0.0.0.0") address.host = "127.0.0.1";
  if (address.host == "::") address.host = "::1";
  return address.ToString(port);
}

// How others reach it: the first address that is not loopback, IPv4 if there is one.
std::string OutsideHost(const std::string& host) {
  if (!IsEveryAddress(host)) return host;
  std::string found = "127.0.0.1";
  for (const std::string& address : ServerNames::OfThisMachine().addresses) {
    const bool v6 = absl::StrContains(address, ':');
    if (absl::StartsWith(address, "127.") || address == "::1" || (v6 && host == "0.0.0.0")) {
      continue;
    }
    if (!v6) return address;
    if (found == "127.0.0.1") found = address;
  }
  return found;
}

// "https://name:port" without the rest.
std::string HostOfUrl(absl::string_view url) {
  if (!absl::ConsumePrefix(&url, "https://")) absl::ConsumePrefix(&url, "http://");
  const std::size_t port = url.find(':', url.rfind(']') == url.npos ? 0 : url.rfind(']'));
  return std::string(url.substr(0, port));
}

/// Empty: it has none.
std::string GivenName(const ServerIdentity& identity) {
  const absl::StatusOr<CertificateFacts> facts = InspectCertificate(identity.chain_pem);
  if (!facts.ok()) return "";
  if (!facts->names.dns.empty()) return facts->names.dns.front();
  return facts->names.addresses.empty() ? "" : facts->names.addresses.front();
}

void SayNotNamed(const ServerIdentity& identity) {
  if (identity.not_named.empty()) return;
  Log(absl::StrCat(
      "tls: this server's authority was made for other names, so nobody can connect by ",
      absl::StrJoin(identity.not_named, ", "),
      "; give a certificate, or move DATA_DIR/tls away: then a new authority is made, "
      "which everybody has to trust anew"));
}

absl::StatusOr<Issued> CreateNow(AccessBook& book, const InviteDraft& draft) {
  const auto made = std::make_shared<std::promise<absl::StatusOr<Issued>>>();
  std::future<absl::StatusOr<Issued>> answer = made->get_future();
  book.CreateInvite(draft,
                    [made](absl::StatusOr<Issued> issued) { made->set_value(std::move(issued)); });
  if (answer.wait_for(kPatience) != std::future_status::ready) {
    return absl::DeadlineExceededError("the disk does not answer");
  }
  return answer.get();
}

}  // namespace

absl::StatusOr<std::unique_ptr<FrontDoor>> FrontDoor::Open(const ServerConfig& config) {
  std::unique_ptr<FrontDoor> door(new FrontDoor(config));
  if (config.WantsTls(config.grpc) || config.WantsTls(config.http)) {
    absl::StatusOr<ServerIdentity> identity = door->Identify();
    if (!identity.ok()) return identity.status();
    const absl::StatusOr<CertificateFacts> facts = InspectCertificate(identity->chain_pem);
    if (facts.ok()) door->allowed_hosts_ = facts->names.dns;
    door->identity_ = *std::move(identity);
    door->served_chain_ = door->identity_->chain_pem;
    SayNotNamed(*door->identity_);
  }
  if (!config.public_url.empty()) door->allowed_hosts_.push_back(HostOfUrl(config.public_url));
  AccessBook::Options options;
  options.token_required = config.auth_required;
  options.waiting_room = config.waiting_room;
  if (config.auth_required) {
    absl::StatusOr<std::unique_ptr<AccessBook>> book = AccessBook::Open(config.data_dir, options);
    if (!book.ok()) return book.status();
    door->access_ = *std::move(book);
  } else {
    door->access_ = AccessBook::InMemory(options);
    // Of a run that was killed: it would tell `saccade` of a server that is no more.
    ::unlink((config.data_dir / "owner.json").c_str());
  }
  if (config.oidc) door->provider_ = std::make_unique<IdentityProvider>(*config.oidc);
  return door;
}

absl::StatusOr<ServerIdentity> FrontDoor::Identify() const {
  if (!config_.tls_certificate.empty()) {
    return LoadServerIdentity(config_.tls_certificate, config_.tls_key, NowUnix_s());
  }
  ServerNames names = ServerNames::OfThisMachine();
  if (!config_.public_url.empty()) names.Add(HostOfUrl(config_.public_url));
  return EnsureServerIdentity(config_.data_dir, names, NowUnix_s());
}

void FrontDoor::Watch(OnNew on_new) {
  watch_ = {};  // stopped and joined
  if (on_new == nullptr || !identity_) return;
  watch_ = std::jthread([this, on_new = std::move(on_new)](const std::stop_token& stop) {
    std::mutex mutex;
    std::condition_variable_any never;
    std::unique_lock lock(mutex);
    while (!never.wait_for(lock, stop, kLook, [&stop] { return stop.stop_requested(); })) {
      Look(on_new);
    }
  });
}

// Once a day, as logs are read by people.
void FrontDoor::SayExpiry() {
  const std::int64_t now_unix_s = NowUnix_s(), day = now_unix_s / 86'400;
  if (!identity_ || day == said_day_) return;
  const std::string warning = ExpiryWarning(*identity_, now_unix_s);
  if (warning.empty()) return;
  said_day_ = day;
  Log(warning);
}

void FrontDoor::Look(const OnNew& on_new) {
  SayExpiry();
  const absl::StatusOr<ServerIdentity> now = Identify();
  const bool same = now.ok() && now->chain_pem == served_chain_;
  absl::Status status = now.status();
  if (now.ok() && !same) status = on_new(*now);
  if (!status.ok()) {
    if (said_ != status.message()) {
      Log(absl::StrCat("tls: the present certificate stays: ", status.message()));
    }
    said_ = std::string(status.message());
    return;
  }
  said_.clear();
  if (same) return;
  served_chain_ = now->chain_pem;
  SayNotNamed(*now);
  const bool other_root = now->root_pem != identity_->root_pem;
  identity_ = *now;
  Log("tls: who connects from now on sees the new certificate");
  if (!other_root) return;
  Log(absl::StrCat("tls: of a new authority: everybody has to trust it anew: ", base_url_,
                   "/trust, fingerprint ", identity_->root_sha256));
  if (!wrote_owner_) return;
  if (absl::Status written = WriteOwner(); !written.ok()) {
    Log(absl::StrCat("saccade on this machine cannot connect: ", written.message()));
  }
}

FrontDoor::~FrontDoor() {
  Watch(nullptr);
  if (wrote_owner_) ::unlink((config_.data_dir / "owner.json").c_str());
}

std::optional<ServerIdentity> FrontDoor::TlsOf(const Address& address) const {
  return config_.WantsTls(address) ? identity_ : std::nullopt;
}

bool FrontDoor::insecure() const { return config_.insecure && config_.beyond_loopback(); }

std::string FrontDoor::BaseUrl(int http_port) const {
  if (!config_.public_url.empty()) return config_.public_url;
  Address outside = config_.http;
  outside.host = OutsideHost(outside.host);
  return absl::StrCat(config_.WantsTls(config_.http) ? "https://" : "http://",
                      outside.ToString(http_port));
}

const char* FrontDoor::WearerPath() const {
  return absl::StartsWith(config_.source, "phone:") ? "/wear" : "/wearer";
}

std::string FrontDoor::LinkOf(AccessRole role, const std::string& token) const {
  return absl::StrCat(base_url_, role == AccessRole::kWearer ? WearerPath() : "/",
                      "#invite=", token);
}

absl::Status FrontDoor::Announce(int grpc_port, int http_port) {
  base_url_ = BaseUrl(http_port);
  if (insecure()) {
    Log("saccade-server: INSECURE: other machines reach this server without TLS; whoever is on the "
        "network sees and changes everything");
  }
  const bool by_phone = absl::StartsWith(config_.source, "phone:");
  if (by_phone && !config_.auth_required) {
    Log(absl::StrCat("waiting for the phone: open ", base_url_, WearerPath(), " on it"));
  }
  if (!config_.auth_required) return absl::OkStatus();
  owner_grpc_ = LocalAddress(config_.grpc, grpc_port);
  if (absl::Status written = WriteOwner(); !written.ok()) return written;
  wrote_owner_ = true;
  SayExpiry();
  SayInvites();
  return absl::OkStatus();
}

absl::Status FrontDoor::WriteOwner() const {
  // A given certificate has no name like 127.0.0.1; whom it is by is the system's store to say, or
  // --trust.
  const bool given = identity_ && !config_.tls_certificate.empty();
  const std::string root = !identity_ || given ? "" : identity_->root_pem;
  const nlohmann::json owner = {{"grpc", owner_grpc_},
                                {"tls", config_.WantsTls(config_.grpc)},
                                {"root", root},
                                {"name", given ? GivenName(*identity_) : ""},
                                {"token", access_->owner_token()}};
  const std::filesystem::path file = config_.data_dir / "owner.json";
  const int failed = WritePrivateFile(file, owner.dump() + "\n");
  return failed == 0 ? absl::OkStatus() : StoreFileError(file, failed);
}

void FrontDoor::SayInvites() {
  if (identity_ && !identity_->root_pem.empty()) {
    Log(absl::StrCat("tls: whoever connects has to trust this server's authority once: ", base_url_,
                     "/trust, fingerprint ", identity_->root_sha256));
  }
  if (absl::StartsWith(config_.source, "phone:")) {
    Log(absl::StrCat(
        "waiting for the phone: open on it the link that `saccade invite --role wearer "
        "--data-dir ",
        config_.data_dir.string(), "` makes"));
  }
  Log(absl::StrCat("invites: `saccade invite --role pilot --data-dir ", config_.data_dir.string(),
                   "` makes a link"));
  if (config_.oidc) {
    Log(absl::StrCat("oidc: who signs in with ", config_.oidc->issuer,
                     " comes in; it has to know the redirect URI ", base_url_, "/"));
  }
  if (::isatty(STDERR_FILENO) == 0) return;
  const InviteDraft pilot{AccessRole::kPilot, kConsoleLife_s, 1, "console", false};
  const InviteDraft wearer{AccessRole::kWearer, kConsoleLife_s, 1, "console", false};
  const absl::StatusOr<Issued> expert = CreateNow(*access_, pilot);
  const absl::StatusOr<Issued> phone = CreateNow(*access_, wearer);
  if (!expert.ok() || !phone.ok()) {
    const absl::Status& why = expert.ok() ? phone.status() : expert.status();
    return Log(absl::StrCat("invites: none could be made: ", why.message()));
  }
  const std::string link = LinkOf(AccessRole::kWearer, phone->token);
  FlushLog(std::chrono::milliseconds(500));
  // Not Log: a QR code needs its colours.
  std::string text =
      absl::StrCat("\n  Expert (once, 8 h)  ", LinkOf(AccessRole::kPilot, expert->token),
                   "\n  Wearer (once, 8 h)  ", link, "\n\n");
  for (const std::string& line : QrCodeLines(link)) absl::StrAppend(&text, "  ", line, "\n");
  (void)!::write(STDERR_FILENO, text.data(), text.size());
}

}  // namespace saccade
