#include "server/rpc/annotation_pages.hpp"

#include <absl/status/statusor.h>
#include <absl/strings/escaping.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "server/rpc/deltas.hpp"
#include "shared/wire/to_proto.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxTokenBytes = 256;

// The last annotation of a page, by what orders them.
std::string TokenAfter(const Annotation& last) {
  return absl::WebSafeBase64Escape(absl::StrCat("1 ", last.created_unix_ns, " ", last.id));
}

absl::StatusOr<Annotation> FromToken(const std::string& token) {
  std::string text;
  Annotation last;
  if (token.size() <= kMaxTokenBytes && absl::WebSafeBase64Unescape(token, &text)) {
    const std::vector<std::string> words = absl::StrSplit(text, absl::MaxSplits(' ', 2));
    if (words.size() == 3 && words[0] == "1" && absl::SimpleAtoi(words[1], &last.created_unix_ns)) {
      last.id = words[2];
      return last;
    }
  }
  return absl::InvalidArgumentError(
      "page_token: is not the next_page_token of an answer; begin again without one");
}

}  // namespace

absl::Status ListPage(const AnnotationList& annotations, const v1::ListAnnotationsRequest& request,
                      v1::ListAnnotationsResponse& response) {
  auto at = annotations.begin();
  if (!request.page_token().empty()) {
    const absl::StatusOr<Annotation> last = FromToken(request.page_token());
    if (!last.ok()) return last.status();
    at = std::upper_bound(annotations.begin(), annotations.end(), *last, CreatedBefore);
  }
  const std::size_t most = request.page_size() == 0 ? annotations.size() : request.page_size();
  std::size_t count = 0;
  for (std::size_t bytes = 0; at != annotations.end() && count < most; ++at, ++count) {
    bytes += EncodedBytes(*at);
    if (bytes > kPageBytes && count > 0) break;
    *response.add_annotations() = wire::ToProto(*at);
  }
  if (at != annotations.end()) response.set_next_page_token(TokenAfter(*(at - 1)));
  return absl::OkStatus();
}

}  // namespace saccade
