// Camera files of other programs: the forms of their public examples, rewritten by hand.
#include <gmock/gmock.h>

#include <opencv2/core.hpp>

#include "server/capture/camera_file.hpp"
#include "server/capture/camera_files/camera_draft.hpp"
#include "server/capture/camera_text.hpp"
#include "server/capture/dataset.hpp"
#include "tests/unit/server/capture/dataset_fixture.hpp"

namespace saccade::camera_forms_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class CameraForms : public DatasetFixture {
 protected:
  /// Of a file whose name says nothing.
  absl::StatusOr<CameraIntrinsics> Read(const std::string& text, const std::string& camera = "",
                                        const PictureSize& size = nullptr) const {
    Write("file.txt", text);
    return LoadCamera((folder_ / "file.txt").string() + camera, size);
  }
  std::string Error(const std::string& text, const std::string& camera = "") const {
    return std::string(Read(text, camera).status().message());
  }
  static std::string Replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
  }
  static void Expect(const absl::StatusOr<CameraIntrinsics>& read, LensModel model, int width,
                     int height, std::array<double, 4> pinhole, std::array<double, 5> distortion) {
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->model, model);
    EXPECT_EQ(read->width, width);
    EXPECT_EQ(read->height, height);
    EXPECT_EQ((std::array<double, 4>{read->fx, read->fy, read->cx, read->cy}), pinhole);
    EXPECT_EQ(read->distortion, distortion);
  }
};

const char kKalibr[] = R"(cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28368, 0.07451, -0.000104, -3.555e-05]
  distortion_model: radtan
  intrinsics: [458.72, 457.3, 367.22, 248.37]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.99999, 0.0023, 0.0004, -0.1101]
  - [-0.0023, 0.9999, 0.0141, 0.0004]
  - [-0.0003, -0.0141, 0.9999, -0.0009]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [-0.0133, -0.0024, 0.0021, -0.0012]
  distortion_model: equidistant
  intrinsics: [461.16, 459.75, 362.68, 246.1]
  resolution: [752, 480]
  rostopic: /cam1/image_raw
)";

TEST_F(CameraForms, KalibrCamchainByNumberAndByName) {
  const std::array<double, 4> first = {458.72, 457.3, 367.22, 248.37};
  Expect(Read(kKalibr), LensModel::kBrownConrady, 752, 480, first,
         {-0.28368, 0.07451, -0.000104, -3.555e-05, 0});
  Expect(Read(kKalibr, "#cam0"), LensModel::kBrownConrady, 752, 480, first,
         {-0.28368, 0.07451, -0.000104, -3.555e-05, 0});
  Expect(Read(kKalibr, "#cam1"), LensModel::kKannalaBrandt, 752, 480,
         {461.16, 459.75, 362.68, 246.1}, {-0.0133, -0.0024, 0.0021, -0.0012, 0});
  EXPECT_THAT(Error(kKalibr, "#cam7"), AllOf(HasSubstr("cam7"), HasSubstr("has cam0, cam1")));
}

TEST_F(CameraForms, KalibrFovAndNoneAndOmniWhereItIsAPinhole) {
  const std::string fov = Replaced(
      Replaced(kKalibr, "[-0.28368, 0.07451, -0.000104, -3.555e-05]", "[0.9213]"), "radtan", "fov");
  Expect(Read(fov), LensModel::kFov, 752, 480, {458.72, 457.3, 367.22, 248.37},
         {0.9213, 0, 0, 0, 0});
  const std::string none = Replaced(
      Replaced(kKalibr, "[-0.28368, 0.07451, -0.000104, -3.555e-05]", "[]"), "radtan", "none");
  Expect(Read(none), LensModel::kPinhole, 752, 480, {458.72, 457.3, 367.22, 248.37}, {});
  const std::string omni =
      Replaced(Replaced(kKalibr, "camera_model: pinhole", "camera_model: omni"), "[458.72,",
               "[0.0, 458.72,");
  Expect(Read(omni), LensModel::kBrownConrady, 752, 480, {458.72, 457.3, 367.22, 248.37},
         {-0.28368, 0.07451, -0.000104, -3.555e-05, 0});
}

