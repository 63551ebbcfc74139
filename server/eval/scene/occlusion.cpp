#include "server/eval/scene/occlusion.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "server/eval/output_file.hpp"
#include "server/eval/scene/random_room.hpp"
#include "server/eval/scene/room_mesh.hpp"
#include "server/scene/scene_view.hpp"
#include "server/sim/room.hpp"
#include "server/sim/sim_source.hpp"
#include "shared/models/shapes.hpp"

namespace saccade {
namespace {

using Eigen::Vector3d;

constexpr int kShownPictures = 8;
constexpr std::int64_t kLeastPixels = 2000;

/// How far the first triangle is along a ray (Moeller and Trumbore 1997); infinite if there is
/// none.
double FirstHit(const std::vector<std::array<Vector3d, 3>>& triangles, const Vector3d& origin,
                const Vector3d& direction) {
  double first = std::numeric_limits<double>::infinity();
  for (const auto& t : triangles) {
    const Vector3d e1 = t[1] - t[0], e2 = t[2] - t[0], p = direction.cross(e2);
    const double det = e1.dot(p);
    if (det == 0) continue;
    const Vector3d s = origin - t[0];
    const double u = s.dot(p) / det;
    if (u < 0 || u > 1) continue;
    const Vector3d q = s.cross(e1);
    const double v = direction.dot(q) / det;
    if (v < 0 || u + v > 1) continue;
    const double way = e2.dot(q) / det;
    if (way > 0) first = std::min(first, way);
  }
  return first;
}

struct Masks {
  cv::Mat seen, hidden;  // CV_8UC1, 0 or 255
};

/// By rays; `region` is where the thing can be at all.
Masks Truth(const SimSource& source, const PlacedMesh& thing, const Rigid3& world_from_camera,
            const cv::Rect& region, double bias_m) {
  std::vector<std::array<Vector3d, 3>> triangles;
  for (const TriangleMesh::Triangle& t : thing.mesh->triangles) {
    auto& one = triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      one[k] = thing.world_from_mesh * thing.mesh->positions[t[k]].cast<double>();
    }
  }
  const CameraModel& camera = source.true_camera();
  Masks masks{cv::Mat::zeros(camera.height(), camera.width(), CV_8UC1),
              cv::Mat::zeros(camera.height(), camera.width(), CV_8UC1)};
  for (int v = region.y; v < region.y + region.height; ++v) {
    for (int u = region.x; u < region.x + region.width; ++u) {
      const std::optional<Vector3d> bearing = camera.Unproject({u, v});
      if (!bearing) continue;
      const Vector3d direction = world_from_camera.rotation * bearing->normalized();
      const double to_thing = FirstHit(triangles, world_from_camera.translation, direction);
      if (!std::isfinite(to_thing)) continue;
      const std::optional<double> to_room =
          source.SurfaceAlong(world_from_camera.translation, direction);
      // The bias is along the optic axis.
      const double slack_m = bias_m / bearing->normalized().z();
      const bool seen = !to_room || to_thing < *to_room + slack_m;
      (seen ? masks.seen : masks.hidden).at<std::uint8_t>(v, u) = 255;
    }
  }
  return masks;
}

cv::Mat Alpha(const cv::Mat& bgra) {
  cv::Mat mask(bgra.size(), CV_8UC1);
  for (int row = 0; row < bgra.rows; ++row) {
    for (int column = 0; column < bgra.cols; ++column) {
      mask.at<std::uint8_t>(row, column) = bgra.at<cv::Vec4b>(row, column)[3] >= 128 ? 255 : 0;
    }
  }
  return mask;
}

MaskCounts Compare(const cv::Mat& drawn, const cv::Mat& truth) {
  return {cv::countNonZero(drawn & truth), cv::countNonZero(drawn | truth)};
}

/// Something about where the picture shows something, before, in or behind it.
std::optional<PlacedMesh> RandomPlaced(const SimSource& source, std::uint64_t frame,
                                       std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const CameraModel& camera = source.true_camera();
  const Eigen::Vector2d pixel(camera.width() * (0.25 + 0.5 * unit(random)),
                              camera.height() * (0.25 + 0.5 * unit(random)));
  const std::optional<Vector3d> surface = source.PointAt(frame, pixel);
  if (!surface) return std::nullopt;
  NamedMesh thing = RandomThing(random);
  Vector3d low = Vector3d::Constant(1e9), high = -low;
  for (const Eigen::Vector3f& p : thing.mesh.positions) {
    low = low.cwiseMin(p.cast<double>());
    high = high.cwiseMax(p.cast<double>());
  }
  const Rigid3 pose = source.WorldFromCamera(frame);
  const double distance = (*surface - pose.translation).norm();
  const double scale = (0.25 + 0.4 * unit(random)) * distance / (high - low).norm();
  const Eigen::Quaterniond turn(Eigen::Vector4d(unit(random) - 0.5, unit(random) - 0.5,
                                                unit(random) - 0.5, unit(random) - 0.5)
                                    .normalized());
  const Vector3d middle =
      pose.translation + (0.85 + 0.25 * unit(random)) * (*surface - pose.translation);
  PlacedMesh placed;
  auto scaled = std::make_shared<TriangleMesh>();
  Append(thing.mesh, Rigid3(), scale, *scaled);
  placed.mesh = std::move(scaled);
  placed.world_from_mesh = {turn, middle - turn * (0.5 * scale * (low + high))};
  placed.material = SceneMaterial::kGuide;  // as kVirtual, without a shadow, which is no part of it
  return placed;
}

/// A rectangle that holds every corner in view, and then some; the whole picture if one is behind.
cv::Rect RegionOf(const PlacedMesh& thing, const CameraModel& camera,
                  const Rigid3& world_from_camera) {
  const cv::Rect whole(0, 0, camera.width(), camera.height());
  const Rigid3 camera_from_mesh = world_from_camera.Inverse() * thing.world_from_mesh;
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  for (const Eigen::Vector3f& p : thing.mesh->positions) {
    const Vector3d point = camera_from_mesh * p.cast<double>();
    const std::optional<Eigen::Vector2d> at = camera.Project(point);
    if (point.z() < 0.05 || !at || !at->allFinite()) return whole;
    left = std::min(left, at->x());
    right = std::max(right, at->x());
    top = std::min(top, at->y());
    bottom = std::max(bottom, at->y());
  }
  const auto clamp = [](double value, int most) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(most)));
  };
  const cv::Point from(clamp(left - 8, camera.width()), clamp(top - 8, camera.height()));
  const cv::Point to(clamp(right + 8, camera.width()), clamp(bottom + 8, camera.height()));
  return cv::Rect(from, to) & whole;
}

