#include "shared/marks/shape_lines.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace saccade {
namespace {

using Eigen::Vector3d;

std::vector<Polyline3> BoxLines(const Vector3d& centre, const Vector3d& extent_m,
                                const Eigen::Quaterniond& world_from_mark) {
  const Vector3d h = 0.5 * extent_m;
  const auto corner = [&](int i) -> Vector3d {
    const Vector3d in_mark(i & 1 ? h.x() : -h.x(), i & 2 ? h.y() : -h.y(), i & 4 ? h.z() : -h.z());
    return centre + world_from_mark * in_mark;
  };
  std::vector<Polyline3> lines;
  for (int i = 0; i < 8; ++i) {
    for (const int bit : {1, 2, 4}) {
      if (!(i & bit)) lines.push_back({corner(i), corner(i | bit)});
    }
  }
  return lines;
}

std::vector<Polyline3> ArrowLines(const Vector3d& tip, double size_m,
                                  const Eigen::Quaterniond& world_from_mark) {
  const auto up = [&](double dx, double dy, double dz) -> Vector3d {
    return tip + world_from_mark * Vector3d(dx, -dy, dz);
  };
  const double head = 0.4 * size_m;
  const double half = 0.5 * head;
  return {{up(0, 2 * size_m, 0), tip},
          {up(-half, head, 0), tip, up(half, head, 0)},
          {up(0, head, -half), tip, up(0, head, half)}};
}

/// A line, and a tick across each end.
std::vector<Polyline3> MeasureLines(const Vector3d& begin, const Vector3d& offset, double size_m) {
  std::vector<Polyline3> lines = {{begin, begin + offset}};
  const double length = offset.norm();
  if (length < 1e-6) return lines;
  Vector3d across = offset.cross(Vector3d::UnitY());
  if (across.norm() < 0.1 * length) across = offset.cross(Vector3d::UnitX());
  const Vector3d half = std::min(0.2 * size_m, 0.25 * length) * across.normalized();
  for (const Vector3d& end : {begin, Vector3d(begin + offset)}) {
    lines.push_back({end - half, end + half});
  }
  return lines;
}

/// Two kites that stand on their points.
std::vector<Polyline3> PinLines(const Vector3d& tip, double size_m) {
  const double out = 0.25 * size_m, shoulder = 0.7 * size_m;
  const auto up = [&tip](double dx, double dy, double dz) -> Vector3d {
    return tip + Vector3d(dx, -dy, dz);
  };
  return {{tip, up(-out, shoulder, 0), up(0, size_m, 0), up(out, shoulder, 0), tip},
          {tip, up(0, shoulder, -out), up(0, size_m, 0), up(0, shoulder, out), tip}};
}

/// One size above the anchor: world y points down.
Vector3d Top(const Annotation& annotation) {
  return annotation.anchor.point_in_world - Vector3d(0, annotation.size_m, 0);
}

Eigen::Quaterniond TurnOf(const Annotation& annotation) {
  return annotation.world_from_mark.value_or(Eigen::Quaterniond::Identity());
}

/// Rightwards along the foot of a picture that faces the camera.
Vector3d RightOf(const Vector3d& foot, const Rigid3& world_from_camera) {
  const auto level = [](Vector3d v) {
    v.y() = 0;
    return v;
  };
  const Vector3d away = level(foot - world_from_camera.translation);
  if (away.norm() >= 1e-6) return Vector3d::UnitY().cross(away.normalized());
  return level(world_from_camera.rotation * Vector3d::UnitX()).normalized();
}

std::string ItemLines(const Annotation& annotation) {
  if (!annotation.check_items) return annotation.text;
  std::size_t done = 0;
  std::string lines;
  for (const CheckItem& item : *annotation.check_items) {
    done += item.done ? 1 : 0;
    lines += (item.done ? "\n\u2611 " : "\n\u2610 ") + item.text;
  }
  return (annotation.text.empty() ? "check list" : annotation.text) + " " + std::to_string(done) +
         "/" + std::to_string(annotation.check_items->size()) + lines;
}

}  // namespace

