#include "server/identity/certificate_files.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/time/time.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "server/store/store_files.hpp"
#include "shared/io/log.hpp"
#include "shared/io/private_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kSecondsADay = 86'400;
constexpr std::int64_t kRenew_s = 30 * kSecondsADay;
constexpr std::int64_t kSayAuthority_s = 60 * kSecondsADay, kSayGiven_s = 14 * kSecondsADay;
constexpr std::size_t kMaxPemBytes = 256 * 1024;

absl::StatusOr<CertificateAndKey> Read(const fs::path& certificate, const fs::path& key) {
  absl::StatusOr<std::string> pem = ReadRegularFile(certificate, kMaxPemBytes, "a certificate");
  if (!pem.ok()) return pem.status();
  absl::StatusOr<std::string> secret = ReadRegularFile(key, kMaxPemBytes, "a private key");
  if (!secret.ok()) return secret.status();
  return CertificateAndKey{*std::move(pem), *std::move(secret)};
}

absl::Status Write(const fs::path& directory, const std::string& name,
                   const CertificateAndKey& pair) {
  // The key first: a certificate whose key is not there yet would be taken for damaged.
  using Part = std::pair<const char*, const std::string*>;
  for (const auto& [end, text] :
       {Part(".key", &pair.key_pem), Part(".pem", &pair.certificate_pem)}) {
    const int failed = WritePrivateFile(directory / (name + end), *text);
    if (failed != 0) return StoreFileError(directory / (name + end), failed);
  }
  return absl::OkStatus();
}

bool HasAll(const std::vector<std::string>& has, const std::vector<std::string>& wanted) {
  return std::all_of(wanted.begin(), wanted.end(), [&has](const std::string& one) {
    return std::find(has.begin(), has.end(), one) != has.end();
  });
}

std::vector<std::string> LeftOut(const ServerNames& asked, const ServerNames& named) {
  std::vector<std::string> left;
  for (const std::string& name : asked.All()) {
    if (!HasAll(named.All(), {name})) left.push_back(name);
  }
  return left;
}

absl::StatusOr<CertificateAndKey> Authority(const fs::path& directory, const ServerNames& names,
                                            std::int64_t now_unix_s) {
  const fs::path certificate = directory / "authority.pem", key = directory / "authority.key";
  std::error_code ignored;
  if (fs::exists(certificate, ignored)) {
    absl::StatusOr<CertificateAndKey> kept = Read(certificate, key);
    absl::Status fit = kept.status();
    if (fit.ok()) fit = CheckPair(kept->certificate_pem, kept->key_pem);
    if (!fit.ok()) {
      return absl::DataLossError(absl::StrCat(
          certificate.string(), " with its key: ", fit.message(), "; move ", directory.string(),
          " away, and a new authority is made, which every client has to trust anew"));
    }
    const absl::StatusOr<CertificateFacts> facts = InspectCertificate(kept->certificate_pem);
    if (facts.ok() && facts->not_after_unix_s > now_unix_s + kRenew_s) return kept;
  }
  absl::StatusOr<CertificateAndKey> made =
      MakeAuthority(absl::StrCat("Saccade on ", ServerNames::OfThisMachine().dns.back()), names);
  if (!made.ok()) return made;
  if (absl::Status written = Write(directory, "authority", *made); !written.ok()) return written;
  Log(absl::StrCat("tls: made an authority of this server's own, ", certificate.string(),
                   "; `saccade trust` exports it"));
  return made;
}

// Why the server's certificate cannot be used (any more); empty if it can.
std::string Lacking(const absl::StatusOr<CertificateAndKey>& kept, const std::string& root_pem,
                    const ServerNames& names, std::int64_t now_unix_s) {
  if (!kept.ok()) return "there was none";
  if (!CheckPair(kept->certificate_pem, kept->key_pem).ok()) return "the old one was damaged";
  if (!SignedBy(kept->certificate_pem, root_pem)) return "the authority is new";
  const absl::StatusOr<CertificateFacts> facts = InspectCertificate(kept->certificate_pem);
  if (!facts.ok()) return "the old one was damaged";
  if (facts->not_after_unix_s < now_unix_s + kRenew_s) return "the old one expires";
  const bool named =
      HasAll(facts->names.dns, names.dns) && HasAll(facts->names.addresses, names.addresses);
  return named ? "" : "names or addresses have changed";
}

}  // namespace

