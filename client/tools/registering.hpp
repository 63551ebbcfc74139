#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/net/scene_types.hpp"
#include "client/tools/landing.hpp"
#include "shared/scene/scene_object.hpp"

namespace saccade::tools {

constexpr std::size_t kLeastPairs = 4;

/// Where a thing lies in the map, by points clicked on both in turn. What the server makes of them
/// is told to it, and shown before it is accepted.
class Registering {
 public:
  void Begin(const std::string& thing_id);
  void Clear() { Begin(""); }
  const std::string& thing_id() const { return thing_id_; }
  const std::vector<net::PointPair>& pairs() const { return pairs_; }
  /// Of the pairs, in the map [m].
  std::vector<Eigen::Vector3d> points() const;
  /// What the next click is, in words.
  std::string Step(const Scene& scene) const;

  enum class Took { kCorner, kPair };
  /// Why a click means nothing (in words), or what it gave. `within_px`: of `view`'s pixels.
  absl::StatusOr<Took> Click(const Scene& scene, const View& view, const Eigen::Vector2d& pixel,
                             const std::optional<Landing>& landing, double within_px);
  /// Takes a pair out again.
  void Drop(std::size_t index);

  /// What the server says of the pairs as they are; nothing: not asked, or why it cannot.
  std::optional<net::RegisteredThing> result;
  std::string why;
  /// In words: the error, why there is none, or how many points are missing.
  std::string Total() const;
  /// Of pair `index`, in words.
  std::string PairWords(std::size_t index) const;

 private:
  std::string thing_id_;
  std::optional<Eigen::Vector3d> corner_;  // clicked on the thing, not yet in the map
  std::vector<net::PointPair> pairs_;
};

/// The corner of a thing (of a model: a point of its mesh), in its own frame before its scale, that
/// is seen nearest to `pixel`; nothing within `within_px`.
std::optional<Eigen::Vector3d> CornerAt(const Scene& scene, const SceneObject& thing,
                                        const View& view, const Eigen::Vector2d& pixel,
                                        double within_px);

}  // namespace saccade::tools
