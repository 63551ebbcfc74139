#include "server/capture/v4l2/v4l2_request.hpp"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "server/capture/uri_query.hpp"

namespace saccade {
namespace {

constexpr int kUsualWidth = 640, kUsualHeight = 480;
constexpr double kUsualFps = 30.0;
constexpr double kSameRate = 0.98;  // 29.97 is 30

void ReadSize(UriQuery& query, V4l2Request& request) {
  const std::optional<std::string> text = query.Text("size");
  if (!text) return;
  const std::vector<std::string> sides = absl::StrSplit(*text, 'x');
  int width = 0, height = 0;
  if (sides.size() != 2 || !absl::SimpleAtoi(sides[0], &width) ||
      !absl::SimpleAtoi(sides[1], &height) || width < 16 || height < 16 ||
      width > kMaxPictureSide_px || height > kMaxPictureSide_px) {
    return query.Fail("size", absl::StrCat("'", *text, "' is not a size such as 640x480"));
  }
  request.width = width;
  request.height = height;
}

void ReadFocus(UriQuery& query, V4l2Request& request) {
  const std::optional<std::string> text = query.Text("focus");
  if (!text) return;
  int focus = 0;
  if (*text == "auto") {
    request.auto_focus = true;
  } else if (absl::SimpleAtoi(*text, &focus)) {
    request.focus = focus;
  } else {
    query.Fail("focus", absl::StrCat("'", *text, "' is neither a whole number nor auto"));
  }
}

/// How far a mode is from what suits; smaller is better.
double Unfitness(const VideoMode& mode, const V4l2Request& request) {
  double bad = 0;
  if (!request.width && mode.width > 0) {
    bad += std::abs(std::log(1.0 * mode.width * mode.height / (kUsualWidth * kUsualHeight)));
  }
  const double target = request.fps.value_or(kUsualFps);
  if (!mode.fps.empty() && mode.fps.front() < kSameRate * target) {
    bad += 2.0 * std::log(target / std::max(0.1, mode.fps.front()));
  }
  if (mode.fourcc == V4L2_PIX_FMT_MJPEG || mode.fourcc == V4L2_PIX_FMT_JPEG) bad += 0.05;
  if (mode.fourcc == V4L2_PIX_FMT_GREY) bad += 0.2;  // people like colour
  return bad;
}

bool GivesRate(const VideoMode& mode, double fps) {
  return mode.fps.empty() || mode.fps.front() >= kSameRate * fps;
}

/// A range of sizes, narrowed to the one that is wanted.
VideoMode Narrowed(VideoMode mode, const V4l2Request& request) {
  if (mode.width == 0 || (mode.most_width == mode.width && mode.most_height == mode.height)) {
    if (mode.width == 0 && request.width)
      mode.width = *request.width, mode.height = *request.height;
    return mode;
  }
  const int width = request.width.value_or(kUsualWidth);
  const int height = request.height.value_or(kUsualHeight);
  const bool takes = mode.Takes(width, height);
  if (!takes) {
    mode.most_width = mode.width;
    mode.most_height = mode.height;
    return mode;
  }
  mode.width = mode.most_width = width;
  mode.height = mode.most_height = height;
  return mode;
}

}  // namespace

absl::StatusOr<V4l2Request> V4l2Request::Parse(absl::string_view rest) {
  UriQuery query("v4l2:", rest);
  V4l2Request request;
  request.device = query.path();
  if (request.device.empty()) {
    return absl::InvalidArgumentError(
        "source v4l2:: names no device; write for example v4l2:/dev/video0");
  }
  ReadSize(query, request);
  request.fps = query.Number("fps", 1, 1000);
  if (const auto name = query.Text("format")) {
    request.format = FindVideoFormat(*name);
    if (request.format == nullptr) {
      query.Fail("format", absl::StrCat("'", *name, "': give mjpeg, yuyv, nv12 or grey"));
    }
  }
  if (const auto text = query.Text("exposure"); text && *text != "auto") {
    double ms = 0;
    if (!absl::SimpleAtod(*text, &ms) || !(ms >= 0.01 && ms <= 1000)) {
      query.Fail("exposure", absl::StrCat("'", *text, "' is neither 0.01 to 1000 ms nor auto"));
    }
    request.exposure_ms = ms;
  }
  if (const auto gain = query.Number("gain", -1e6, 1e6)) request.gain = static_cast<int>(*gain);
  ReadFocus(query, request);
  request.turn = ReadTurn(query);
  const absl::Status status =
      query.Finish("size, fps, format, exposure, gain, focus, rotate and mirror");
  if (!status.ok()) return status;
  return request;
}

absl::StatusOr<VideoMode> ChooseMode(const VideoDeviceFacts& device, const V4l2Request& request) {
  const VideoMode* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  std::string wanted;
  std::vector<VideoMode> modes;
  for (const VideoMode& mode : device.modes) modes.push_back(Narrowed(mode, request));
  for (const VideoMode& mode : modes) {
    if (!mode.Readable()) continue;
    if (request.format != nullptr && FormatName(mode.fourcc) != request.format->name) continue;
    if (request.width && !mode.Takes(*request.width, *request.height)) continue;
    if (request.fps && !GivesRate(mode, *request.fps)) continue;
    const double bad = Unfitness(mode, request);
    if (bad >= least) continue;
    least = bad;
    best = &mode;
  }
  if (best != nullptr) return *best;
  if (request.format != nullptr) absl::StrAppend(&wanted, " ", request.format->name);
  if (request.width) absl::StrAppend(&wanted, " ", *request.width, "x", *request.height);
  if (request.fps) absl::StrAppend(&wanted, " at ", *request.fps, " fps");
  return absl::InvalidArgumentError(absl::StrCat(device.path, " (", device.name, ") does not have",
                                                 wanted, "; it has ", ModeWords(device.modes)));
}

}  // namespace saccade