absl::StatusOr<ServerIdentity> EnsureServerIdentity(const fs::path& data_dir,
                                                    const ServerNames& asked,
                                                    std::int64_t now_unix_s) {
  if (absl::Status ready = PrepareDirectory(data_dir); !ready.ok()) return ready;
  const fs::path directory = data_dir / "tls";
  if (absl::Status ready = PrepareDirectory(directory); !ready.ok()) return ready;
  if (::chmod(directory.c_str(), 0700) != 0) return StoreFileError(directory, errno);
  const absl::StatusOr<CertificateAndKey> authority = Authority(directory, asked, now_unix_s);
  if (!authority.ok()) return authority.status();
  const ServerNames names = PermittedBy(authority->certificate_pem, asked);
  absl::StatusOr<CertificateAndKey> server =
      Read(directory / "server.pem", directory / "server.key");
  const std::string why = Lacking(server, authority->certificate_pem, names, now_unix_s);
  if (!why.empty()) {
    server = MakeServerCertificate(*authority, names);
    if (!server.ok()) return server.status();
    if (absl::Status written = Write(directory, "server", *server); !written.ok()) return written;
    Log(absl::StrCat("tls: made a certificate (", why, ") for ", absl::StrJoin(names.dns, ", "),
                     ", ", absl::StrJoin(names.addresses, ", ")));
  }
  const absl::StatusOr<CertificateFacts> root = InspectCertificate(authority->certificate_pem);
  if (!root.ok()) return root.status();
  return ServerIdentity{server->certificate_pem + authority->certificate_pem, server->key_pem,
                        authority->certificate_pem, root->sha256, LeftOut(asked, names)};
}

std::string ExpiryWarning(const ServerIdentity& identity, std::int64_t now_unix_s) {
  const bool own = !identity.root_pem.empty();
  const absl::StatusOr<CertificateFacts> facts =
      InspectCertificate(own ? identity.root_pem : identity.chain_pem);
  if (!facts.ok()) return "";
  const std::int64_t left_s = facts->not_after_unix_s - now_unix_s;
  if (left_s > (own ? kSayAuthority_s : kSayGiven_s)) return "";
  const std::string day = absl::FormatTime(
      "%Y-%m-%d", absl::FromUnixSeconds(facts->not_after_unix_s), absl::UTCTimeZone());
  if (own) {
    const std::int64_t days = std::max<std::int64_t>(0, (left_s - kRenew_s) / kSecondsADay);
    return absl::StrCat(
        "tls: this server's authority ends on ", day, "; in ", days,
        " days a new one is made, which everybody has to trust anew (/trust, "
        "`saccade trust`); to choose the day, stop the server and move DATA_DIR/tls "
        "away");
  }
  if (left_s <= 0) {
    return absl::StrCat("tls: the given certificate ended on ", day,
                        ": nobody can connect; put a new one in its place, it is taken up at once");
  }
  return absl::StrCat("tls: the given certificate ends on ", day, ", in ", left_s / kSecondsADay,
                      " days; put a new one in its place, it is taken up at once");
}

absl::StatusOr<ServerIdentity> LoadServerIdentity(const fs::path& certificate, const fs::path& key,
                                                  std::int64_t now_unix_s) {
  const absl::StatusOr<CertificateAndKey> pair = Read(certificate, key);
  if (!pair.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("tls: ", pair.status().message()));
  }
  const auto bad = [&](absl::string_view problem) {
    return absl::InvalidArgumentError(
        absl::StrCat("tls.certificate: ", certificate.string(), ": ", problem));
  };
  if (absl::Status fit = CheckPair(pair->certificate_pem, pair->key_pem); !fit.ok()) {
    return bad(fit.message());
  }
  const absl::StatusOr<CertificateFacts> facts = InspectCertificate(pair->certificate_pem);
  if (!facts.ok()) return bad(facts.status().message());
  if (facts->not_after_unix_s < now_unix_s) return bad("has expired; have a new one made");
  return ServerIdentity{pair->certificate_pem, pair->key_pem, "", "", {}};
}

}  // namespace saccade