TEST_F(CameraForms, WhatCannotBeHeldIsRefusedByLineWithTheWholeConversion) {
  const std::string omni =
      Replaced(Replaced(kKalibr, "camera_model: pinhole", "camera_model: omni"), "[458.72,",
               "[1.1, 458.72,");
  EXPECT_THAT(Error(omni), AllOf(HasSubstr("file.txt:3: cam0.camera_model: omni with xi = 1.1"),
                                 HasSubstr("pinhole-equi"), HasSubstr("Kalibr camchain"),
                                 HasSubstr("{model: ?, width: 752, height: 480, ")));
  EXPECT_THAT(Error(Replaced(kKalibr, "camera_model: pinhole", "camera_model: ds")),
              AllOf(HasSubstr("file.txt:3: cam0.camera_model: 'ds'"), HasSubstr("pinhole-equi")));
  EXPECT_THAT(Error(Replaced(kKalibr, "[752, 480]", "[752]")),
              HasSubstr("file.txt:7: cam0.resolution: has 1 numbers; give 2"));
  EXPECT_THAT(Error(Replaced(kKalibr, "-0.000104, -3.555e-05]", "-0.000104]")),
              AllOf(HasSubstr("file.txt:4: cam0.distortion_coeffs: has 3 coefficients"),
                    HasSubstr("[k1, k2, p1, p2, k3]"), HasSubstr("fx: 458.72, fy: 457.3")));
  // Implausible: the file's own word and line, and everything that was read.
  EXPECT_THAT(
      Error(Replaced(kKalibr, "[458.72, 457.3,", "[4.2, 4.2,")),
      AllOf(HasSubstr("file.txt:6: cam0.intrinsics[0]: 4.2 px"), HasSubstr("millimetres"),
            HasSubstr("{model: brown_conrady, width: 752, height: 480, fx: 4.2, fy: 4.2, cx: "
                      "367.22, cy: 248.37, distortion: [-0.28368, 0.07451, -0.000104, "
                      "-3.555e-05, 0], fps: 30}")));
}

TEST_F(CameraForms, TheConversionThatIsShownIsACameraFileOfTheSameCamera) {
  for (const LensModel model : {LensModel::kPinhole, LensModel::kBrownConrady,
                                LensModel::kKannalaBrandt, LensModel::kFov}) {
    CameraIntrinsics lens{.model = model,
                          .width = 640,
                          .height = 480,
                          .fx = 517.306408,
                          .fy = 516.469215,
                          .cx = 318.643040,
                          .cy = 255.313989,
                          .fps = 29.97,
                          .rolling_shutter_readout_s = 0.018};
    if (model != LensModel::kPinhole) lens.distortion[0] = 0.01234567891;
    const auto again = Read(CameraLine(lens));
    Expect(again, model, 640, 480, {517.306408, 516.469215, 318.643040, 255.313989},
           lens.distortion);
    EXPECT_EQ(again->fps, 29.97);
    EXPECT_EQ(again->rolling_shutter_readout_s, 0.018);
  }
}

const char kRosYaml[] = R"(image_width: 640
image_height: 480
camera_name: head_camera
camera_matrix:
  rows: 3
  cols: 3
  data: [438.783367, 0.000000, 305.593336, 0.000000, 437.302876, 243.738352, 0.000000, 0.000000, 1.000000]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [393.653800, 0.000000, 322.797939, 0.000000, 0.000000, 395.3, 241.090902, 0, 0, 0, 1, 0]
)";

