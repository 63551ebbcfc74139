#include "server/app/oidc_settings.hpp"

#include <absl/strings/str_cat.h>

#include "shared/io/toml_file.hpp"

namespace saccade {
namespace {

absl::Status Bad(const std::filesystem::path& file, absl::string_view key, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(file.string(), ": oidc.", key, ": ", what));
}

/// kAnyone: it is no role that can be given.
AccessRole GivenRole(const std::string& word) {
  const AccessRole role = AccessRoleOf(word);
  return role <= AccessRole::kWearer ? role : AccessRole::kAnyone;
}

constexpr char kGive[] = "; give viewer, annotator, pilot or wearer";

absl::Status Read(const std::filesystem::path& file, const toml::value& table,
                  IdentityProviderOptions& options) {
  for (const auto& [key, value] : table.as_table()) {
    if (key == "audiences") {
      for (const toml::value& one : value.as_array()) {
        options.audiences.push_back(one.as_string().str);
      }
    } else if (key == "roles") {
      for (const auto& [name, word] : value.as_table()) {
        const AccessRole role = GivenRole(word.as_string().str);
        if (role == AccessRole::kAnyone) {
          return Bad(file, absl::StrCat("roles.", name),
                     absl::StrCat("'", word.as_string().str, "'", kGive));
        }
        options.roles[name] = role;
      }
    } else if (key == "other_role") {
      const std::string& word = value.as_string().str;
      options.other_role = word.empty() ? AccessRole::kAnyone : GivenRole(word);
      if (!word.empty() && options.other_role == AccessRole::kAnyone) {
        return Bad(file, key, absl::StrCat("'", word, "'", kGive, ", or nothing"));
      }
    } else if (key == "issuer") {
      options.issuer = value.as_string().str;
    } else if (key == "client_id") {
      options.client_id = value.as_string().str;
    } else if (key == "name") {
      options.name = value.as_string().str;
    } else if (key == "scope") {
      options.scope = value.as_string().str;
    } else if (key == "role_claim") {
      options.role_claim = value.as_string().str;
    } else if (key == "ca") {
      options.ca_file = value.as_string().str;
    } else {
      return absl::InvalidArgumentError(absl::StrCat(file.string(), ": unknown key oidc.", key));
    }
  }
  std::error_code ignored;
  if (!options.ca_file.empty() && !std::filesystem::is_regular_file(options.ca_file, ignored)) {
    return Bad(file, "ca", absl::StrCat("there is no file ", options.ca_file.string()));
  }
  const absl::Status valid = options.Validate();
  if (valid.ok()) return valid;
  return absl::InvalidArgumentError(absl::StrCat(file.string(), ": ", valid.message()));
}

}  // namespace

absl::StatusOr<std::optional<IdentityProviderOptions>> LoadOidc(const std::filesystem::path& file) {
  const absl::StatusOr<toml::value> root = ParseTomlFile(file);
  if (!root.ok()) return root.status();
  try {
    if (!root->contains("oidc")) return std::nullopt;
    IdentityProviderOptions options;
    const absl::Status read = Read(file, toml::find(*root, "oidc"), options);
    if (!read.ok()) return read;
    return options;
  } catch (const std::exception& error) {  // of another type
    return absl::InvalidArgumentError(absl::StrCat(file.string(), ": oidc: ", error.what()));
  }
}

std::string DescribeOidc() {
  return R"(# [oidc]                                     # people sign in with their firm: security.md
# issuer = "https://login.firm.example"      # must be given, to the letter as the provider has it
# client_id = "saccade"                      # must be given: a public client (no secret, PKCE)
# name = "your firm"                         # on the button
# audiences = []                             # of machines' tokens, besides client_id
# scope = "openid profile email"             # what is asked for; openid has to be in it
# role_claim = "groups"                      # of the ID token; "realm_access.roles": one in another
# other_role = ""                            # of who has none of [oidc.roles]; empty: is not let in
# ca = ""                                    # PEM of whom to trust; empty: the system's store
# [oidc.roles]                               # by a value of the claim: "engineers" = "pilot"
)";
}

}  // namespace saccade
