#include "shared/wire/from_proto.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <cmath>

#include "shared/wire/bad_field.hpp"

namespace saccade::wire {
namespace {

absl::Status CheckFinite(double value, absl::string_view field, absl::string_view part) {
  if (std::isfinite(value)) return absl::OkStatus();
  return BadField(absl::StrCat(field, ".", part), "must be a finite number");
}

absl::StatusOr<AnnotationTarget> PixelTargetFromProto(const v1::FramePixel& message,
                                                      const ImageSize& image,
                                                      absl::string_view field) {
  if (!message.has_pixel()) return BadField(absl::StrCat(field, ".pixel"), "is missing");
  absl::StatusOr<Eigen::Vector2d> pixel =
      FromProto(message.pixel(), image, absl::StrCat(field, ".pixel"));
  if (!pixel.ok()) return pixel.status();
  return PixelTarget{message.frame_id(), *pixel};
}

absl::StatusOr<AnnotationTarget> RayFromProto(const v1::Ray& message, absl::string_view field) {
  absl::StatusOr<Eigen::Vector3d> origin =
      FromProto(message.origin_in_world_m(), absl::StrCat(field, ".origin_in_world_m"));
  if (!origin.ok()) return origin.status();
  const std::string direction_field = absl::StrCat(field, ".direction_in_world");
  absl::StatusOr<Eigen::Vector3d> direction =
      FromProto(message.direction_in_world(), direction_field);
  if (!direction.ok()) return direction.status();
  if (direction->norm() < 1e-9) return BadField(direction_field, "must be longer than 0");
  return RayTarget{*origin, *direction};
}

}  // namespace

absl::StatusOr<Eigen::Vector2d> FromProto(const v1::Pixel& message, const ImageSize& image,
                                          absl::string_view field) {
  const Eigen::Vector2d pixel(message.u(), message.v());
  const int size[2] = {image.width, image.height};
  const char* const part[2] = {"u", "v"};
  for (int i = 0; i < 2; ++i) {
    if (absl::Status s = CheckFinite(pixel[i], field, part[i]); !s.ok()) return s;
    // Half a pixel beyond the centres of the outermost pixels is still the picture.
    if (pixel[i] < -0.5 || pixel[i] > size[i] - 0.5) {
      return BadField(
          absl::StrCat(field, ".", part[i]),
          absl::StrCat(pixel[i], " is outside the picture (-0.5 to ", size[i] - 0.5, ")"));
    }
  }
  return pixel;
}

absl::StatusOr<Eigen::Vector3d> FromProto(const v1::Vector3& message, absl::string_view field) {
  const Eigen::Vector3d value(message.x(), message.y(), message.z());
  const char* const part[3] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) {
    if (absl::Status s = CheckFinite(value[i], field, part[i]); !s.ok()) return s;
    if (std::abs(value[i]) > kMaxCoordinateM) {
      return BadField(absl::StrCat(field, ".", part[i]),
                      absl::StrCat(value[i], " is beyond ", kMaxCoordinateM));
    }
  }
  return value;
}

absl::StatusOr<AnnotationTarget> FromProto(const v1::AnnotationTarget& message,
                                           const ImageSize& image, absl::string_view field) {
  switch (message.target_case()) {
    case v1::AnnotationTarget::kFramePixel:
      return PixelTargetFromProto(message.frame_pixel(), image,
                                  absl::StrCat(field, ".frame_pixel"));
    case v1::AnnotationTarget::kFeatureId:
      return FeatureTarget{message.feature_id()};
    case v1::AnnotationTarget::kPointInWorldM: {
      absl::StatusOr<Eigen::Vector3d> point =
          FromProto(message.point_in_world_m(), absl::StrCat(field, ".point_in_world_m"));
      if (!point.ok()) return point.status();
      return PointTarget{*point};
    }
    case v1::AnnotationTarget::kRay:
      return RayFromProto(message.ray(), absl::StrCat(field, ".ray"));
    case v1::AnnotationTarget::TARGET_NOT_SET:
      break;
  }
  return BadField(field, "is missing: give frame_pixel, feature_id, point_in_world_m or ray");
}

absl::StatusOr<double> CheckSize(double size_m, absl::string_view field) {
  if (!std::isfinite(size_m)) return BadField(field, "must be a finite number");
  if (size_m == 0.0) return kDefaultSizeM;
  if (size_m < kMinSizeM || size_m > kMaxSizeM) {
    return BadField(field, absl::StrCat(size_m, " is not between ", kMinSizeM, " and ", kMaxSizeM));
  }
  return size_m;
}

absl::Status CheckText(absl::string_view text, std::size_t max_bytes, absl::string_view field) {
  if (text.size() > max_bytes) {
    return BadField(field, absl::StrCat("at most ", max_bytes, " bytes, not ", text.size()));
  }
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(text[at]); };
    // U+0080 to U+009F: the terminal's second set.
    const bool second_set =
        byte(i) == 0xc2 && i + 1 < text.size() && byte(i + 1) >= 0x80 && byte(i + 1) < 0xa0;
    if (second_set || (absl::ascii_iscntrl(byte(i)) && text[i] != '\n')) {
      return BadField(field, "holds a control character");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckUuid(absl::string_view id, absl::string_view field) {
  bool good = id.size() == 36;
  for (std::size_t i = 0; good && i < id.size(); ++i) {
    const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
    good = dash ? id[i] == '-' : absl::ascii_isxdigit(static_cast<unsigned char>(id[i]));
  }
  return good ? absl::OkStatus()
              : BadField(field, "must be a UUID such as 6f1c2c9e-3d43-4d0a-9f5e-0c9b1a7f2d11");
}

}  // namespace saccade::wire