TEST_F(CameraForms, RosCalibrationYaml) {
  const std::array<double, 4> pinhole = {438.783367, 437.302876, 305.593336, 243.738352};
  Expect(Read(kRosYaml), LensModel::kBrownConrady, 640, 480, pinhole,
         {-0.361976, 0.110510, 0.001014, 0.000505, 0});
  const std::string rational =
      Replaced(Replaced(kRosYaml, "plumb_bob", "rational_polynomial"), "cols: 5\n", "cols: 8\n");
  Expect(Read(Replaced(rational, "0.000505, 0.000000]", "0.000505, 0.01, 0, 0, 0]")),
         LensModel::kBrownConrady, 640, 480, pinhole,
         {-0.361976, 0.110510, 0.001014, 0.000505, 0.01});
  EXPECT_THAT(Error(Replaced(rational, "0.000505, 0.000000]", "0.000505, 0.01, 0.2, 0.1, 0.03]")),
              AllOf(HasSubstr("file.txt:10: distortion_coefficients: [0.2, 0.1, 0.03]"),
                    HasSubstr("plumb_bob"), HasSubstr("fx: 438.783367")));
  const std::string fisheye = Replaced(Replaced(kRosYaml, "plumb_bob", "equidistant"),
                                       "[-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]",
                                       "[-0.0361, 0.0110, 0.0010, 0.0005]");
  Expect(Read(fisheye), LensModel::kKannalaBrandt, 640, 480, pinhole,
         {-0.0361, 0.0110, 0.0010, 0.0005, 0});
  EXPECT_THAT(Error(Replaced(kRosYaml, "plumb_bob", "thin_prism")),
              HasSubstr("file.txt:8: distortion_model: lens 'thin_prism'"));
  EXPECT_THAT(Error(Replaced(kRosYaml, "[438.783367, 0.000000,", "[438.783367, 1.5,")),
              AllOf(HasSubstr("file.txt:7: camera_matrix.data: "), HasSubstr("skew")));
}

const char kRosMessage[] = R"(header:
  seq: 5
  frame_id: "camera"
height: 480
width: 640
distortion_model: "plumb_bob"
D: [0.1639, -0.2718, 0.0011, -0.0008, 0.0]
K: [570.34, 0.0, 319.5, 0.0, 570.34, 239.5, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [570.34, 0.0, 319.5, 0.0, 0.0, 570.34, 239.5, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: False
---
)";

TEST_F(CameraForms, RosCameraInfoAsTheTopicPrintsIt) {
  Expect(Read(kRosMessage), LensModel::kBrownConrady, 640, 480, {570.34, 570.34, 319.5, 239.5},
         {0.1639, -0.2718, 0.0011, -0.0008, 0});
  const std::string ros2 =
      "header:\n  frame_id: camera\nheight: 480\nwidth: 640\ndistortion_model: equidistant\nd:\n"
      "- 0.01\n- -0.002\n- 0.003\n- -0.001\nk:\n- 300.0\n- 0.0\n- 320.5\n- 0.0\n- 301.0\n- 240.5\n"
      "- 0.0\n- 0.0\n- 1.0\nbinning_x: 0\n---\n";
  Expect(Read(ros2), LensModel::kKannalaBrandt, 640, 480, {300.0, 301.0, 320.5, 240.5},
         {0.01, -0.002, 0.003, -0.001, 0});
  EXPECT_THAT(Error(Replaced(kRosMessage,
                             "K: [570.34, 0.0, 319.5, 0.0, 570.34, 239.5, 0.0, 0.0, "
                             "1.0]",
                             "K: [0, 0, 0, 0, 0, 0, 0, 0, 0]")),
              AllOf(HasSubstr("file.txt:8: K: is all zero"), HasSubstr("never calibrated")));
  EXPECT_THAT(Error(Replaced(kRosMessage, "binning_x: 0", "binning_x: 2")),
              HasSubstr("file.txt:11: binning_x: the picture is binned"));
  EXPECT_THAT(Error(Replaced(kRosMessage, "x_offset: 0", "x_offset: 64")),
              HasSubstr("file.txt:14: roi.x_offset: "));
}

const char kOrbSlam2[] = R"(%YAML:1.0

#--------------------------------------------------------------------------------------------
# Camera Parameters. Adjust them!
#--------------------------------------------------------------------------------------------

# Camera calibration and distortion parameters (OpenCV)
Camera.fx: 517.306408
Camera.fy: 516.469215
Camera.cx: 318.643040
Camera.cy: 255.313989

Camera.k1: 0.262383
Camera.k2: -0.953104
Camera.p1: -0.005358
Camera.p2: 0.002628
Camera.k3: 1.163314

# Camera frames per second
Camera.fps: 30.0

# Color order of the images (0: BGR, 1: RGB. It is ignored if images are grayscale)
Camera.RGB: 1
ORBextractor.nFeatures: 1000
)";

