#include "server/gateway/static_files.hpp"

#include <zlib.h>

#include <array>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace saccade {
namespace {

constexpr std::size_t kMaxTotalBytes = 64 * 1024 * 1024;

constexpr absl::string_view kNotBuilt = R"(<!doctype html>
<html lang="en"><meta charset="utf-8"><title>Saccade</title>
<h1>The web page is not built</h1>
<p>Run <code>npm ci &amp;&amp; npm run build</code> in <code>web/</code>, then start saccade-server again.
The gRPC service is running.</p></html>
)";

constexpr std::array<std::pair<absl::string_view, absl::string_view>, 12> kTypes = {{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".mjs", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".json", "application/json"},
    {".map", "application/json"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".ico", "image/x-icon"},
    {".woff2", "font/woff2"},
    {".wasm", "application/wasm"},
    {".txt", "text/plain; charset=utf-8"},
}};

absl::string_view ContentTypeOfFile(absl::string_view extension) {
  for (const auto& [known, type] : kTypes) {
    if (known == extension) return type;
  }
  return "application/octet-stream";
}

bool Compressible(absl::string_view type) {
  return absl::StartsWith(type, "text/") || absl::StartsWith(type, "application/json") ||
         type == "image/svg+xml" || type == "application/wasm";
}

// gzip, or nothing where that gains little.
std::string Gzip(const std::string& body) {
  z_stream stream{};
  if (deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 9, Z_DEFAULT_STRATEGY) != Z_OK) return {};
  std::string out(deflateBound(&stream, body.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(body.data()));
  stream.avail_in = static_cast<uInt>(body.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const bool done = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return done && out.size() + 256 < body.size() ? out : std::string();
}

StaticFile MakeFile(std::string body, absl::string_view extension, bool immutable) {
  StaticFile file;
  file.content_type = std::string(ContentTypeOfFile(extension));
  file.cache_control = immutable ? "public, max-age=31536000, immutable" : "no-cache";
  const auto* bytes = reinterpret_cast<const Bytef*>(body.data());
  const auto size = static_cast<uInt>(body.size());
  file.etag = absl::StrFormat("\"%x-%08x%08x\"", body.size(), crc32(0, bytes, size),
                              adler32(1, bytes, size));
  if (Compressible(file.content_type)) file.gzip_body = Gzip(body);
  file.body = std::move(body);
  return file;
}

}  // namespace

absl::StatusOr<StaticFiles> StaticFiles::Load(const std::filesystem::path& root) {
  StaticFiles files;
  std::size_t total = 0;
  std::error_code error;
  std::filesystem::recursive_directory_iterator it(root, error);
  for (; !error && it != std::filesystem::recursive_directory_iterator(); it.increment(error)) {
    std::error_code ignored;
    if (it->is_symlink(ignored) || !it->is_regular_file(ignored)) continue;
    std::ifstream in(it->path(), std::ios::binary);
    std::string body((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    if (!in) return absl::UnavailableError(absl::StrCat("cannot read ", it->path().string()));
    total += body.size();
    if (total > kMaxTotalBytes) {
      return absl::ResourceExhaustedError(
          absl::StrCat(root.string(), ": more than 64 MB; is this the built page (web/dist)?"));
    }
    const std::string name = "/" + it->path().lexically_relative(root).generic_string();
    const bool immutable = absl::StartsWith(name, "/assets/");
    files.files_[name] = MakeFile(std::move(body), it->path().extension().string(), immutable);
  }
  if (!files.files_.contains("/index.html")) {
    files.files_["/index.html"] = MakeFile(std::string(kNotBuilt), ".html", false);
  }
  return files;
}

void StaticFiles::Put(const std::string& path, std::string body, absl::string_view content_type) {
  StaticFile file = MakeFile(std::move(body), "", /*immutable=*/false);
  file.content_type = std::string(content_type);
  if (const auto before = files_.find(path); before != files_.end()) {
    replaced_.push_back(std::move(before->second));  // its buffers stay where they are
  }
  files_[path] = std::move(file);
}

const StaticFile* StaticFiles::Find(absl::string_view target) const {
  std::string path(target.substr(0, target.find_first_of("?#")));
  if (path == "/") path = "/index.html";
  auto it = files_.find(path);
  // A page without its ending: /wearer.
  if (it == files_.end() && path.find('.') == std::string::npos) {
    it = files_.find(absl::StrCat(path, ".html"));
  }
  return it == files_.end() ? nullptr : &it->second;
}

}  // namespace saccade
