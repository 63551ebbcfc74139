#include "server/eval/g2o_file.hpp"

#include <absl/strings/escaping.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>

#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <span>

#include "server/eval/output_file.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 30;
constexpr std::size_t kMaxLine = 4096;
constexpr double kUnit = 0.05;  // how far from 1 the length of a written quaternion may be

using Fields = std::vector<absl::string_view>;

constexpr absl::string_view kForm =
    "; write `VERTEX_SE3:QUAT id x y z qx qy qz qw`, `EDGE_SE3:QUAT from to x y z qx qy qz qw` and "
    "21 numbers of information, `VERTEX_SE2 id x y angle`, `EDGE_SE2 from to x y angle` and 6, or "
    "`FIX id`";

/// Rows of the upper triangle, one after the other, as a symmetric matrix.
Eigen::MatrixXd Symmetric(std::span<const double> upper, int size) {
  Eigen::MatrixXd matrix(size, size);
  std::size_t k = 0;
  for (int row = 0; row < size; ++row) {
    for (int column = row; column < size; ++column) {
      matrix(row, column) = matrix(column, row) = upper[k++];
    }
  }
  return matrix;
}

std::string UpperText(const Eigen::MatrixXd& matrix) {
  std::string text;
  for (int row = 0; row < matrix.rows(); ++row) {
    for (int column = row; column < matrix.cols(); ++column) {
      absl::StrAppendFormat(&text, " %.9g", matrix(row, column));
    }
  }
  return text;
}

Rigid3 Planar(double x, double y, double angle) {
  return {ExpQuaternion({0.0, 0.0, angle}), {x, y, 0.0}};
}

/// What the plane leaves free is held by an information of 1; half an angle is what a quaternion
/// has.
PoseGraphEdge::Information FromPlanar(const Eigen::Matrix3d& planar) {
  constexpr std::array<int, 3> kAt = {0, 1, 5};
  PoseGraphEdge::Information all = PoseGraphEdge::Information::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const double scale = (row == 2 ? 2.0 : 1.0) * (column == 2 ? 2.0 : 1.0);
      all(kAt[row], kAt[column]) = scale * planar(row, column);
    }
  }
  return all;
}

Eigen::Matrix3d ToPlanar(const PoseGraphEdge::Information& all) {
  constexpr std::array<int, 3> kAt = {0, 1, 5};
  Eigen::Matrix3d planar;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const double scale = (row == 2 ? 0.5 : 1.0) * (column == 2 ? 0.5 : 1.0);
      planar(row, column) = scale * all(kAt[row], kAt[column]);
    }
  }
  return planar;
}

class Reader {
 public:
  absl::Status Line(absl::string_view text) {
    const Fields fields = absl::StrSplit(text, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    if (fields.empty() || fields[0].front() == '#') return absl::OkStatus();
    if (fields[0] == "VERTEX_SE3:QUAT") return Vertex(fields, 7);
    if (fields[0] == "VERTEX_SE2") return Vertex(fields, 3);
    if (fields[0] == "EDGE_SE3:QUAT") return Edge(fields, 7);
    if (fields[0] == "EDGE_SE2") return Edge(fields, 3);
    if (fields[0] == "FIX") return Fix(fields);
    return absl::InvalidArgumentError(
        absl::StrCat("`", absl::CHexEscape(fields[0].substr(0, 40)), "` is not known"));
  }

  /// Once all lines are read; the error says at which line.
  absl::StatusOr<G2oGraph> Finish() {
    if (edges_.empty()) {
      line_ = last_line_;
      return absl::InvalidArgumentError("the file ends without an edge: is it cut short");
    }
    G2oGraph result;
    result.planar = *planar_;
    result.placed = !vertices_.empty();
    if (!result.placed) {
      for (const NumberedEdge& edge : edges_) vertices_[edge.from], vertices_[edge.to];
    }
    std::map<std::int64_t, int> index;
    for (const auto& [id, node] : vertices_) {
      index[id] = static_cast<int>(result.ids.size());
      result.ids.push_back(id);
      result.graph.nodes.push_back(node);
    }
    for (NumberedEdge& edge : edges_) {
      for (const std::int64_t id : {edge.from, edge.to}) {
        if (index.contains(id)) continue;
        line_ = edge.line;
        return absl::InvalidArgumentError(absl::StrCat("vertex ", id, " is not in the file"));
      }
      edge.edge.from = index[edge.from];
      edge.edge.to = index[edge.to];
      result.graph.edges.push_back(edge.edge);
    }
    for (const auto& [id, line] : fixed_) {
      if (!index.contains(id)) {
        line_ = line;
        return absl::InvalidArgumentError(absl::StrCat("vertex ", id, " is not in the file"));
      }
      result.graph.nodes[index[id]].held = true;
    }
    return result;
  }

  void At(int line) { line_ = last_line_ = line; }
  int line() const { return line_; }

 private:
  struct NumberedEdge {
    std::int64_t from = 0, to = 0;
    PoseGraphEdge edge;
    int line = 0;
  };

  static absl::Status Id(absl::string_view text, std::int64_t* id) {
    if (absl::SimpleAtoi(text, id) && *id >= 0) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat("`", absl::CHexEscape(text.substr(0, 40)), "` is not the number of a vertex"));
  }