TEST_F(CameraForms, OrbSlam2TakesTheSizeFromThePictures) {
  const auto size = [] { return std::optional(cv::Size(640, 480)); };
  Expect(Read(kOrbSlam2, "", size), LensModel::kBrownConrady, 640, 480,
         {517.306408, 516.469215, 318.643040, 255.313989},
         {0.262383, -0.953104, -0.005358, 0.002628, 1.163314});
  EXPECT_THAT(Error(kOrbSlam2),
              AllOf(HasSubstr("file.txt: width: the pictures' size is not in this file"),
                    HasSubstr("{model: brown_conrady, width: ?, height: ?, fx: 517.306408")));
  EXPECT_THAT(Error(Replaced(kOrbSlam2, "Camera.fy: 516", "Camera.fx: 516")),
              HasSubstr("file.txt:9: Camera.fx: is on line 8 already"));
  std::string none = kOrbSlam2;
  for (const char* key :
       {"k1: 0.262383", "k2: -0.953104", "p1: -0.005358", "p2: 0.002628", "k3: 1.163314"}) {
    none = Replaced(none, std::string("Camera.") + key + "\n", "");
  }
  Expect(Read(none, "", size), LensModel::kPinhole, 640, 480,
         {517.306408, 516.469215, 318.643040, 255.313989}, {});
}

const char kOrbSlam3[] = R"(%YAML:1.0

File.version: "1.0"

Camera.type: "KannalaBrandt8"

# Left Camera calibration and distortion parameters (OpenCV)
Camera1.fx: 190.978477
Camera1.fy: 190.973307
Camera1.cx: 254.931706
Camera1.cy: 256.897442
Camera1.k1: 0.003482389402
Camera1.k2: 0.000715034845
Camera1.k3: -0.002053236141
Camera1.k4: 0.000202936736

# Right Camera calibration and distortion parameters (OpenCV)
Camera2.fx: 190.442369
Camera2.fy: 190.434438
Camera2.cx: 252.598170
Camera2.cy: 254.917230
Camera2.k1: 0.003400312055
Camera2.k2: 0.001766922012
Camera2.k3: -0.002663120011
Camera2.k4: 0.000329913030

Camera.width: 512
Camera.height: 512
Camera.fps: 20
)";

TEST_F(CameraForms, OrbSlam3WithAFisheyeOrAPinhole) {
  const auto left = Read(kOrbSlam3);
  Expect(left, LensModel::kKannalaBrandt, 512, 512,
         {190.978477, 190.973307, 254.931706, 256.897442},
         {0.003482389402, 0.000715034845, -0.002053236141, 0.000202936736, 0});
  EXPECT_EQ(left->fps, 20);
  Expect(Read(kOrbSlam3, "#Camera2"), LensModel::kKannalaBrandt, 512, 512,
         {190.442369, 190.434438, 252.598170, 254.917230},
         {0.003400312055, 0.001766922012, -0.002663120011, 0.000329913030, 0});
  EXPECT_THAT(Error(kOrbSlam3, "#Camera3"), HasSubstr("Camera3.fx: there is no such camera"));
  const std::string pinhole =
      "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"PinHole\"\nCamera1.fx: 458.654\n"
      "Camera1.fy: 457.296\nCamera1.cx: 367.215\nCamera1.cy: 248.375\nCamera1.k1: -0.28340811\n"
      "Camera1.k2: 0.07395907\nCamera1.p1: 0.00019359\nCamera1.p2: 1.76187114e-05\n"
      "Camera.width: 752\nCamera.height: 480\nCamera.newWidth: 600\nCamera.newHeight: 350\n";
  Expect(Read(pinhole), LensModel::kBrownConrady, 752, 480, {458.654, 457.296, 367.215, 248.375},
         {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0});
  EXPECT_THAT(Error(Replaced(pinhole, "\"PinHole\"", "\"Rational\"")),
              HasSubstr("file.txt:3: Camera.type: 'Rational' is unknown"));
  EXPECT_THAT(Error(Replaced(kOrbSlam3, "Camera1.k4: 0.000202936736\n", "")),
              HasSubstr("Camera1.k4: missing"));
}

const char kOpenCvYaml[] = R"(%YAML:1.0
---
calibration_time: "Sat 23 May 2015"
nframes: 13
image_width: 640
image_height: 480
board_width: 9
board_height: 6
square_size: 2.5000000372529030e-02
flags: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3591e+02, 0., 3.4228e+02, 0., 5.3591e+02, 2.3557e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.6637e-01, -3.8588e-02, 1.7832e-03, -2.8122e-04, 2.3839e-01 ]
avg_reprojection_error: 4.0e-01
)";

