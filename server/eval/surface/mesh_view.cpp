#include "server/eval/surface/mesh_view.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "server/eval/output_file.hpp"

namespace saccade {
namespace {

constexpr float kNearest = 0.02f;  // of what is drawn

struct Corner {
  Eigen::Vector3f in_camera;
  float u = 0, v = 0;
};

class MeshPainter {
 public:
  MeshPainter(const WholeMesh& mesh, MeshView& view) : mesh_(mesh), view_(view) {}

  void Draw(const std::array<std::uint32_t, 3>& t, const std::vector<Corner>& corners) {
    const Corner &a = corners[t[0]], &b = corners[t[1]], &c = corners[t[2]];
    if (std::min({a.in_camera.z(), b.in_camera.z(), c.in_camera.z()}) < kNearest) return;
    const Eigen::Vector3f normal =
        (b.in_camera - a.in_camera).cross(c.in_camera - a.in_camera).normalized();
    const float facing = -normal.dot(a.in_camera.normalized());
    if (!(facing > 0.0f)) return;
    const float area = (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
    if (std::abs(area) < 1e-9f) return;
    const int x0 = std::max(0, static_cast<int>(std::ceil(std::min({a.u, b.u, c.u}))));
    const int x1 =
        std::min(view_.depth.cols - 1, static_cast<int>(std::floor(std::max({a.u, b.u, c.u}))));
    const int y0 = std::max(0, static_cast<int>(std::ceil(std::min({a.v, b.v, c.v}))));
    const int y1 =
        std::min(view_.depth.rows - 1, static_cast<int>(std::floor(std::max({a.v, b.v, c.v}))));
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const float fx = static_cast<float>(x), fy = static_cast<float>(y);
        const float wb = ((fx - a.u) * (c.v - a.v) - (fy - a.v) * (c.u - a.u)) / area;
        const float wc = ((b.u - a.u) * (fy - a.v) - (b.v - a.v) * (fx - a.u)) / area;
        const float wa = 1.0f - wb - wc;
        if (wa < -1e-4f || wb < -1e-4f || wc < -1e-4f) continue;
        const float inverse = wa / a.in_camera.z() + wb / b.in_camera.z() + wc / c.in_camera.z();
        const float z = 1.0f / inverse;
        float& depth = view_.depth.at<float>(y, x);
        if (depth > 0.0f && depth <= z) continue;
        depth = z;
        Paint(t, {wa, wb, wc}, facing, x, y);
      }
    }
  }

 private:
  void Paint(const std::array<std::uint32_t, 3>& t, const std::array<float, 3>& weights,
             float facing, int x, int y) {
    cv::Vec3f color(0, 0, 0);
    for (int k = 0; k < 3; ++k) color += weights[k] * cv::Vec3f(mesh_.colors_bgr[t[k]]);
    view_.color.at<cv::Vec3b>(y, x) = color;
    const auto grey = static_cast<std::uint8_t>(40.0f + 200.0f * facing);
    view_.shaded.at<cv::Vec3b>(y, x) = {grey, grey, grey};
  }

  const WholeMesh& mesh_;
  MeshView& view_;
};

template <typename T>
void Append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

}  // namespace

WholeMesh JoinChunks(const SurfaceFusion::Chunks& chunks) {
  WholeMesh mesh;
  for (const auto& [index, chunk] : chunks) {
    const auto first = static_cast<std::uint32_t>(mesh.points.size());
    for (std::size_t i = 0; i < chunk->positions.size(); ++i) {
      mesh.points.push_back(chunk->Point(i));
      const auto& [r, g, b] = chunk->colors_rgb[i];
      mesh.colors_bgr.emplace_back(b, g, r);
    }
    for (const SurfaceChunk::Triangle& t : chunk->triangles) {
      mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }
  mesh.normals.assign(mesh.points.size(), Eigen::Vector3f::Zero());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3f normal =
        (mesh.points[b] - mesh.points[a]).cross(mesh.points[c] - mesh.points[a]);
    for (const std::uint32_t corner : {a, b, c}) mesh.normals[corner] += normal;
  }
  for (Eigen::Vector3f& normal : mesh.normals) {
    if (normal.norm() > 0.0f) normal.normalize();
  }
  return mesh;
}

absl::Status WritePly(const std::filesystem::path& file, const WholeMesh& mesh) {
  std::string bytes = absl::StrCat(
      "ply\nformat binary_little_endian 1.0\nelement vertex ", mesh.points.size(),
      "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar "
      "green\nproperty uchar blue\nelement face ",
      mesh.triangles.size(), "\nproperty list uchar int vertex_indices\nend_header\n");
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) Append(bytes, mesh.points[i][axis]);
    for (int c = 2; c >= 0; --c) Append(bytes, mesh.colors_bgr[i][c]);
  }
  for (const auto& triangle : mesh.triangles) {
    Append(bytes, std::uint8_t{3});
    for (const std::uint32_t corner : triangle) Append(bytes, corner);
  }
  return WriteFileAtomically(file, bytes);
}

MeshView DrawMesh(const WholeMesh& mesh, const Pinhole& camera, const Rigid3& world_from_camera) {
  const cv::Size size(camera.width, camera.height);
  MeshView view{cv::Mat::zeros(size, CV_32F), cv::Mat(size, CV_8UC3, cv::Scalar(90, 40, 40)),
                cv::Mat(size, CV_8UC3, cv::Scalar(90, 40, 40))};
  const Eigen::Matrix3f turn = world_from_camera.RotationMatrix().transpose().cast<float>();
  const Eigen::Vector3f centre = world_from_camera.translation.cast<float>();
  std::vector<Corner> corners(mesh.points.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3f point = turn * (mesh.points[i] - centre);
    corners[i] = {point, camera.focal_px * point.x() / point.z() + camera.cx,
                  camera.focal_px * point.y() / point.z() + camera.cy};
  }
  MeshPainter painter(mesh, view);
  for (const auto& triangle : mesh.triangles) painter.Draw(triangle, corners);
  return view;
}

}  // namespace saccade
