#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>

#include "server/eval/commands.hpp"
#include "server/eval/output_file.hpp"
#include "server/eval/trajectory.hpp"
#include "server/record/recording_reader.hpp"
#include "shared/marks/shape_lines.hpp"
#include "shared/models/glb_writer.hpp"

namespace saccade {
namespace {

constexpr Timestamp kUnixSecond_ns = 1'000'000'000;

absl::StatusOr<std::string> Tum(RecordingReader& recording, std::size_t& poses) {
  const auto all = recording.Poses();
  if (!all.ok()) return all.status();
  poses = all->size();
  std::string text = "# timestamp tx ty tz qx qy qz qw: world from camera, metres, Unix seconds\n";
  for (const RecordedPose& pose : *all) {
    const std::string when =
        absl::StrFormat("%d.%09d", pose.unix_ns / kUnixSecond_ns, pose.unix_ns % kUnixSecond_ns);
    text += TumLine(when, pose.world_from_camera);
  }
  return text;
}

absl::StatusOr<std::string> Ply(RecordingReader& recording, Timestamp at_ns,
                                std::size_t& features) {
  const auto map = recording.MapAt(at_ns);
  if (!map.ok()) return map.status();
  features = map->features.size();
  std::string text =
      absl::StrCat("ply\nformat ascii 1.0\ncomment saccade map, world frame, metres",
                   map->metric ? "" : " (scale arbitrary)", "\nelement vertex ", features,
                   "\nproperty double x\nproperty double y\nproperty double z\n"
                   "property double sigma_m\nend_header\n");
  for (const FeatureSnapshot& feature : map->features) {
    const Eigen::Vector3d& p = feature.point_in_world;
    const double sigma_m = std::sqrt(std::max(0.0, feature.covariance_in_world.trace()));
    absl::StrAppendFormat(&text, "%.6f %.6f %.6f %.6f\n", p.x(), p.y(), p.z(), sigma_m);
  }
  return text;
}

GlbPart PartOf(const SurfaceSnapshot& surface) {
  GlbPart part;
  part.name = "surfaces";
  for (const auto& [index, chunk] : surface.chunks) {
    const auto first = static_cast<std::uint32_t>(part.positions.size());
    for (std::size_t i = 0; i < chunk->positions.size(); ++i) {
      const auto& rgb = chunk->colors_rgb[i];
      part.positions.push_back(chunk->Point(i));
      part.colors_rgba.insert(part.colors_rgba.end(), {rgb[0], rgb[1], rgb[2], 255});
    }
    for (const SurfaceChunk::Triangle& triangle : chunk->triangles) {
      for (const std::uint16_t corner : triangle) part.triangles.push_back(first + corner);
    }
  }
  return part;
}

/// Named by what its label says.
GlbPart PartOf(const Annotation& annotation, bool metric) {
  GlbPart part;
  part.name = LabelWords(annotation, metric);
  if (part.name.empty()) part.name = annotation.id;
  part.color_rgba = annotation.color_rgba;
  for (const Polyline3& line : ShapeLines(annotation)) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      const auto at = static_cast<std::uint32_t>(part.positions.size());
      if (i > 0) part.lines.insert(part.lines.end(), {at - 1, at});
      part.positions.push_back(line[i].cast<float>());
    }
  }
  return part;
}

absl::StatusOr<std::string> Glb(RecordingReader& recording, Timestamp at_ns,
                                std::size_t& triangles) {
  const auto scene = recording.SceneAt(at_ns);
  if (!scene.ok()) return scene.status();
  std::vector<GlbPart> parts = {PartOf(*scene->surface)};
  triangles = parts[0].triangles.size() / 3;
  for (const Annotation& annotation : *scene->annotations) {
    const bool known =
        annotation.anchor.place_known && annotation.anchor.state != AnchorState::kStopped;
    if (known) parts.push_back(PartOf(annotation, scene->metric));
  }
  return WriteGlb(parts);
}

}  // namespace

absl::Status ReplayCommand(const ReplayArguments& arguments) {
  const auto recording = RecordingReader::Open(arguments.file);
  if (!recording.ok()) return recording.status();
  McapReader& mcap = (*recording)->mcap();
  if (!mcap.whole()) {
    std::cerr << arguments.file.string() << ": was not ended; its whole chunks are read\n";
  }
  if (arguments.at_s && !(*arguments.at_s >= 0)) {
    return absl::InvalidArgumentError("--at: give seconds from 0");
  }
  const Timestamp at_ns =
      arguments.at_s
          ? std::min(mcap.last_ns(),
                     mcap.first_ns() + static_cast<Timestamp>(*arguments.at_s * kUnixSecond_ns))
          : mcap.last_ns();
  if (absl::Status made = CreateFolder(arguments.out); !made.ok()) return made;
  std::size_t count = 0;
  const bool tum = arguments.form == "tum", glb = arguments.form == "glb";
  const auto bytes = tum   ? Tum(**recording, count)
                     : glb ? Glb(**recording, at_ns, count)
                           : Ply(**recording, at_ns, count);
  if (!bytes.ok()) return bytes.status();
  const std::filesystem::path file = arguments.out / (tum   ? "trajectory.tum"
                                                      : glb ? "scene.glb"
                                                            : "map.ply");
  if (absl::Status written = WriteFileAtomically(file, *bytes); !written.ok()) return written;
  std::cout << file.string() << ": " << count
            << (tum   ? " poses"
                : glb ? " triangles"
                      : " features")
            << "\n";
  return absl::OkStatus();
}

}  // namespace saccade