const char kOpenCvXml[] = R"(<?xml version="1.0"?>
<opencv_storage>
<calibration_time>"Sat 23 May 2015"</calibration_time>
<image_width>640</image_width>
<image_height>480</image_height>
<!-- written by the sample -->
<camera_matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    5.3591e+02 0. 3.4228e+02 0. 5.3591e+02
    2.3557e+02 0. 0. 1.</data></camera_matrix>
<distortion_coefficients type_id="opencv-matrix">
  <rows>5</rows>
  <cols>1</cols>
  <dt>d</dt>
  <data>
    -2.6637e-01 -3.8588e-02 1.7832e-03
    -2.8122e-04 2.3839e-01</data></distortion_coefficients>
</opencv_storage>
)";

TEST_F(CameraForms, OpenCvYamlAndXml) {
  for (const char* text : {kOpenCvYaml, kOpenCvXml}) {
    Expect(Read(text), LensModel::kBrownConrady, 640, 480, {535.91, 535.91, 342.28, 235.57},
           {-0.26637, -0.038588, 1.7832e-3, -2.8122e-4, 0.23839});
  }
  Expect(Read(Replaced(
             Replaced(Replaced(kOpenCvYaml, "flags: 0", "fisheye_model: 1"), "rows: 5", "rows: 4"),
             "-2.6637e-01, -3.8588e-02, 1.7832e-03, -2.8122e-04, 2.3839e-01",
             "-2.6e-02, 3.8e-03, 1.7e-03, -2.8e-04")),
         LensModel::kKannalaBrandt, 640, 480, {535.91, 535.91, 342.28, 235.57},
         {-0.026, 0.0038, 0.0017, -0.00028, 0});
  EXPECT_THAT(Error(Replaced(kOpenCvYaml, "rows: 5", "rows: 4")),
              HasSubstr("file.txt:20: distortion_coefficients.data: has 5 numbers, but rows and "
                        "cols say 4"));
  EXPECT_THAT(Error(Replaced(kOpenCvXml, "3.4228e+02", "three")),
              HasSubstr("file.txt:12: camera_matrix.data: 'three' is not a finite number"));
  EXPECT_THAT(Error(Replaced(kOpenCvXml, "</data></camera_matrix>", "</data>")),
              AllOf(HasSubstr("file.txt:"), HasSubstr("not valid XML")));
  EXPECT_THAT(Error("<?xml version=\"1.0\"?>\n<calibration><f>500</f></calibration>\n"),
              HasSubstr("file.txt:2: <calibration>: is XML, but not OpenCV's"));
  EXPECT_THAT(Error("<?xml version=\"1.0\"?>\n<!DOCTYPE a [<!ENTITY a \"aaaa\">]>\n"
                    "<opencv_storage><camera_matrix>&a;</camera_matrix></opencv_storage>"),
              HasSubstr("entities"));
}

const char kEuroc[] = R"(# General sensor definitions.
sensor_type: camera
comment: VI-Sensor cam0 (MT9M034)

# Sensor extrinsics wrt. the body-frame.
T_BS:
  cols: 4
  rows: 4
  data: [0.0148, -0.9998, 0.0041, -0.0216, 0.9995, 0.0149, 0.0257, -0.0646,
        -0.0257, 0.0037, 0.9996, 0.0098, 0.0, 0.0, 0.0, 1.0]

# Camera specific definitions.
rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
)";

TEST_F(CameraForms, EurocSensorYaml) {
  const auto read = Read(kEuroc);
  Expect(read, LensModel::kBrownConrady, 752, 480, {458.654, 457.296, 367.215, 248.375},
         {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0});
  EXPECT_EQ(read->fps, 20);
  EXPECT_THAT(Error(Replaced(kEuroc, "camera_model: pinhole", "camera_model: omni")),
              HasSubstr("file.txt:15: camera_model: 'omni'"));
}