std::vector<Polyline3> ShapeLines(const Annotation& annotation, const Rigid3& world_from_camera) {
  const Vector3d& point = annotation.anchor.point_in_world;
  const double size_m = annotation.size_m;
  switch (annotation.shape) {
    case AnnotationShape::kCube:
      return BoxLines(point, Vector3d::Constant(size_m), Eigen::Quaterniond::Identity());
    case AnnotationShape::kBox:
      return BoxLines(point, annotation.extent_m, TurnOf(annotation));
    case AnnotationShape::kNote:
    case AnnotationShape::kCheckList:
      return {{point, Top(annotation)}};
    case AnnotationShape::kArrow:
      return ArrowLines(point, size_m, TurnOf(annotation));
    case AnnotationShape::kMeasure:
      if (annotation.ink_offset_m.empty()) return {};
      return MeasureLines(point, annotation.ink_offset_m[0], size_m);
    case AnnotationShape::kPin:
      return PinLines(point, size_m);
    case AnnotationShape::kPicture: {
      const std::array<Vector3d, 4> c = PictureCorners(annotation, world_from_camera);
      return {{c[0], c[1], c[2], c[3], c[0]}};
    }
    case AnnotationShape::kInk:
      break;
  }
  Polyline3 line;
  for (const Vector3d& offset : annotation.ink_offset_m) line.push_back(point + offset);
  return {line};
}

std::array<Vector3d, 4> PictureCorners(const Annotation& annotation,
                                       const Rigid3& world_from_camera) {
  const Vector3d& foot = annotation.anchor.point_in_world;
  const Vector3d half = 0.5 * annotation.size_m * RightOf(foot, world_from_camera);
  double shape = 0.75;
  if (annotation.picture && annotation.picture->width > 0) {
    shape = static_cast<double>(annotation.picture->height) / annotation.picture->width;
  }
  const Vector3d up(0, -annotation.size_m * shape, 0);
  return {foot - half, foot + half, foot + half + up, foot - half + up};
}

Vector3d LabelPoint(const Annotation& annotation, const Rigid3& world_from_camera) {
  const Vector3d& point = annotation.anchor.point_in_world;
  switch (annotation.shape) {
    case AnnotationShape::kNote:
    case AnnotationShape::kCheckList:
    case AnnotationShape::kPin:
      return Top(annotation);
    case AnnotationShape::kMeasure:
      if (annotation.ink_offset_m.empty()) return point;
      return point + 0.5 * annotation.ink_offset_m[0];
    case AnnotationShape::kPicture: {
      const std::array<Vector3d, 4> corners = PictureCorners(annotation, world_from_camera);
      return 0.5 * (corners[2] + corners[3]);
    }
    default:
      return point;
  }
}

std::string MeasureText(double length_m, double sigma_m, bool metric) {
  char text[96];
  if (!metric) {
    std::snprintf(text, sizeof text, "%.3f ± %.3f, no scale", length_m, sigma_m);
  } else if (length_m < 0.9995) {
    std::snprintf(text, sizeof text, "%.0f ± %.0f mm", 1e3 * length_m,
                  std::max(1.0, 1e3 * sigma_m));
  } else {
    std::snprintf(text, sizeof text, "%.2f ± %.2f m", length_m, std::max(0.01, sigma_m));
  }
  return text;
}

std::string LabelWords(const Annotation& annotation, bool metric) {
  const std::string& text = annotation.text;
  const auto before = [&text](const std::string& word) {
    return text.empty() ? word : word + ": " + text;
  };
  switch (annotation.shape) {
    case AnnotationShape::kNote:
      return text.empty() ? "note" : text;
    case AnnotationShape::kPin:
      return before(std::to_string(annotation.number));
    case AnnotationShape::kMeasure:
      return before(MeasureText(annotation.length_m, annotation.length_sigma_m, metric));
    case AnnotationShape::kCheckList:
      return ItemLines(annotation);
    default:
      return text;
  }
}

}  // namespace saccade
