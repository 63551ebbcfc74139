// The page's drawing of annotations and the server's are held against the same file:
// tests/golden/overlay_strokes.json. To write it anew after a deliberate change:
//   SACCADE_UPDATE_GOLDEN=1 build/release/bin/overlay_test --gtest_filter='OverlayGolden.*'
#include <absl/strings/str_format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "shared/marks/strokes.hpp"
#include "tests/unit/server/anchors/synthetic_map.hpp"

namespace saccade::golden_test {
namespace {

using nlohmann::json;

constexpr double kTolerancePx = 0.05;
const char* const kFile = SACCADE_SOURCE_DIR "/tests/golden/overlay_strokes.json";

json Array(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
json Array(const Polyline2& line) {
  json points = json::array();
  for (const Eigen::Vector2d& p : line) {
    points.push_back({std::round(p.x() * 1e4) / 1e4, std::round(p.y() * 1e4) / 1e4});
  }
  return points;
}

const char* Name(AnnotationShape shape) {
  static constexpr const char* kNames[kAnnotationShapes] = {
      "cube", "note", "arrow", "ink", "box", "measure", "pin", "picture", "check_list"};
  return kNames[static_cast<int>(shape)];
}
const char* Name(AnchorState state) {
  static constexpr const char* kNames[] = {"provisional", "tracking", "paused", "stopped"};
  return kNames[static_cast<int>(state)];
}
const char* Name(LensModel model) {
  static constexpr const char* kNames[] = {"pinhole", "radial1", "brown_conrady", "kannala_brandt"};
  return kNames[static_cast<int>(model)];
}

struct Lens {
  CameraIntrinsics intrinsics;
  std::vector<double> distortion;  // as camera.yaml lists it
};

/// The three lenses of issue 2: an ideal one, the wide one of Davison's sequence, and a real one.
std::vector<Lens> Lenses() {
  Lens pinhole{{.model = LensModel::kPinhole,
                .width = 640,
                .height = 480,
                .fx = 500,
                .fy = 505,
                .cx = 320.5,
                .cy = 238.25},
               {}};
  Lens radial{{.model = LensModel::kRadial1,
               .width = 320,
               .height = 240,
               .fx = 195,
               .fy = 195,
               .cx = 162,
               .cy = 125,
               .distortion = {6e-6}},
              {6e-6}};
  Lens brown{{.model = LensModel::kBrownConrady,
              .width = 640,
              .height = 480,
              .fx = 517.3,
              .fy = 516.5,
              .cx = 318.6,
              .cy = 255.3,
              .distortion = {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
             {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}};
  return {pinhole, radial, brown};
}

std::vector<Rigid3> Poses() {
  return {Rigid3(), testing::LookFrom({0.2, -0.3, 0.1}, -0.2, 0.35),
          testing::LookFrom({0.02, 0.05, 1.15}, 0.4, 0.1)};  // close, some of it behind
}

/// What marks.md defines.
void AddShapes(std::vector<Annotation>& list) {
  const auto add = [&list](AnnotationShape shape, const Eigen::Vector3d& point) -> Annotation& {
    Annotation& one = list.emplace_back();
    one.id = std::string("mark-") + std::to_string(list.size() - 1);
    one.shape = shape;
    one.anchor.state = AnchorState::kTracking;
    one.anchor.point_in_world = point;
    one.color_rgba = 0xd9b38cff;
    return one;
  };
  const auto turn = [](double angle, double x, double y, double z) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(x, y, z).normalized()));
  };
  Annotation& arrow = add(AnnotationShape::kArrow, {-0.2, -0.1, 1.3});
  arrow.world_from_mark = turn(1.1, 1, -2, 0.5);
  arrow.size_m = 0.1;
  Annotation& box = add(AnnotationShape::kBox, {0.2, -0.15, 1.5});
  box.extent_m = {0.3, 0.1, 0.2};
  box.world_from_mark = turn(0.6, 0, 1, 0.2);
  box.text = "pump";
  Annotation& straight = add(AnnotationShape::kBox, {-0.35, 0.25, 1.7});
  straight.extent_m = {0.1, 0.15, 0.05};
  straight.anchor.state = AnchorState::kPaused;
  Annotation& across = add(AnnotationShape::kMeasure, {-0.15, 0.05, 1.4});
  across.ink_offset_m = {{0.3, 0.06, 0.16}};
  across.length_m = 0.3454;
  across.length_sigma_m = 0.0042;
  across.text = "shaft";
  Annotation& upright = add(AnnotationShape::kMeasure, {0.3, 0.3, 1.6});
  upright.ink_offset_m = {{0.01, -1.2, 0.02}};
  upright.length_m = 1.2002;
  upright.length_sigma_m = 0.0321;
  Annotation& pin = add(AnnotationShape::kPin, {0.12, 0.22, 1.25});
  pin.number = 17;
  pin.size_m = 0.08;
  pin.text = "leaks";
  add(AnnotationShape::kPin, {-0.05, 0.1, 1.35}).number = 3;
  Annotation& picture = add(AnnotationShape::kPicture, {-0.1, 0.3, 1.6});
  picture.size_m = 0.3;
  picture.picture = std::make_shared<Picture>(Picture{"", "image/png", 400, 250, ""});
  picture.text = "page 12";
  Annotation& tasks = add(AnnotationShape::kCheckList, {0.3, 0.05, 1.5});
  tasks.text = "service";
  tasks.check_items = std::make_shared<std::vector<CheckItem>>(
      std::vector<CheckItem>{{"oil", true, "Bob", 1}, {"lid", false, "", 0}});
  add(AnnotationShape::kCheckList, {-0.4, -0.05, 1.8}).check_items =
      std::make_shared<std::vector<CheckItem>>(std::vector<CheckItem>{{"tidy up", false, "", 0}});
}

std::vector<Annotation> Annotations() {
  std::vector<Annotation> list(6);
  const Eigen::Vector3d points[] = {{0.05, 0.1, 1.2},  {-0.3, 0.05, 1.4}, {0.35, 0.2, 1.3},
                                    {-0.1, 0.25, 1.5}, {0.0, 0.0, 1.18},  {0.1, 0.15, 1.6}};
  const AnnotationShape shapes[] = {AnnotationShape::kCube,  AnnotationShape::kNote,
                                    AnnotationShape::kArrow, AnnotationShape::kInk,
                                    AnnotationShape::kCube,  AnnotationShape::kNote};
  for (int i = 0; i < 6; ++i) {
    list[i].id = std::string("mark-") + std::to_string(i);
    list[i].shape = shapes[i];
    list[i].anchor.state = AnchorState::kTracking;
    list[i].anchor.point_in_world = points[i];
  }
  list[0].color_rgba = 0xff8c1aff;
  list[2].color_rgba = 0x00c8ff40;  // drawn opaque, whatever its last byte
  list[1].text = "check the oil level here, then close the lid again";
  list[4].size_m = 0.9;  // reaches round the camera of the third pose
  list[4].anchor.state = AnchorState::kPaused;
  list[5].anchor.state = AnchorState::kProvisional;
  list[5].size_m = 0.2;
  InkStroke::Points ink;
  for (int k = 0; k < 12; ++k) {
    ink.emplace_back(0.02 * k, 0.05 * std::sin(0.8 * k), 0.01 * k);
  }
  list[3].ink_offset_m = std::move(ink);
  AddShapes(list);
  return list;
}

json Describe(const CameraModel& camera, const std::vector<double>& distortion) {
  const CameraIntrinsics& i = camera.intrinsics();
  return {{"model", Name(i.model)},
          {"width", i.width},
          {"height", i.height},
          {"fx", i.fx},
          {"fy", i.fy},
          {"cx", i.cx},
          {"cy", i.cy},
          {"distortion", distortion}};
}

/// As the page has it.
std::string Css(std::uint32_t rgba) { return absl::StrFormat("#%06x", rgba >> 8); }

json Describe(const std::vector<Annotation>& annotations) {
  json list = json::array();
  for (const Annotation& a : annotations) {
    json ink = json::array();
    for (const Eigen::Vector3d& offset : a.ink_offset_m) ink.push_back(Array(offset));
    list.push_back({{"id", a.id},
                    {"shape", Name(a.shape)},
                    {"text", a.text},
                    {"size_m", a.size_m},
                    {"color_rgba", a.color_rgba},
                    {"state", Name(a.anchor.state)},
                    {"point_in_world_m", Array(a.anchor.point_in_world)},
                    {"ink_offset_m", ink}});
    json& entry = list.back();
    if (const auto& q = a.world_from_mark) {
      entry["world_from_mark"] = {q->x(), q->y(), q->z(), q->w()};
    }
    if (a.shape == AnnotationShape::kBox) entry["extent_m"] = Array(a.extent_m);
    if (a.number > 0) entry["number"] = a.number;
    if (a.length_m > 0) {
      entry["length_m"] = a.length_m;
      entry["length_sigma_m"] = a.length_sigma_m;
    }
    if (a.picture) {
      entry["picture"] = {{"width", a.picture->width}, {"height", a.picture->height}};
    }
    if (!a.check_items) continue;
    for (const CheckItem& item : *a.check_items) {
      entry["check_items"].push_back({{"text", item.text}, {"done", item.done}});
    }
  }
  return list;
}

json View(const CameraModel& camera, const std::vector<double>& distortion, const Rigid3& pose) {
  const Marks marks = AnnotationMarks(camera, pose, Annotations());
  json view;
  view["camera"] = Describe(camera, distortion);
  const Eigen::Quaterniond& q = pose.rotation;
  view["world_from_camera"] = {{"translation_m", Array(pose.translation)},
                               {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
  view["strokes"] = json::array();
  for (const Stroke& stroke : marks.strokes) {
    view["strokes"].push_back({{"annotation_id", stroke.annotation_id},
                               {"hollow", stroke.hollow},
                               {"colour", Css(stroke.color_rgba)},
                               {"points_px", Array(stroke.points_px)}});
  }
  view["labels"] = json::array();
  for (const Label& label : marks.labels) {
    view["labels"].push_back({{"annotation_id", label.annotation_id},
                              {"text", label.text},
                              {"hollow", label.hollow},
                              {"colour", Css(label.color_rgba)},
                              {"at_px", Array(Polyline2{label.at_px})[0]}});
  }
  view["edge_arrows"] = json::array();
  for (const EdgeArrow& arrow : marks.edge_arrows) {
    view["edge_arrows"].push_back({{"annotation_id", arrow.annotation_id},
                                   {"hollow", arrow.hollow},
                                   {"colour", Css(arrow.color_rgba)},
                                   {"tip_px", Array(Polyline2{arrow.tip_px})[0]},
                                   {"direction", Array(Polyline2{arrow.direction})[0]}});
  }
  view["axes"] = json::array();
  for (const AxisStroke& axis : WorldAxes(camera, pose)) {
    json pieces = json::array();
    for (const Polyline2& piece : axis.pieces) pieces.push_back(Array(piece));
    view["axes"].push_back({{"name", std::string(1, axis.name)}, {"pieces_px", pieces}});
  }
  return view;
}

json Everything() {
  json golden;
  golden["about"] =
      "Strokes of annotations in distorted pixels, as server/overlay/README.md defines them. The "
      "C++ test and the page's test both check it. Written by: SACCADE_UPDATE_GOLDEN=1 "
      "build/release/bin/overlay_test --gtest_filter='OverlayGolden.*'";
  golden["tolerance_px"] = kTolerancePx;
  golden["annotations"] = Describe(Annotations());
  golden["views"] = json::array();
  for (const Lens& lens : Lenses()) {
    const CameraModel camera(lens.intrinsics);
    for (const Rigid3& pose : Poses()) {
      golden["views"].push_back(View(camera, lens.distortion, pose));
    }
  }
  return golden;
}

/// Numbers within the tolerance, everything else equal.
void Compare(const json& expected, const json& actual, const std::string& where) {
  if (expected.is_number() && actual.is_number()) {
    ASSERT_NEAR(expected.get<double>(), actual.get<double>(), kTolerancePx) << where;
    return;
  }
  ASSERT_EQ(expected.type(), actual.type()) << where;
  if (!expected.is_structured()) {
    ASSERT_EQ(expected, actual) << where;
    return;
  }
  ASSERT_EQ(expected.size(), actual.size()) << where;
  for (const auto& [key, value] : expected.items()) {
    const std::string inner = where + "/" + key;
    if (expected.is_object()) {
      ASSERT_TRUE(actual.contains(key)) << inner;
      Compare(value, actual[key], inner);
    } else {
      Compare(value, actual[std::stoul(key)], inner);
    }
    if (::testing::Test::HasFatalFailure()) return;
  }
}

TEST(OverlayGolden, StrokesEqualTheFile) {
  const json actual = Everything();
  if (std::getenv("SACCADE_UPDATE_GOLDEN") != nullptr) {
    std::ofstream(kFile) << actual.dump() << '\n';
    GTEST_SKIP() << "wrote " << kFile;
  }
  std::ifstream file(kFile);
  ASSERT_TRUE(file) << kFile << " is missing; see the head of this file";
  Compare(json::parse(file), actual, "");
}

}  // namespace
}  // namespace saccade::golden_test