struct Picture {
  MaskCounts seen, hidden;
  std::int64_t truly_seen = 0, truly_hidden = 0;
  MaskCounts seen_without_bias;
};

/// Draws the thing with and without the room before it.
absl::StatusOr<Picture> Measure(SimSource& source, SceneView& view, const PlacedMesh& room,
                                const PlacedMesh& thing, std::uint64_t frame,
                                const std::filesystem::path& shown) {
  const Rigid3 pose = source.WorldFromCamera(frame);
  const absl::Status alone = view.SetMeshes({thing});
  if (!alone.ok()) return alone;
  const absl::StatusOr<cv::Mat> whole = view.Draw(pose);
  if (!whole.ok()) return whole.status();
  const absl::Status both = view.SetMeshes({room, thing});
  if (!both.ok()) return both;
  const absl::StatusOr<cv::Mat> drawn = view.Draw(pose);
  if (!drawn.ok()) return drawn.status();

  const cv::Rect region = RegionOf(thing, source.true_camera(), pose);
  const Masks truth = Truth(source, thing, pose, region, kOcclusionBias_m);
  const Masks exact = Truth(source, thing, pose, region, 0.0);
  const cv::Mat seen = Alpha(*drawn), all = Alpha(*whole);
  Picture picture{Compare(seen, truth.seen), Compare(all & ~seen, truth.hidden),
                  cv::countNonZero(truth.seen), cv::countNonZero(truth.hidden),
                  Compare(seen, exact.seen)};
  if (shown.empty()) return picture;
  absl::StatusOr<cv::Mat> clean = source.RenderClean(frame);
  if (!clean.ok()) return clean.status();
  Blend(*drawn, *clean);
  if (!cv::imwrite(shown.string(), *clean)) {
    return absl::UnavailableError(absl::StrCat(shown.string(), ": cannot be written"));
  }
  return picture;
}

