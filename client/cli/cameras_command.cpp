#include "client/cli/cameras_command.hpp"

#include <absl/strings/str_cat.h>

#include <iostream>
#include <vector>

#include "client/cli/text.hpp"

namespace saccade::cli {
namespace {

using nlohmann::json;

json ModeJson(const VideoMode& mode) {
  json out = {{"format", FormatName(mode.fourcc)},
              {"width", mode.width},
              {"height", mode.height},
              {"fps", mode.fps},
              {"readable", mode.Readable()}};
  if (mode.most_width > mode.width || mode.most_height > mode.height) {
    out["most_width"] = mode.most_width;
    out["most_height"] = mode.most_height;
  }
  return out;
}

}  // namespace

std::string CamerasText(const std::vector<ListedVideoDevice>& devices) {
  if (devices.empty()) {
    return "no camera is there: no /dev/video*; plug one in, or load its driver "
           "(in a container, pass the device in)\n";
  }
  std::string text;
  for (const ListedVideoDevice& device : devices) {
    if (!device.problem.empty()) {
      absl::StrAppend(&text, device.problem, "\n");
      continue;
    }
    const VideoDeviceFacts& facts = device.facts;
    absl::StrAppend(&text, facts.path, "  ", facts.name, " (", facts.driver, ", ", facts.bus,
                    ")\n");
    for (const VideoMode& mode : facts.modes) {
      absl::StrAppend(&text, "  ", ModeWords(mode), mode.Readable() ? "" : "  (not read)", "\n");
    }
    absl::StrAppend(&text, "  use it: saccade-server --source v4l2:", facts.path, "\n");
  }
  return text;
}

json CamerasJson(const std::vector<ListedVideoDevice>& devices) {
  json list = json::array();
  for (const ListedVideoDevice& device : devices) {
    const VideoDeviceFacts& facts = device.facts;
    json camera = {{"device", facts.path}};
    if (!device.problem.empty()) {
      camera["problem"] = device.problem;
    } else {
      camera.update({{"name", facts.name}, {"driver", facts.driver}, {"bus", facts.bus}});
      camera["modes"] = json::array();
      for (const VideoMode& mode : facts.modes) camera["modes"].push_back(ModeJson(mode));
    }
    list.push_back(std::move(camera));
  }
  return {{"cameras", std::move(list)}};
}

absl::Status RunCameras(const Options& options) {
  const std::vector<ListedVideoDevice> devices = ListVideoDevices();
  std::cout << (options.json ? Dump(CamerasJson(devices)) + "\n" : CamerasText(devices));
  return absl::OkStatus();
}

}  // namespace saccade::cli
