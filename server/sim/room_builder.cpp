#include "server/sim/room_builder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace saccade {
namespace {

constexpr int kMaxLightSamples = 96;

Eigen::Vector3f MeanRgbLinear(const cv::Mat& bgr) {
  cv::Mat small;
  cv::resize(bgr, small, {16, 16}, 0, 0, cv::INTER_AREA);
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int y = 0; y < small.rows; ++y) {
    for (int x = 0; x < small.cols; ++x) {
      const cv::Vec3b& p = small.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c) sum[c] += std::pow(static_cast<float>(p[2 - c]) / 255.0f, 2.2f);
    }
  }
  return sum / static_cast<float>(small.total());
}

}  // namespace

int RoomBuilder::AddTexture(const cv::Mat& bgr, bool repeat) {
  scene_.textures.push_back({bgr, repeat, MeanRgbLinear(bgr)});
  return static_cast<int>(scene_.textures.size()) - 1;
}

Eigen::Isometry3f RoomBuilder::WorldFromLocal() const {
  Eigen::Isometry3f result = world_from_room_.cast<float>();
  for (const Eigen::Isometry3f& frame : frames_) result = result * frame;
  return result;
}

void RoomBuilder::Push(const Eigen::Vector3f& origin, float turn_y_rad, float tilt_x_rad,
                       float roll_z_rad) {
  Eigen::Isometry3f frame = Eigen::Isometry3f::Identity();
  frame.translate(origin);
  frame.rotate(Eigen::AngleAxisf(turn_y_rad, Eigen::Vector3f::UnitY()));
  frame.rotate(Eigen::AngleAxisf(tilt_x_rad, Eigen::Vector3f::UnitX()));
  frame.rotate(Eigen::AngleAxisf(roll_z_rad, Eigen::Vector3f::UnitZ()));
  frames_.push_back(frame);
}

void RoomBuilder::AddGrid(const Paint& paint, int columns, int rows,
                          const std::vector<Eigen::Vector3f>& local_positions,
                          const std::vector<Eigen::Vector3f>& local_normals, float width_m,
                          float height_m) {
  const Eigen::Isometry3f world_from_local = WorldFromLocal();
  SurfacePatch patch;
  patch.columns = columns;
  patch.rows = rows;
  patch.texture = paint.texture;
  patch.glow = paint.glow;
  Eigen::Vector2f size = paint.size;
  if (paint.tile_m.x() > 0) size = {width_m / paint.tile_m.x(), height_m / paint.tile_m.y()};
  for (std::size_t i = 0; i < local_positions.size(); ++i) {
    const auto column = static_cast<float>(i % static_cast<std::size_t>(columns + 1));
    const auto row = static_cast<float>(i / static_cast<std::size_t>(columns + 1));
    patch.positions.push_back(world_from_local * local_positions[i]);
    patch.normals.push_back(world_from_local.linear() * local_normals[i]);
    patch.uv.push_back(paint.origin +
                       size.cwiseProduct(Eigen::Vector2f(column / static_cast<float>(columns),
                                                         row / static_cast<float>(rows))));
  }
  const auto samples = [&](float length) {
    return std::clamp(static_cast<int>(std::lround(length / light_spacing_m_)) + 1, 2,
                      kMaxLightSamples);
  };
  patch.light_columns = samples(width_m);
  patch.light_rows = samples(height_m);
  scene_.patches.push_back(std::move(patch));
}

void RoomBuilder::Quad(const Paint& paint, const Eigen::Vector3f& top_left,
                       const Eigen::Vector3f& right, const Eigen::Vector3f& down) {
  const Eigen::Vector3f normal = down.cross(right).normalized();
  AddGrid(paint, 1, 1, {top_left, top_left + right, top_left + down, top_left + right + down},
          {normal, normal, normal, normal}, right.norm(), down.norm());
}

void RoomBuilder::Box(const BoxPaint& paint, const Eigen::Vector3f& corner,
                      const Eigen::Vector3f& size, bool with_bottom) {
  const Eigen::Vector3f far = corner + size;
  const float x0 = corner.x(), y0 = corner.y(), z0 = corner.z();
  const float x1 = far.x(), y1 = far.y(), z1 = far.z();
  Quad(paint.front, {x0, y1, z1}, {size.x(), 0, 0}, {0, -size.y(), 0});
  Quad(paint.back, {x1, y1, z0}, {-size.x(), 0, 0}, {0, -size.y(), 0});
  Quad(paint.right, {x1, y1, z1}, {0, 0, -size.z()}, {0, -size.y(), 0});
  Quad(paint.left, {x0, y1, z0}, {0, 0, size.z()}, {0, -size.y(), 0});
  Quad(paint.top, {x0, y1, z0}, {size.x(), 0, 0}, {0, 0, size.z()});
  if (with_bottom) Quad(paint.bottom, {x0, y0, z1}, {size.x(), 0, 0}, {0, 0, -size.z()});
}

