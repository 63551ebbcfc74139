#pragma once

#include <cstdint>
#include <span>

#include "shared/render/gl_functions.hpp"

namespace saccade {

/// Vertices of floats, with an index list, on the graphics card. Vertex v is
/// `floats_per_vertex` numbers, split over attributes 0, 1, ... by `attribute_sizes`.
/// Created, used and destroyed while its context is current; `gl` must outlive it.
class Mesh {
 public:
  /// `attribute_sizes`: floats in each attribute, e.g. {3, 2}: position and texture coordinate.
  Mesh(const GlFunctions& gl, std::span<const int> attribute_sizes);
  ~Mesh();
  Mesh(const Mesh&) = delete;
  Mesh& operator=(const Mesh&) = delete;

  /// Replaces the content. `dynamic`: it will be replaced often.
  void Upload(std::span<const float> vertices, std::span<const std::uint32_t> indices,
              bool dynamic = false);

  /// Draws `count` indices from `first`; count < 0: all from `first`.
  void Draw(GLenum primitive = GL_TRIANGLES, std::size_t first = 0,
            std::ptrdiff_t count = -1) const;
  std::size_t index_count() const { return index_count_; }

 private:
  const GlFunctions& gl_;
  GLuint array_ = 0, vertex_buffer_ = 0, index_buffer_ = 0;
  std::size_t index_count_ = 0;
};

}  // namespace saccade
