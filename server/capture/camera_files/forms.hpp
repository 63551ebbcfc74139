#pragma once

#include <absl/status/status.h>

#include <span>

#include "server/capture/camera_files/camera_draft.hpp"
#include "server/capture/camera_files/document.hpp"

namespace saccade {

/// One form in which people have cameras; one file NAME.cpp of this folder each.
struct CameraForm {
  absl::string_view name;  // "a Kalibr camchain"
  /// By what is in the file, whatever it is called.
  bool (*recognises)(const CameraDocument&);
  /// Fills in what the file tells, as far as it goes: on an error too, for the message shows it.
  /// InvalidArgument, with file, line, field and remedy.
  absl::Status (*read)(CameraDocument&, CameraDraft&);
};

CameraForm ColmapForm();      // cameras.txt
CameraForm EurocForm();       // sensor.yaml
CameraForm KalibrForm();      // camchain.yaml
CameraForm NativeForm();      // camera.yaml
CameraForm OpenCvForm();      // cv::FileStorage
CameraForm OrbSlamForm();     // settings of ORB-SLAM2 and 3
CameraForm RosMessageForm();  // sensor_msgs/CameraInfo as `topic echo` prints it
CameraForm RosYamlForm();     // camera_calibration_parsers

/// All of them, in the order in which they are asked; the last takes every file.
std::span<const CameraForm> CameraForms();

}  // namespace saccade