TEST_F(CameraForms, ColmapCamerasWithTheirHalfPixel) {
  const std::string head =
      "# Camera list with one line of data per camera:\n"
      "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n# Number of cameras: 1\n";
  const auto expect = [&](const std::string& line, LensModel model, std::array<double, 4> pinhole,
                          std::array<double, 5> distortion) {
    Expect(Read(head + line + "\n"), model, 3072, 2304, pinhole, distortion);
  };
  const std::array<double, 4> one = {2559.81, 2559.81, 1535.5, 1151.5};
  const std::array<double, 4> two = {2559.81, 2560.5, 1535.5, 1151.5};
  expect("1 SIMPLE_PINHOLE 3072 2304 2559.81 1536 1152", LensModel::kPinhole, one, {});
  expect("1 PINHOLE 3072 2304 2559.81 2560.5 1536 1152", LensModel::kPinhole, two, {});
  expect("1 SIMPLE_RADIAL 3072 2304 2559.81 1536 1152 -0.0218531", LensModel::kBrownConrady, one,
         {-0.0218531, 0, 0, 0, 0});
  expect("1 RADIAL 3072 2304 2559.81 1536 1152 -0.02 0.01", LensModel::kBrownConrady, one,
         {-0.02, 0.01, 0, 0, 0});
  expect("1 OPENCV 3072 2304 2559.81 2560.5 1536 1152 -0.02 0.01 0.001 -0.002",
         LensModel::kBrownConrady, two, {-0.02, 0.01, 0.001, -0.002, 0});
  expect("1 OPENCV_FISHEYE 3072 2304 2559.81 2560.5 1536 1152 -0.02 0.01 0.001 -0.002",
         LensModel::kKannalaBrandt, two, {-0.02, 0.01, 0.001, -0.002, 0});
  expect("1 FOV 3072 2304 2559.81 2560.5 1536 1152 0.9", LensModel::kFov, two, {0.9, 0, 0, 0, 0});
  expect("1 FULL_OPENCV 3072 2304 2559.81 2560.5 1536 1152 -0.02 0.01 0.001 -0.002 0.003 0 0 0",
         LensModel::kBrownConrady, two, {-0.02, 0.01, 0.001, -0.002, 0.003});
  const std::string more =
      head + "1 PINHOLE 640 480 500 500 320 240\n2 PINHOLE 320 240 250 250 160 120\n";
  Expect(Read(more, "#2"), LensModel::kPinhole, 320, 240, {250, 250, 159.5, 119.5}, {});
  EXPECT_THAT(Error(more, "#3"), HasSubstr("3: there is no such camera; the file has 1, 2"));
  EXPECT_THAT(
      Error(head + "1 THIN_PRISM_FISHEYE 640 480 500 500 320 240 0 0 0 0 0 0 0 0\n"),
      AllOf(HasSubstr("file.txt:4: camera 1: 'THIN_PRISM_FISHEYE'"), HasSubstr("OPENCV_FISHEYE")));
  EXPECT_THAT(Error(head + "1 OPENCV 640 480 500 500 320 240 0.1\n"),
              HasSubstr("file.txt:4: camera 1: OPENCV has 5 parameters; it takes 8"));
}

TEST_F(CameraForms, ADataSetRunsOnACameraFileWithoutASize) {
  Write("other.yaml", "%YAML:1.0\nCamera.fx: 60\nCamera.fy: 60\nCamera.cx: 32\nCamera.cy: 24\n");
  SourceOptions options;
  options.camera_file = folder_ / "other.yaml";
  const auto source = OpenDataset(folder_, options);
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_EQ((*source)->info().camera->width(), kWidth);
  EXPECT_EQ((*source)->info().camera->intrinsics().fx, 60);
}

CameraIntrinsics Calibrated(LensModel model, std::array<double, 5> distortion) {
  CameraIntrinsics lens;
  lens.model = model;
  lens.width = 752, lens.height = 480;
  lens.fx = 458.654321098765, lens.fy = 457.2961111111111;
  lens.cx = 367.21500000000003, lens.cy = 248.375;
  lens.distortion = distortion;
  return lens;
}

constexpr std::array<double, 5> kBrown = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05,
                                          0.01};
constexpr std::array<double, 5> kBrownWithoutK3 = {-0.28340811, 0.07395907, 0.00019359, 1.7e-05, 0};
constexpr std::array<double, 5> kFish = {-0.0133, -0.0024, 0.0021, -0.0012, 0};