  /// `count` numbers from field `first` to the end of the line.
  static absl::StatusOr<std::vector<double>> Numbers(const Fields& fields, std::size_t first,
                                                     std::size_t count) {
    if (fields.size() != first + count) {
      return absl::InvalidArgumentError(absl::StrCat(fields[0], " has ", fields.size() - 1,
                                                     " values, not ", first + count - 1,
                                                     ": is the line cut short"));
    }
    std::vector<double> numbers(count);
    for (std::size_t k = 0; k < count; ++k) {
      if (!absl::SimpleAtod(fields[first + k], &numbers[k]) || !std::isfinite(numbers[k])) {
        return absl::InvalidArgumentError(absl::StrCat(
            "value ", first + k, ", `", absl::CHexEscape(fields[first + k].substr(0, 40)),
            "`, is not a finite number"));
      }
    }
    return numbers;
  }

  absl::Status Pose(std::span<const double> numbers, Rigid3* pose) {
    const bool planar = numbers.size() == 3;
    if (planar_ && *planar_ != planar) {
      return absl::InvalidArgumentError("poses in space and in the plane are mixed");
    }
    planar_ = planar;
    if (planar) {
      *pose = Planar(numbers[0], numbers[1], numbers[2]);
      return absl::OkStatus();
    }
    const Eigen::Quaterniond q(numbers[6], numbers[3], numbers[4], numbers[5]);
    if (!(std::abs(q.norm() - 1.0) <= kUnit)) {
      return absl::InvalidArgumentError(
          absl::StrCat("the quaternion has length ", q.norm(), ", not 1"));
    }
    *pose = {q.normalized(), {numbers[0], numbers[1], numbers[2]}};
    return absl::OkStatus();
  }

