#include "client/cli/text.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>

#include "shared/scene/length_text.hpp"

namespace saccade::cli {
namespace {

// Bytes above 127 in UTF-8 take one column per character.
std::size_t Width(absl::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
  }));
}

}  // namespace

absl::string_view Word(TrackingStatus status) {
  switch (status) {
    case TrackingStatus::kInitialising:
      return "initialising";
    case TrackingStatus::kTracking:
      return "tracking";
    case TrackingStatus::kCoasting:
      return "coasting";
    case TrackingStatus::kLost:
      return "lost";
    case TrackingStatus::kRelocalising:
      return "relocalising";
  }
  return "unknown";
}

absl::string_view Word(TrackingQuality quality) {
  switch (quality) {
    case TrackingQuality::kBad:
      return "bad";
    case TrackingQuality::kPoor:
      return "poor";
    case TrackingQuality::kGood:
      return "good";
    case TrackingQuality::kUnknown:
      break;
  }
  return "unknown";
}

absl::string_view Word(FeatureState state) {
  switch (state) {
    case FeatureState::kNotAttempted:
      return "not_attempted";
    case FeatureState::kMeasured:
      return "measured";
    case FeatureState::kFailed:
      return "failed";
  }
  return "unknown";
}

absl::string_view Word(AnnotationShape shape) {
  // As --shape has it: one word.
  return shape == AnnotationShape::kCheckList ? "check-list" : ToString(shape);
}

absl::string_view Word(AnchorState state) {
  switch (state) {
    case AnchorState::kProvisional:
      return "provisional";
    case AnchorState::kTracking:
      return "tracking";
    case AnchorState::kPaused:
      return "paused";
    case AnchorState::kStopped:
      return "stopped";
  }
  return "unknown";
}

absl::string_view Word(AnchorMethod method) {
  switch (method) {
    case AnchorMethod::kScene:
      return "scene";
    case AnchorMethod::kFeature:
      return "feature";
    case AnchorMethod::kPlane:
      return "plane";
    case AnchorMethod::kMedianDepth:
      return "median_depth";
    case AnchorMethod::kPoint:
      return "point";
  }
  return "unknown";
}

absl::string_view Word(net::Role role) {
  switch (role) {
    case net::Role::kExpert:
      return "expert";
    case net::Role::kWearer:
      return "wearer";
    case net::Role::kViewer:
      return "viewer";
  }
  return "unknown";
}

std::string PointText(const Eigen::Vector3d& point, bool metric) {
  return absl::StrFormat("x %.3f y %.3f z %.3f%s", point.x(), point.y(), point.z(),
                         metric ? " m" : "");
}

std::string PlaceText(const Anchor& anchor) {
  return anchor.place_known ? PointText(anchor.point_in_world, false) : "place not known";
}

std::string ErrorText(const Anchor& anchor, bool metric) {
  if (!anchor.place_known) return "place not known";
  const std::string px =
      anchor.error_px ? absl::StrFormat("%.1f px", *anchor.error_px) : "out of view";
  return metric ? absl::StrCat(px, " ", LengthText(anchor.error_m)) : px + ", scale unknown";
}

std::string StateText(const Anchor& anchor) {
  return absl::StrCat(Word(anchor.state),
                      anchor.state == AnchorState::kPaused ? " (do not trust)" : "");
}

std::string Table(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], Width(row[i]));
  }
  std::string out;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      absl::StrAppend(&line, row[i], std::string(widths[i] - Width(row[i]) + 2, ' '));
    }
    line.erase(line.find_last_not_of(' ') + 1);
    absl::StrAppend(&out, line, "\n");
  }
  return out;
}

}  // namespace saccade::cli
