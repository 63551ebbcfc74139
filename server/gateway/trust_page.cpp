#include "server/gateway/trust_page.hpp"

#include "absl/strings/str_replace.h"

namespace saccade {
namespace {

constexpr absl::string_view kPage = R"(<!doctype html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>Saccade: trust this server</title>
<h1>Trust this server</h1>
<p>This server has made its own certificate authority. A phone or computer that trusts it connects
without warnings, and only such a one may use its camera here. It can vouch for web servers only; its
key never leaves this server.</p>
<p><a href="$CRT">Download the certificate</a> (<a href="$PEM">as PEM</a>, for programs)</p>
<h2>Compare first</h2>
<p>Its SHA-256 fingerprint must be the one that the server's console shows, or <code>saccade trust
--fingerprint</code> on that machine:</p>
<p><code>$SHA256</code></p>
<p>If it differs, somebody stands between: do not install it.</p>
<h2>Android</h2>
<ol><li>Download it with the link above.
<li>Settings, <em>Security and privacy</em>, <em>More security settings</em>, <em>Encryption and
credentials</em>, <em>Install a certificate</em>, <em>CA certificate</em>.
<li><em>Install anyway</em>, then choose <code>saccade-root.crt</code>.</ol>
<h2>iPhone, iPad</h2>
<ol><li>Download it in Safari, and allow the profile.
<li>Settings, <em>Profile Downloaded</em>, <em>Install</em>.
<li>Settings, <em>General</em>, <em>About</em>, <em>Certificate Trust Settings</em>: switch it on. Without
this step nothing changes.</ol>
<h2>Computers</h2>
<ul><li>Chrome, Edge: Settings, <em>Privacy and security</em>, <em>Security</em>, <em>Manage
certificates</em>: import it as an authority for web sites.
<li>Firefox: Settings, <em>Privacy and Security</em>, <em>View Certificates</em>, <em>Authorities</em>,
<em>Import</em>.
<li>The command line: <code>saccade --trust saccade-root.pem ...</code></ul>
<p>Then open your invite link again. Remove the certificate when you no longer use this server.</p>
</html>
)";

}  // namespace

void AddTrustPage(const std::string& root_pem, const std::string& sha256, StaticFiles& files) {
  files.Put(kTrustPath,
            absl::StrReplaceAll(
                kPage, {{"$CRT", kRootForPhones}, {"$PEM", kRootForPrograms}, {"$SHA256", sha256}}),
            "text/html; charset=utf-8");
  files.Put(kRootForPhones, root_pem, "application/x-x509-ca-cert");
  files.Put(kRootForPrograms, root_pem, "application/x-pem-file");
}

}  // namespace saccade
