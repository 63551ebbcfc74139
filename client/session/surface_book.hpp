#pragma once

#include "client/net/surface_types.hpp"
#include "shared/scene/surface_snapshot.hpp"

namespace saccade::session {

/// The place's surfaces as far as they came.
class SurfaceBook {
 public:
  void Take(const net::SurfacePiece& piece);
  const SurfaceSnapshot& surface() const { return surface_; }
  /// Rises with every change.
  std::uint64_t changes() const { return changes_; }

 private:
  SurfaceSnapshot surface_;
  std::uint64_t changes_ = 0;
};

}  // namespace saccade::session
