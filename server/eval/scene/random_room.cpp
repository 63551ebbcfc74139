#include "server/eval/scene/random_room.hpp"

#include <cmath>
#include <functional>

#include "shared/models/shapes.hpp"

namespace saccade {
namespace {

using Eigen::Vector3d;

double Between(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
int Whole(std::mt19937_64& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}

void AddBox(const Vector3d& base, const Vector3d& size, TriangleMesh& mesh) {
  Append(BoxMesh(size, 0xb4b4b4ff), {Eigen::Quaterniond::Identity(), base}, 1.0, mesh);
}

TriangleMesh Table(std::mt19937_64& random) {
  const double x = Between(random, 0.4, 1.6), z = Between(random, 0.4, 0.9);
  const double height = Between(random, 0.35, 0.8), leg = Between(random, 0.03, 0.07);
  TriangleMesh mesh;
  AddBox({0, -height, 0}, {x, 0.03, z}, mesh);
  for (const double sx : {-0.5, 0.5}) {
    for (const double sz : {-0.5, 0.5}) {
      AddBox({sx * (x - leg), 0, sz * (z - leg)}, {leg, height, leg}, mesh);
    }
  }
  return mesh;
}

/// Sides, back and boards; its front is open.
TriangleMesh Shelf(std::mt19937_64& random) {
  const double x = Between(random, 0.5, 1.2), z = Between(random, 0.25, 0.45);
  const double height = Between(random, 0.6, 1.9), board = 0.02;
  TriangleMesh mesh;
  for (const double side : {-0.5, 0.5})
    AddBox({side * (x - board), 0, 0}, {board, height, z}, mesh);
  AddBox({0, 0, 0.5 * (z - board)}, {x - 2.02 * board, height, board}, mesh);
  const int boards = Whole(random, 2, 5);
  for (int i = 0; i < boards; ++i) {
    AddBox({0, -i * (height - board) / (boards - 1), -0.51 * board},
           {x - 2.02 * board, board, z - 1.1 * board}, mesh);
  }
  return mesh;
}

/// A polygon (counter-clockwise as seen from above, z up the page) with a height; may be concave if
/// its corner 0 sees all others.
TriangleMesh Prism(const std::vector<Eigen::Vector2d>& outline, double height) {
  TriangleMesh mesh;
  const auto count = static_cast<std::uint32_t>(outline.size());
  for (const double y : {0.0, -height}) {
    for (const Eigen::Vector2d& p : outline) {
      mesh.positions.push_back(Vector3d(p.x(), y, p.y()).cast<float>());
    }
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    mesh.triangles.push_back({i, next, count + next});
    mesh.triangles.push_back({i, count + next, count + i});
    if (i == 0 || next == 0) continue;
    mesh.triangles.push_back({0, next, i});
    mesh.triangles.push_back({count, count + i, count + next});
  }
  return mesh;
}

TriangleMesh LShape(std::mt19937_64& random) {
  const double a = Between(random, 0.6, 1.6), b = Between(random, 0.6, 1.4);
  const double w = Between(random, 0.2, 0.5);
  return Prism({{w, w}, {w, b}, {0, b}, {0, 0}, {a, 0}, {a, w}}, Between(random, 0.2, 0.9));
}

TriangleMesh Star(std::mt19937_64& random) {
  const int points = Whole(random, 3, 8);
  const double outer = Between(random, 0.15, 0.4), inner = outer * Between(random, 0.35, 0.7);
  std::vector<Eigen::Vector2d> outline;
  for (int i = 0; i < 2 * points; ++i) {
    const double angle = M_PI * i / points, r = i % 2 ? inner : outer;
    outline.emplace_back(r * std::cos(angle), r * std::sin(angle));
  }
  // From its middle every corner is seen, from a corner not.
  TriangleMesh mesh = Prism(outline, Between(random, 0.1, 0.8));
  const auto count = static_cast<std::uint32_t>(outline.size());
  std::erase_if(mesh.triangles, [&](const TriangleMesh::Triangle& t) {
    return (t[0] < count) == (t[1] < count) && (t[1] < count) == (t[2] < count);
  });
  const float top = mesh.positions[count].y();
  mesh.positions.emplace_back(0, 0, 0);
  mesh.positions.emplace_back(0, top, 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    mesh.triangles.push_back({2 * count, next, i});
    mesh.triangles.push_back({2 * count + 1, count + i, count + next});
  }
  return mesh;
}

/// A closed grid round two angles: ring, ball or pipe by `at`.
TriangleMesh Grid(int columns, int rows, bool round_rows,
                  const std::function<Vector3d(double, double)>& at) {
  TriangleMesh mesh;
  for (int j = 0; j < rows + (round_rows ? 0 : 1); ++j) {
    for (int i = 0; i < columns; ++i) {
      mesh.positions.push_back(
          at(static_cast<double>(i) / columns, static_cast<double>(j) / rows).cast<float>());
    }
  }
  const auto index = [&](int i, int j) {
    return static_cast<std::uint32_t>((round_rows ? j % rows : j) * columns + i % columns);
  };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      mesh.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
      mesh.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
    }
  }
  return mesh;
}

TriangleMesh Ring(std::mt19937_64& random) {
  const double big = Between(random, 0.15, 0.5), thin = big * Between(random, 0.12, 0.4);
  return Grid(Whole(random, 12, 40), Whole(random, 6, 24), true, [=](double s, double t) {
    const double a = 2 * M_PI * s, b = 2 * M_PI * t;
    const double r = big + thin * std::cos(b);
    return Vector3d(r * std::cos(a), thin * std::sin(b) - thin, r * std::sin(a));
  });
}

TriangleMesh Ball(std::mt19937_64& random) {
  const double r = Between(random, 0.08, 0.35);
  const int columns = Whole(random, 8, 30), rows = Whole(random, 6, 16);
  // Its poles are many corners in one place.
  return Grid(columns, rows, false, [=](double s, double t) {
    const double a = 2 * M_PI * s, b = M_PI * t;
    const double ring = t <= 0 || t >= 1 ? 0.0 : r * std::sin(b);
    return Vector3d(ring * std::cos(a), r * std::cos(b) - r, ring * std::sin(a));
  });
}

/// Two posts and a bent beam on them.
TriangleMesh Arch(std::mt19937_64& random) {
  const double outer = Between(random, 0.3, 0.8), inner = outer * Between(random, 0.5, 0.85);
  const double depth = Between(random, 0.1, 0.5);
  const int steps = Whole(random, 6, 20);
  return Grid(4, steps, false, [=](double s, double t) {
    const double a = M_PI * t;
    const double r = s < 0.25 || s > 0.7 ? outer : inner;
    const double z = s < 0.45 ? -0.5 * depth : 0.5 * depth;
    return Vector3d(r * std::cos(a), -r * std::sin(a), z);
  });
}

TriangleMesh Box(std::mt19937_64& random) {
  return BoxMesh({Between(random, 0.1, 1.2), Between(random, 0.05, 1.5), Between(random, 0.1, 0.8)},
                 0xb4b4b4ff);
}

/// The ends of an arch are open: two faces each close them.
TriangleMesh ClosedArch(std::mt19937_64& random) {
  TriangleMesh mesh = Arch(random);
  const auto last = static_cast<std::uint32_t>(mesh.positions.size() - 4);
  mesh.triangles.push_back({0, 2, 1});
  mesh.triangles.push_back({0, 3, 2});
  mesh.triangles.push_back({last, last + 1, last + 2});
  mesh.triangles.push_back({last, last + 2, last + 3});
  return mesh;
}

double SixVolumes(const TriangleMesh& mesh) {
  double sum = 0;
  for (const TriangleMesh::Triangle& t : mesh.triangles) {
    sum += mesh.positions[t[0]].cast<double>().dot(
        mesh.positions[t[1]].cast<double>().cross(mesh.positions[t[2]].cast<double>()));
  }
  return sum;
}

using Maker = TriangleMesh (*)(std::mt19937_64&);
constexpr std::array<std::pair<const char*, Maker>, 8> kMakers = {{{"box", Box},
                                                                   {"table", Table},
                                                                   {"shelf", Shelf},
                                                                   {"bench", LShape},
                                                                   {"star", Star},
                                                                   {"ring", Ring},
                                                                   {"ball", Ball},
                                                                   {"arch", ClosedArch}}};

}  // namespace