  absl::Status Vertex(const Fields& fields, std::size_t size) {
    const auto numbers = Numbers(fields, 2, size);
    if (!numbers.ok()) return numbers.status();
    std::int64_t id = 0;
    if (const absl::Status status = Id(fields[1], &id); !status.ok()) return status;
    PoseGraphNode node;
    if (const absl::Status status = Pose(*numbers, &node.world_from_node); !status.ok()) {
      return status;
    }
    if (vertices_.emplace(id, node).second) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat("vertex ", id, " is there twice"));
  }

  absl::Status Edge(const Fields& fields, std::size_t size) {
    const std::size_t information = size == 3 ? 6 : 21;
    const auto numbers = Numbers(fields, 3, size + information);
    if (!numbers.ok()) return numbers.status();
    NumberedEdge edge;
    edge.line = line_;
    if (const absl::Status status = Id(fields[1], &edge.from); !status.ok()) return status;
    if (const absl::Status status = Id(fields[2], &edge.to); !status.ok()) return status;
    if (edge.from == edge.to) {
      return absl::InvalidArgumentError(
          absl::StrCat("an edge ties vertex ", edge.from, " to itself"));
    }
    const std::span<const double> all(*numbers);
    if (const absl::Status status = Pose(all.first(size), &edge.edge.from_to); !status.ok()) {
      return status;
    }
    const Eigen::MatrixXd matrix = Symmetric(all.subspan(size), size == 3 ? 3 : 6);
    if (Eigen::LLT<Eigen::MatrixXd>(matrix).info() != Eigen::Success) {
      return absl::InvalidArgumentError("the information is not positive definite");
    }
    if (size == 3) {
      edge.edge.information = FromPlanar(matrix);
    } else {
      edge.edge.information.topLeftCorner<6, 6>() = matrix;
    }
    edges_.push_back(edge);
    return absl::OkStatus();
  }

  absl::Status Fix(const Fields& fields) {
    if (fields.size() < 2) return absl::InvalidArgumentError("FIX names no vertex");
    for (std::size_t k = 1; k < fields.size(); ++k) {
      std::int64_t id = 0;
      if (const absl::Status status = Id(fields[k], &id); !status.ok()) return status;
      fixed_[id] = line_;
    }
    return absl::OkStatus();
  }

  int line_ = 0, last_line_ = 0;
  std::optional<bool> planar_;
  std::map<std::int64_t, PoseGraphNode> vertices_;
  std::vector<NumberedEdge> edges_;
  std::map<std::int64_t, int> fixed_;  // and where that is said
};

std::string PoseText(const Rigid3& pose, bool planar) {
  const Eigen::Vector3d& t = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  if (planar) return absl::StrFormat(" %.9g %.9g %.9g", t.x(), t.y(), LogQuaternion(q).z());
  return absl::StrFormat(" %.9g %.9g %.9g %.9g %.9g %.9g %.9g", t.x(), t.y(), t.z(), q.x(), q.y(),
                         q.z(), q.w());
}

}  // namespace

absl::StatusOr<G2oGraph> LoadG2o(const std::filesystem::path& file) {
  const absl::StatusOr<std::string> whole = ReadRegularFile(file, kMaxBytes, "a g2o file");
  if (!whole.ok()) return whole.status();
  Reader reader;
  const auto refuse = [&](absl::string_view problem) {
    return absl::InvalidArgumentError(
        absl::StrCat(file.string(), ":", reader.line(), ": ", problem, kForm));
  };
  int line = 0;
  for (const absl::string_view text : absl::StrSplit(*whole, '\n')) {
    reader.At(++line);
    if (text.size() > kMaxLine) return refuse("the line is too long");
    const absl::Status status = reader.Line(text);
    if (!status.ok()) return refuse(status.message());
  }
  absl::StatusOr<G2oGraph> graph = reader.Finish();
  if (!graph.ok()) return refuse(graph.status().message());
  return graph;
}

absl::Status SaveG2o(const std::filesystem::path& file, const G2oGraph& graph) {
  std::string text;
  for (std::size_t k = 0; k < graph.ids.size(); ++k) {
    absl::StrAppend(&text, graph.planar ? "VERTEX_SE2 " : "VERTEX_SE3:QUAT ", graph.ids[k],
                    PoseText(graph.graph.nodes[k].world_from_node, graph.planar), "\n");
  }
  for (std::size_t k = 0; k < graph.ids.size(); ++k) {
    if (graph.graph.nodes[k].held) absl::StrAppend(&text, "FIX ", graph.ids[k], "\n");
  }
  for (const PoseGraphEdge& edge : graph.graph.edges) {
    absl::StrAppend(&text, graph.planar ? "EDGE_SE2 " : "EDGE_SE3:QUAT ", graph.ids[edge.from], " ",
                    graph.ids[edge.to], PoseText(edge.from_to, graph.planar));
    if (graph.planar) {
      absl::StrAppend(&text, UpperText(ToPlanar(edge.information)), "\n");
    } else {
      absl::StrAppend(&text, UpperText(edge.information.topLeftCorner<6, 6>()), "\n");
    }
  }
  return WriteFileAtomically(file, text);
}

}  // namespace saccade
