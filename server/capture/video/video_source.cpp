#include "server/capture/video/video_source.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <utility>

#include "server/capture/assumed_lens.hpp"
#include "server/capture/camera_file.hpp"
#include "server/capture/image_list.hpp"
#include "server/capture/uri_query.hpp"
#include "server/capture/video/decoded_source.hpp"
#include "shared/io/log.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

/// As people are told it: every viewer reads the source's name, so without user and password.
std::string WithoutUser(std::string uri) {
  const std::size_t begin = uri.find("//");
  if (begin == std::string::npos) return uri;
  const std::size_t end = uri.find('/', begin + 2);
  const std::size_t at = uri.rfind('@', end);
  if (at == std::string::npos || at < begin) return uri;
  return uri.erase(begin + 2, at + 1 - (begin + 2));
}

absl::StatusOr<std::unique_ptr<VideoSource>> Open(VideoRequest request, std::string uri,
                                                  const SourceOptions& options) {
  if (options.fps) {
    return absl::InvalidArgumentError(
        absl::StrCat("source ", uri, ": fps: a video has times of its own; leave it out"));
  }
  request.first = options.first_frame;
  request.end = options.end_frame;
  absl::StatusOr<OpenedDecoder> decoder = OpenDecoder(request.input, -1, [] { return false; });
  if (!decoder.ok()) {
    return absl::Status(decoder.status().code(),
                        absl::StrCat("source ", uri, ": ", decoder.status().message()));
  }
  if (request.turn_by_file) {
    request.turn.clockwise_deg = static_cast<int>(decoder->info.clockwise_deg % 360);
  }
  cv::Size size(static_cast<int>(decoder->info.width), static_cast<int>(decoder->info.height));
  if (request.turn.swaps_sides()) std::swap(size.width, size.height);
  SourceInfo info;
  info.uri = std::move(uri);
  CameraIntrinsics lens = AssumedLens(size, request.turn.swaps_sides(), decoder->info.fps);
  if (options.camera_file.empty()) {
    info.remark = AssumedLensWords();
    info.lens_assumed = true;
    Log(absl::StrCat("source ", info.uri, ": ", AssumedLensWords()));
  } else {
    const absl::StatusOr<CameraIntrinsics> read =
        LoadCamera(options.camera_file, [&] { return std::optional(size); });
    if (!read.ok()) return read.status();
    if (read->width != size.width || read->height != size.height) {
      return absl::InvalidArgumentError(
          absl::StrCat(options.camera_file.string(), ": is of pictures of ", read->width, "x",
                       read->height, ", and those of ", info.uri, " are ", size.width, "x",
                       size.height, "; give the file of that size"));
    }
    lens = *read;
  }
  info.camera = std::make_shared<const CameraModel>(lens);
  Log(absl::StrFormat("source %s: %s %dx%d at %.4g fps", info.uri, decoder->codec,
                      decoder->info.width, decoder->info.height, lens.fps));
  return std::make_unique<DecodedSource>(std::move(request), std::move(info), *std::move(decoder));
}

}  // namespace

absl::StatusOr<std::unique_ptr<VideoSource>> OpenVideoFile(absl::string_view rest,
                                                           const SourceOptions& options) {
  VideoRequest request;
  request.pace = options.realtime ? Pace::kDue : Pace::kEvery;
  request.input.file = std::filesystem::path(std::string(rest));
  if (rest.find('?') != absl::string_view::npos && !MayExist(request.input.file)) {
    UriQuery query("file:", rest);
    request.input.file = query.path();
    if (const auto start = query.Text("start")) {
      const absl::StatusOr<Timestamp> time = ParseSeconds(*start);
      if (!time.ok()) query.Fail("start", time.status().message());
      if (time.ok()) request.start_ns = *time;
    }
    request.turn_by_file = !query.Has("rotate");
    request.turn = ReadTurn(query);
    const absl::Status status = query.Finish("start, rotate and mirror");
    if (!status.ok()) return status;
  }
  if (request.input.file.empty()) {
    return absl::InvalidArgumentError(
        "source file:: names no video; write for example file:walk.mp4");
  }
  return Open(std::move(request), absl::StrCat("file:", rest), options);
}

absl::StatusOr<std::unique_ptr<VideoSource>> OpenRtsp(absl::string_view rest,
                                                      const SourceOptions& options) {
  const std::string uri = absl::StrCat("rtsp:", rest);
  if (rest.size() < 3 || rest.substr(0, 2) != "//") {
    return absl::InvalidArgumentError(
        absl::StrCat("source ", uri, ": write it as rtsp://HOST[:PORT]/PATH"));
  }
  if (!options.realtime || options.first_frame > 0 || options.end_frame) {
    return absl::InvalidArgumentError(absl::StrCat(
        "source ", uri,
        ": a stream waits for nobody and has no range of frames; leave --speed max and --frames "
        "out"));
  }
  VideoRequest request;
  request.pace = Pace::kNewest;
  request.input.url = uri;
  return Open(std::move(request), WithoutUser(uri), options);
}

}  // namespace saccade