NamedMesh RandomThing(std::mt19937_64& random) {
  const auto& [name, make] = kMakers[static_cast<std::size_t>(Whole(random, 0, 7))];
  NamedMesh thing{name, make(random), {}};
  if (SixVolumes(thing.mesh) < 0) {
    for (TriangleMesh::Triangle& t : thing.mesh.triangles) std::swap(t[1], t[2]);
  }
  return thing;
}

std::vector<NamedMesh> RandomRoom(std::mt19937_64& random) {
  const Vector3d size(Between(random, 3, 7), Between(random, 2.2, 3.2), Between(random, 3, 7));
  const Eigen::Quaterniond turned(
      Eigen::AngleAxisd(Between(random, -M_PI, M_PI), Vector3d::UnitY()));
  const Rigid3 world_from_room{turned, {Between(random, -3, 3), 0, Between(random, -3, 3)}};
  std::vector<NamedMesh> all = {{"room", RoomMesh(size, 0xb4b4b4ff), world_from_room}};
  const int count = Whole(random, 4, 12);
  for (int i = 0; i < count; ++i) {
    NamedMesh thing = RandomThing(random);
    Eigen::Quaterniond turn(Eigen::AngleAxisd(Between(random, -M_PI, M_PI), Vector3d::UnitY()));
    double up = Whole(random, 0, 2) == 0 ? Between(random, 0, 0.6 * size.y()) : 0.0;
    if (Whole(random, 0, 3) == 0) {  // on a slant, sunk into the floor
      turn = turn * Eigen::AngleAxisd(Between(random, -0.6, 0.6), Vector3d::UnitX()) *
             Eigen::AngleAxisd(Between(random, -0.6, 0.6), Vector3d::UnitZ());
      up -= 0.1;
    }
    const Vector3d at(Between(random, -0.5, 0.5) * size.x(), -up,
                      Between(random, -0.5, 0.5) * size.z());
    thing.world_from_mesh = world_from_room * Rigid3{turn, at};
    thing.name += std::to_string(i);
    all.push_back(std::move(thing));
  }
  return all;
}

}  // namespace saccade
