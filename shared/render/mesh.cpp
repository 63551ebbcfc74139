#include "shared/render/mesh.hpp"

#include <numeric>

namespace saccade {

Mesh::Mesh(const GlFunctions& gl, std::span<const int> attribute_sizes) : gl_(gl) {
  gl_.GenVertexArrays(1, &array_);
  gl_.GenBuffers(1, &vertex_buffer_);
  gl_.GenBuffers(1, &index_buffer_);
  gl_.BindVertexArray(array_);
  gl_.BindBuffer(GL_ARRAY_BUFFER, vertex_buffer_);
  gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, index_buffer_);
  const int floats = std::accumulate(attribute_sizes.begin(), attribute_sizes.end(), 0);
  std::uintptr_t offset = 0;
  for (GLuint i = 0; i < attribute_sizes.size(); ++i) {
    gl_.EnableVertexAttribArray(i);
    gl_.VertexAttribPointer(i, attribute_sizes[i], GL_FLOAT, GL_FALSE,
                            static_cast<GLsizei>(floats * sizeof(float)),
                            reinterpret_cast<const void*>(offset));
    offset += static_cast<std::uintptr_t>(attribute_sizes[i]) * sizeof(float);
  }
  gl_.BindVertexArray(0);
}

Mesh::~Mesh() {
  gl_.DeleteVertexArrays(1, &array_);
  gl_.DeleteBuffers(1, &vertex_buffer_);
  gl_.DeleteBuffers(1, &index_buffer_);
}

void Mesh::Upload(std::span<const float> vertices, std::span<const std::uint32_t> indices,
                  bool dynamic) {
  const GLenum usage = dynamic ? GL_STREAM_DRAW : GL_STATIC_DRAW;
  gl_.BindVertexArray(array_);
  gl_.BindBuffer(GL_ARRAY_BUFFER, vertex_buffer_);
  gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size_bytes()), vertices.data(),
                 usage);
  gl_.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size_bytes()),
                 indices.data(), usage);
  gl_.BindVertexArray(0);
  index_count_ = indices.size();
}

void Mesh::Draw(GLenum primitive, std::size_t first, std::ptrdiff_t count) const {
  if (first >= index_count_ || count == 0) return;
  const std::size_t rest = index_count_ - first;
  const std::size_t n =
      count < 0 || static_cast<std::size_t>(count) > rest ? rest : static_cast<std::size_t>(count);
  gl_.BindVertexArray(array_);
  gl_.DrawElements(primitive, static_cast<GLsizei>(n), GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(first * sizeof(std::uint32_t)));
  gl_.BindVertexArray(0);
}

}  // namespace saccade