void RoomBuilder::Tube(const Paint& side, const Eigen::Vector3f& base, float radius_bottom,
                       float radius_top, float height, int sides, bool inside) {
  std::vector<Eigen::Vector3f> positions, normals;
  const float slope = (radius_bottom - radius_top) / height;
  for (int row = 0; row < 2; ++row) {
    const float radius = row == 0 ? radius_top : radius_bottom;
    for (int i = 0; i <= sides; ++i) {
      // To the right as seen from outside: from +z (front) over +x.
      const float turn = (inside ? -1.0f : 1.0f) * 2.0f * std::numbers::pi_v<float> *
                         static_cast<float>(i) / static_cast<float>(sides);
      const Eigen::Vector3f out(std::sin(turn), 0, std::cos(turn));
      positions.push_back(base + radius * out + Eigen::Vector3f(0, row == 0 ? height : 0, 0));
      const Eigen::Vector3f normal = (out + Eigen::Vector3f(0, slope, 0)).normalized();
      normals.push_back(inside ? Eigen::Vector3f(-normal) : normal);
    }
  }
  AddGrid(side, sides, 1, positions, normals,
          2.0f * std::numbers::pi_v<float> * std::max(radius_bottom, radius_top), height);
}

void RoomBuilder::Disc(const Paint& paint, const Eigen::Vector3f& centre, float radius, int sides,
                       bool facing_down) {
  // A square grid of rings would waste triangles: strips across the circle keep the texture flat.
  const Eigen::Vector3f normal(0, facing_down ? -1.0f : 1.0f, 0);
  const int strips = std::max(2, sides / 2);
  std::vector<Eigen::Vector3f> positions;
  for (int row = 0; row < 2; ++row) {
    for (int i = 0; i <= strips; ++i) {
      const float angle =
          std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(strips);
      const float x = -radius * std::cos(angle), z = radius * std::sin(angle);
      const float side = (row == 0) != facing_down ? -1.0f : 1.0f;
      positions.push_back(centre + Eigen::Vector3f(x, 0, side * z));
    }
  }
  const std::size_t first = scene_.patches.size();
  AddGrid(paint, strips, 1, positions, std::vector<Eigen::Vector3f>(positions.size(), normal),
          2 * radius, 2 * radius);
  SurfacePatch& patch = scene_.patches[first];
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Eigen::Vector3f offset = (positions[i] - centre) / (2 * radius);
    patch.uv[i] = paint.origin +
                  paint.size.cwiseProduct(Eigen::Vector2f(0.5f + offset.x(), 0.5f + offset.z()));
  }
}

void RoomBuilder::Sheet(const Paint& paint, int columns, int rows,
                        const std::function<Eigen::Vector3f(float, float)>& shape, float width_m,
                        float height_m) {
  std::vector<Eigen::Vector3f> positions, normals;
  constexpr float kStep = 1e-3f;
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) {
      const float s = static_cast<float>(column) / static_cast<float>(columns);
      const float t = static_cast<float>(row) / static_cast<float>(rows);
      const float s0 = std::max(s - kStep, 0.0f), s1 = std::min(s + kStep, 1.0f);
      const float t0 = std::max(t - kStep, 0.0f), t1 = std::min(t + kStep, 1.0f);
      positions.push_back(shape(s, t));
      normals.push_back((shape(s, t1) - shape(s, t0)).cross(shape(s1, t) - shape(s0, t)));
      // A tip, where the sheet has no width, takes its neighbour's normal.
      if (normals.back().norm() < 1e-12f) {
        normals.back() =
            normals.size() > 1 ? normals[normals.size() - 2] : Eigen::Vector3f::UnitY();
      }
      normals.back().normalize();
    }
  }
  AddGrid(paint, columns, rows, positions, normals, width_m, height_m);
}

void RoomBuilder::Name(const std::string& name, const Eigen::Vector3f& point) {
  scene_.objects.push_back({name, (WorldFromLocal() * point).cast<double>()});
}

}  // namespace saccade
