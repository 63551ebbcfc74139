#include "server/capture/source.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include "server/capture/dataset.hpp"
#include "server/capture/v4l2/v4l2_source.hpp"
#include "server/capture/video/video_source.hpp"

namespace saccade {

void SourceRegistry::Add(std::string scheme, Factory factory) {
  factories_[std::move(scheme)] = std::move(factory);
}

absl::StatusOr<std::unique_ptr<FrameSource>> SourceRegistry::Open(
    absl::string_view uri, const SourceOptions& options) const {
  std::vector<std::string> known;
  for (const auto& [scheme, factory] : factories_) known.push_back(scheme + ":");
  const std::size_t colon = uri.find(':');
  if (colon == absl::string_view::npos || colon == 0) {
    return absl::InvalidArgumentError(absl::StrCat("source '", uri, "' has no scheme; use one of ",
                                                   absl::StrJoin(known, ", "),
                                                   " such as dataset:DIR"));
  }
  const auto found = factories_.find(uri.substr(0, colon));
  if (found == factories_.end()) {
    return absl::UnimplementedError(
        absl::StrCat("source '", uri, "': scheme '", uri.substr(0, colon),
                     "' is not supported; this program has ", absl::StrJoin(known, ", ")));
  }
  return found->second(uri.substr(colon + 1), options);
}

SourceRegistry CaptureSources() {
  SourceRegistry registry;
  registry.Add("dataset", OpenDatasetUri);
  registry.Add("v4l2", [](absl::string_view rest, const SourceOptions& options) {
    return OpenV4l2(rest, options);
  });
  registry.Add("file", [](absl::string_view rest, const SourceOptions& options) {
    return OpenVideoFile(rest, options);
  });
  registry.Add("rtsp", [](absl::string_view rest, const SourceOptions& options) {
    return OpenRtsp(rest, options);
  });
  return registry;
}

absl::StatusOr<std::unique_ptr<FrameSource>> OpenSource(absl::string_view uri,
                                                        const SourceOptions& options) {
  return CaptureSources().Open(uri, options);
}

}  // namespace saccade
