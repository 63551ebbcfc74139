#pragma once

#include <absl/strings/string_view.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/net/types.hpp"

/// Domain types as words and as JSON. The same words as in the interface and the API; units are in
/// the JSON names. Integers above 2^53, which many readers of JSON would round, are strings; names
/// in `_ns` always are. `metric`: whether the map has metres; without, no length is given. Pure
/// functions.
namespace saccade::cli {

absl::string_view Word(TrackingStatus status);
absl::string_view Word(TrackingQuality quality);
absl::string_view Word(FeatureState state);
absl::string_view Word(AnnotationShape shape);
absl::string_view Word(AnchorState state);
absl::string_view Word(AnchorMethod method);
absl::string_view Word(net::Role role);

nlohmann::json ToJson(const MapSnapshot& pose);
nlohmann::json ToJson(const net::Statistics& statistics);
nlohmann::json ToJson(const net::ServerStatus& status);
nlohmann::json ToJson(const net::MapState& map);
nlohmann::json ToJson(const Annotation& annotation, bool metric);
nlohmann::json ToJson(const std::vector<Annotation>& annotations, bool metric);
nlohmann::json ToJson(const net::WatchEvent& event, bool metric);
nlohmann::json ToJson(const GazeSnapshot& state);
nlohmann::json ToJson(const MountCalibrationReport& report);
/// What was found, for people: joints, residuals, delays.
std::string CalibrationText(const MountCalibrationReport& report);

/// "x 0.123 y -0.045 z 1.200 m"; of a world without scale, without the unit.
std::string PointText(const Eigen::Vector3d& point, bool metric);
/// The anchor's point, or "place not known" (in this map).
std::string PlaceText(const Anchor& anchor);
/// "0.8 px 3 mm", "out of view 53 cm", "0.8 px, scale unknown" or "place not known".
std::string ErrorText(const Anchor& anchor, bool metric);
/// "tracking"; "paused (do not trust)".
std::string StateText(const Anchor& anchor);
/// JSON as it is printed: what is not UTF-8 is replaced. `indent` below 0: on one line.
std::string Dump(const nlohmann::json& json, int indent = -1);
/// Columns padded to the same width, two blanks apart, one row a line.
std::string Table(const std::vector<std::vector<std::string>>& rows);

}  // namespace saccade::cli
