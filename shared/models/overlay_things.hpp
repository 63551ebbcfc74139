#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <span>
#include <vector>

#include "shared/scene/triangle_mesh.hpp"

namespace saccade {

// What is laid over a room to explain it (Koller et al. 1997, figure 7), as meshes in the frame of
// a scene's objects: x right, y down, z away [m].

/// A tube round a way of at least two points: a pipe, a cable.
TriangleMesh TubeMesh(std::span<const Eigen::Vector3d> way, double radius_m,
                      std::uint32_t color_rgba);
/// Lines on the floor, `step_m` apart, over size_x by size_z, its middle at the origin.
TriangleMesh FloorGridMesh(double size_x_m, double size_z_m, double step_m,
                           std::uint32_t color_rgba);
/// Arrow heads on the floor along a way, each pointing where it leads, the last one larger.
TriangleMesh RouteMesh(std::span<const Eigen::Vector3d> way, double width_m,
                       std::uint32_t color_rgba);
/// An arrow with a round shaft from one point to another.
TriangleMesh ArrowMesh(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius_m,
                       std::uint32_t color_rgba);
/// A picture that hangs: `pixels` row by row from its top left corner, `columns` a row, each a
/// square of one colour; from the origin's middle of its base upwards, seen from -z.
TriangleMesh PictureMesh(std::span<const std::uint32_t> pixels_rgba, int columns, double width_m);

}  // namespace saccade
