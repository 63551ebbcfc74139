#pragma once

#include <absl/status/status.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "server/surface/surface_map.hpp"

namespace saccade {

/// All chunks as one: corners [map's unit, world], a normal and a colour for each.
struct WholeMesh {
  std::vector<Eigen::Vector3f> points, normals;  // normals are unit, or zero
  std::vector<cv::Vec3b> colors_bgr;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

WholeMesh JoinChunks(const SurfaceFusion::Chunks& chunks);

/// Binary PLY with colours.
absl::Status WritePly(const std::filesystem::path& file, const WholeMesh& mesh);

/// A mesh as a camera sees it, drawn without a graphics card.
struct MeshView {
  cv::Mat depth;   // CV_32FC1, along the optic axis [map's unit]; 0: nothing
  cv::Mat color;   // CV_8UC3 BGR
  cv::Mat shaded;  // CV_8UC3: by the normals alone
};

/// Triangles are seen from their front only.
MeshView DrawMesh(const WholeMesh& mesh, const Pinhole& camera, const Rigid3& world_from_camera);

}  // namespace saccade