void Count(const Picture& one, OcclusionSummary& summary) {
  ++summary.pictures;
  summary.seen.Add(one.seen);
  summary.hidden.Add(one.hidden);
  summary.seen_without_bias.Add(one.seen_without_bias);
  const std::int64_t all = one.truly_seen + one.truly_hidden;
  if (10 * one.truly_seen >= all && 10 * one.truly_hidden >= all && all > 0) {
    ++summary.partly_hidden;
  }
  if (one.truly_seen >= kLeastPixels) {
    summary.worst_seen_iou = std::min(summary.worst_seen_iou, one.seen.Iou());
  }
  if (one.truly_hidden >= kLeastPixels) {
    summary.worst_hidden_iou = std::min(summary.worst_hidden_iou, one.hidden.Iou());
  }
}

absl::Status WriteReport(std::uint64_t seed, const OcclusionSummary& summary,
                         const std::filesystem::path& out) {
  const nlohmann::json report = {{"seed", seed},
                                 {"pictures", summary.pictures},
                                 {"partly_hidden", summary.partly_hidden},
                                 {"seen_iou", summary.seen.Iou()},
                                 {"hidden_iou", summary.hidden.Iou()},
                                 {"seen_pixels", summary.seen.either},
                                 {"hidden_pixels", summary.hidden.either},
                                 {"worst_seen_iou", summary.worst_seen_iou},
                                 {"worst_hidden_iou", summary.worst_hidden_iou},
                                 {"bias_m", kOcclusionBias_m},
                                 {"seen_iou_without_bias", summary.seen_without_bias.Iou()},
                                 {"limit", 0.99}};
  return WriteFileAtomically(out / "report.json", report.dump(1) + "\n");
}

}  // namespace

absl::StatusOr<OcclusionSummary> RunOcclusion(std::uint64_t seed, int count,
                                              const std::filesystem::path& out) {
  if (absl::Status made = CreateFolder(out); !made.ok()) return made;
  absl::StatusOr<OutputFile> csv = OutputFile::Create(out / "occlusion.csv");
  if (!csv.ok()) return csv.status();
  csv->Write("picture,frame,truly_seen_px,truly_hidden_px,seen_iou,hidden_iou\n");
  absl::StatusOr<std::unique_ptr<SimSource>> source =
      SimSource::OpenUri(absl::StrCat("desk?motion=walk&seed=", seed), {});
  if (!source.ok()) return source.status();
  absl::StatusOr<std::unique_ptr<SceneView>> view = SceneView::Create(
      (*source)->true_camera(), GlBackend::kOsmesa, EnoughSupersampling((*source)->true_camera()));
  if (!view.ok()) return view.status();
  PlacedMesh room;
  room.mesh = std::make_shared<TriangleMesh>(RoomMeshOf(BuildRoom(seed)));
  std::seed_seq seeds{seed};
  std::mt19937_64 random(seeds);
  OcclusionSummary summary;
  for (std::uint64_t frame = 0; summary.pictures < count; frame += 7) {
    const std::optional<PlacedMesh> thing = RandomPlaced(**source, frame, random);
    if (!thing) continue;
    const std::filesystem::path shown =
        summary.pictures < kShownPictures
            ? out / absl::StrFormat("picture-%d.png", summary.pictures)
            : std::filesystem::path();
    const absl::StatusOr<Picture> one = Measure(**source, **view, room, *thing, frame, shown);
    if (!one.ok()) return one.status();
    csv->Write(absl::StrFormat("%d,%d,%d,%d,%.5f,%.5f\n", summary.pictures, frame, one->truly_seen,
                               one->truly_hidden, one->seen.Iou(), one->hidden.Iou()));
    Count(*one, summary);
  }
  if (absl::Status written = csv->Close(); !written.ok()) return written;
  if (absl::Status written = WriteReport(seed, summary, out); !written.ok()) return written;
  return summary;
}

}  // namespace saccade
