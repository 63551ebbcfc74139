#include "client/app/address.hpp"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

namespace saccade::app {

absl::StatusOr<Address> ParseLink(const std::string& link, int grpc_port) {
  const auto bad = [](absl::string_view why) {
    return absl::InvalidArgumentError(
        absl::StrCat("the link ", why,
                     "; it looks like https://HOST:8080/#invite=... or "
                     "saccade://HOST:50051/#invite=..."));
  };
  absl::string_view rest = link;
  Address address;
  const bool own = absl::ConsumePrefix(&rest, "saccade://");
  if (!own) {
    address.plain = absl::ConsumePrefix(&rest, "http://");
    if (!address.plain && !absl::ConsumePrefix(&rest, "https://")) {
      return bad("begins with neither https:// nor saccade://");
    }
  }
  const absl::string_view authority = rest.substr(0, rest.find_first_of("/#?"));
  const auto bracket = authority.rfind(']');
  const auto colon = authority.rfind(':');
  const bool has_port =
      colon != absl::string_view::npos && (bracket == absl::string_view::npos || colon > bracket);
  const absl::string_view host = has_port ? authority.substr(0, colon) : authority;
  if (host.empty() || absl::StrContains(host, "@")) return bad("names no host");
  int port = grpc_port;
  int named = 0;
  if (has_port &&
      (!absl::SimpleAtoi(authority.substr(colon + 1), &named) || named < 1 || named > 65535)) {
    return bad("has a port that is none");
  }
  if (own && has_port) port = named;
  address.server = absl::StrCat(host, ":", port);
  const auto mark = rest.find("#invite=");
  if (mark != absl::string_view::npos) {
    address.invite = std::string(rest.substr(mark + 8));
    if (address.invite.empty()) return bad("has an empty invite");
  } else if (!own) {
    return bad("has no #invite=");
  }
  return address;
}

}  // namespace saccade::app
