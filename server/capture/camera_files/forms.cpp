#include "server/capture/camera_files/forms.hpp"

#include <array>

namespace saccade {

std::span<const CameraForm> CameraForms() {
  // camera.yaml comes last: a file that nobody knows is told what camera.yaml needs.
  static const std::array kForms = {ColmapForm(),     OrbSlamForm(), KalibrForm(), EurocForm(),
                                    RosMessageForm(), RosYamlForm(), OpenCvForm(), NativeForm()};
  return kForms;
}

}  // namespace saccade