TEST_F(CameraForms, WhatIsWrittenInAnyFormIsReadBackToTheSameNumbers) {
  using Form = CameraTextForm;
  const auto expect = [&](Form form, LensModel model, const std::array<double, 5>& distortion,
                          LensModel read_as) {
    const CameraIntrinsics lens = Calibrated(model, distortion);
    const auto text = CameraText(form, lens, "Made by a test\n# one sigma: fx 0.1");
    ASSERT_TRUE(text.ok()) << text.status();
    SCOPED_TRACE(*text);
    EXPECT_THAT(*text, HasSubstr("one sigma: fx 0.1"));
    Expect(Read(*text), read_as, lens.width, lens.height, {lens.fx, lens.fy, lens.cx, lens.cy},
           distortion);
  };
  for (const char* name : {"saccade", "kalibr", "ros", "opencv"}) {
    const auto form = ParseCameraTextForm(name);
    ASSERT_TRUE(form.ok());
    const bool kalibr = *form == Form::kKalibr, own = *form == Form::kSaccade;
    expect(*form, LensModel::kBrownConrady, kalibr ? kBrownWithoutK3 : kBrown,
           LensModel::kBrownConrady);
    expect(*form, LensModel::kKannalaBrandt, kFish, LensModel::kKannalaBrandt);
    // ROS and OpenCV say a pinhole by coefficients of zero.
    expect(*form, LensModel::kPinhole, {},
           own || kalibr ? LensModel::kPinhole : LensModel::kBrownConrady);
    if (own || kalibr) expect(*form, LensModel::kFov, {0.9213, 0, 0, 0, 0}, LensModel::kFov);
  }
  EXPECT_THAT(std::string(ParseCameraTextForm("colmap").status().message()),
              HasSubstr("give saccade, kalibr, ros or opencv"));
}

TEST_F(CameraForms, OpenCvReadsWhatIsWrittenForIt) {
  for (const LensModel model : {LensModel::kBrownConrady, LensModel::kKannalaBrandt}) {
    const bool fisheye = model == LensModel::kKannalaBrandt;
    const CameraIntrinsics lens = Calibrated(model, fisheye ? kFish : kBrown);
    const auto text = CameraText(CameraTextForm::kOpenCv, lens, "Made by a test");
    ASSERT_TRUE(text.ok());
    cv::FileStorage storage(*text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    cv::Mat matrix, coefficients;
    storage["camera_matrix"] >> matrix;
    storage["distortion_coefficients"] >> coefficients;
    ASSERT_EQ(matrix.size(), cv::Size(3, 3));
    EXPECT_EQ(matrix.at<double>(0, 0), lens.fx);
    EXPECT_EQ(matrix.at<double>(1, 2), lens.cy);
    ASSERT_EQ(coefficients.total(), fisheye ? 4 : 5);
    EXPECT_EQ(coefficients.at<double>(3), lens.distortion[3]);
    EXPECT_EQ(static_cast<int>(storage["image_width"]), lens.width);
  }
}

TEST_F(CameraForms, AFormThatHasNoWordsForALensSaysWhichHas) {
  const auto error = [](CameraTextForm form, CameraIntrinsics lens) {
    const auto text = CameraText(form, lens);
    EXPECT_EQ(text.status().code(), absl::StatusCode::kFailedPrecondition);
    return std::string(text.status().message());
  };
  EXPECT_THAT(
      error(CameraTextForm::kKalibr, Calibrated(LensModel::kBrownConrady, kBrown)),
      AllOf(HasSubstr("form kalibr"), HasSubstr("k3"), HasSubstr("ros, opencv or saccade")));
  for (const auto form : {CameraTextForm::kKalibr, CameraTextForm::kRos, CameraTextForm::kOpenCv}) {
    EXPECT_THAT(error(form, Calibrated(LensModel::kRadial1, {6e-7, 0, 0, 0, 0})),
                AllOf(HasSubstr("radial1"), HasSubstr("the form saccade")));
    CameraIntrinsics rolling = Calibrated(LensModel::kBrownConrady, kBrownWithoutK3);
    rolling.rolling_shutter_readout_s = 0.02;
    EXPECT_THAT(error(form, rolling), HasSubstr("rolling shutter"));
  }
  for (const auto form : {CameraTextForm::kRos, CameraTextForm::kOpenCv}) {
    EXPECT_THAT(error(form, Calibrated(LensModel::kFov, {0.92, 0, 0, 0, 0})),
                AllOf(HasSubstr("fov"), HasSubstr("kalibr or saccade")));
  }
}

}  // namespace
}  // namespace saccade::camera_forms_test
