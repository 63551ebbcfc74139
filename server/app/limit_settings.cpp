#include "server/app/limit_settings.hpp"

#include "shared/io/option_table.hpp"

namespace saccade {
namespace {

const OptionTable<LimitSettings>& Table() {
  using L = LimitSettings;
  static const OptionTable<L> table = {
      {"scale", &L::scale, 0, 1000, "of every rate; 0: neither rates nor counts, for laboratories"},
      {"requests_per_s", &L::requests_per_s, 0, 1e6, "calls of one pass; 0: no limit"},
      {"bytes_per_s", &L::bytes_per_s, 0, 1e10, "of requests of one pass; 0: no limit"},
      {"sessions", &L::sessions, 0, 1000, "of one pass at a time; 0: no limit"},
      {"invite_requests_per_s", &L::invite_requests_per_s, 0, 1e6,
       "calls of everybody who came by one invite; 0: no limit"},
      {"invite_bytes_per_s", &L::invite_bytes_per_s, 0, 1e10,
       "of requests of everybody who came by one invite; 0: no limit"},
      {"invite_sessions", &L::invite_sessions, 0, 1000,
       "of everybody who came by one invite at a time; 0: no limit"},
      {"address_requests_per_s", &L::address_requests_per_s, 0, 1e6, "calls from one address"},
      {"address_bytes_per_s", &L::address_bytes_per_s, 0, 1e10, "of requests from one address"},
      {"address_connections_per_s", &L::address_connections_per_s, 0, 1e5,
       "new connections (handshakes) from one address, on each port"},
      {"address_connections", &L::address_connections, 0, 100'000,
       "open from one address, on each port; 0: no limit"},
      {"address_unheard", &L::address_unheard, 0, 100'000,
       "of these without a whole handshake or request yet; 0: no limit"},
      {"network_connections", &L::network_connections, 0, 100'000,
       "open from one network (/24, IPv6 /48), on each port; 0: no limit"},
      {"this_machine", &L::this_machine, 0, 1, "loopback is limited by address, too"},
      {"connections", &L::connections, 1, 100'000, "open on each port"},
      {"annotations", &L::annotations, 1, 10'000, "that stand at one time"},
      {"session_annotations", &L::session_annotations, 1, 10'000, "of these by one person"}};
  return table;
}

}  // namespace

absl::Status LimitSettings::Validate() const { return Table().Validate(*this, "limits."); }

absl::Status LimitSettings::LoadToml(const std::filesystem::path& file) {
  return LoadTomlTable(
      file, "limits",
      [](TomlTable& table, LimitSettings& settings) { Table().Read(table, settings); }, *this);
}

std::string LimitSettings::Describe() {
  return absl::StrCat("[limits]\n", Table().Describe(LimitSettings()));
}

}  // namespace saccade
