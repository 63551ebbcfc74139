// ROS: sensor_msgs/CameraInfo as `rostopic echo` (K, D) and `ros2 topic echo` (k, d) print it, and
// the YAML of camera_calibration_parsers (camera_matrix, distortion_model).
#include <absl/strings/str_cat.h>

#include "server/capture/camera_files/fields.hpp"
#include "server/capture/camera_files/forms.hpp"

namespace saccade {
namespace {

bool IsMessage(const CameraDocument& document) {
  const YamlReader& yaml = document.yaml;
  return yaml.Has("distortion_model") && (yaml.IsList("K") || yaml.IsList("k"));
}

bool IsYaml(const CameraDocument& document) {
  const YamlReader& yaml = document.yaml;
  return yaml.Has("distortion_model") && yaml.IsMap("camera_matrix");
}

/// A picture that is a part of the sensor's, or every second pixel of it, has other numbers.
void RefuseCropping(YamlReader& yaml) {
  for (const char* key : {"binning_x", "binning_y"}) {
    if (yaml.Has(key) && yaml.Number(key, {0, 1e3}) > 1.0) {
      yaml.Fail(key,
                "the picture is binned, and the numbers are of the whole one; divide width, "
                "height, fx, fy, cx, cy by it and write 0 here");
    }
  }
  if (!yaml.ok() || !yaml.IsMap("roi")) return;
  YamlReader roi = yaml.Map("roi");
  for (const char* key : {"x_offset", "y_offset"}) {
    if (roi.Has(key) && roi.Number(key, {0, 1e6}) > 0.0) {
      roi.Fail(key,
               "the picture is a part of the sensor's; take the offset off cx or cy, write "
               "the part's size as width and height, and 0 here");
    }
  }
  yaml.Merge(roi);
}

void TakeSize(YamlReader& yaml, const std::string& width, const std::string& height,
              CameraDraft& draft) {
  draft.lens.width = static_cast<int>(TakeNumber(yaml, width, "", "width", draft));
  draft.lens.height = static_cast<int>(TakeNumber(yaml, height, "", "height", draft));
}

absl::Status ReadMessage(CameraDocument& document, CameraDraft& draft) {
  YamlReader& yaml = document.yaml;
  TakeSize(yaml, "width", "height", draft);
  const std::string k = FirstOf(yaml, {"K", "k"}), d = FirstOf(yaml, {"D", "d"});
  const std::vector<double> matrix = yaml.Numbers(k, std::nullopt);
  TakeMatrix(yaml, k, "", matrix, draft);
  const std::string lens = yaml.Text("distortion_model");
  const std::vector<double> coefficients = yaml.Numbers(d, std::nullopt, true);
  TakeLens(yaml, "distortion_model", lens, d, "", coefficients, draft);
  RefuseCropping(yaml);
  return yaml.status();
}

absl::Status ReadYaml(CameraDocument& document, CameraDraft& draft) {
  YamlReader& yaml = document.yaml;
  TakeSize(yaml, "image_width", "image_height", draft);
  YamlReader matrix = yaml.Map("camera_matrix");
  TakeMatrix(matrix, "data", "camera_matrix.", matrix.Numbers("data", std::nullopt), draft);
  yaml.Merge(matrix);
  const std::string lens = yaml.Text("distortion_model");
  YamlReader distortion = yaml.Map("distortion_coefficients");
  const std::vector<double> coefficients = distortion.Numbers("data", std::nullopt, true);
  yaml.Merge(distortion);
  TakeLens(yaml, "distortion_model", lens, "distortion_coefficients", "", coefficients, draft);
  return yaml.status();
}

}  // namespace

CameraForm RosMessageForm() { return {"a ROS camera_info message", IsMessage, ReadMessage}; }
CameraForm RosYamlForm() { return {"a ROS calibration", IsYaml, ReadYaml}; }

}  // namespace saccade
