// OpenCV's FileStorage, YAML or XML: camera_matrix and distortion_coefficients, as the samples of
// OpenCV and many programs after them write it.
#include <absl/strings/str_cat.h>

#include "server/capture/camera_files/fields.hpp"
#include "server/capture/camera_files/forms.hpp"

namespace saccade {
namespace {

std::string MatrixKey(const YamlReader& yaml) {
  return FirstOf(yaml, {"camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "K",
                        "camera_matrix1", "cameraMatrix1", "M1", "K1"});
}
std::string DistortionKey(const YamlReader& yaml) {
  return FirstOf(yaml, {"distortion_coefficients", "Distortion_Coefficients", "dist_coeffs",
                        "distCoeffs", "dist_coefs", "DistCoeffs", "D", "distCoeffs1", "D1"});
}

bool RecognisesOpencv(const CameraDocument& document) {
  return document.yaml.IsMap(MatrixKey(document.yaml));
}

/// The numbers of a matrix, row by row.
std::vector<double> Matrix(YamlReader& yaml, const std::string& key) {
  YamlReader matrix = yaml.Map(key);
  const int rows = matrix.Integer("rows", 0, 1000), columns = matrix.Integer("cols", 0, 1000);
  const std::vector<double> data = matrix.Numbers("data", std::nullopt, rows * columns == 0);
  if (matrix.ok() && std::ssize(data) != std::ptrdiff_t{rows} * columns) {
    matrix.Fail("data", absl::StrCat("has ", data.size(), " numbers, but rows and cols say ",
                                     rows * columns));
  }
  yaml.Merge(matrix);
  return data;
}

bool IsFisheye(YamlReader& yaml) {
  for (const char* key : {"fisheye_model", "fisheye", "is_fisheye"}) {
    if (yaml.Has(key)) {
      const std::string value = yaml.Text(key);
      return value == "1" || value == "true";
    }
  }
  return yaml.Has("distortion_model") && yaml.Text("distortion_model") == "fisheye";
}

absl::Status ReadOpencv(CameraDocument& document, CameraDraft& draft) {
  YamlReader& yaml = document.yaml;
  const std::string width = FirstOf(yaml, {"image_width", "image_Width", "Image_Width", "width"});
  const std::string height =
      FirstOf(yaml, {"image_height", "image_Height", "Image_Height", "height"});
  if (yaml.Has(width) || yaml.Has(height)) {
    draft.lens.width = static_cast<int>(TakeNumber(yaml, width, "", "width", draft));
    draft.lens.height = static_cast<int>(TakeNumber(yaml, height, "", "height", draft));
  }
  const std::string matrix = MatrixKey(yaml), distortion = DistortionKey(yaml);
  TakeMatrix(yaml, matrix, "", Matrix(yaml, matrix), draft);
  const std::vector<double> coefficients = Matrix(yaml, distortion);
  if (IsFisheye(yaml)) {
    TakeLens(yaml, distortion, "fisheye", distortion, "", coefficients, draft);
  } else {
    TakeOpenCvLens(yaml, distortion, "", coefficients, draft);
  }
  return yaml.status();
}

}  // namespace

CameraForm OpenCvForm() { return {"an OpenCV calibration", RecognisesOpencv, ReadOpencv}; }

}  // namespace saccade
