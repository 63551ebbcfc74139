#include "client/session/surface_book.hpp"

namespace saccade::session {

void SurfaceBook::Take(const net::SurfacePiece& piece) {
  ++changes_;
  if (piece.edition != surface_.edition) surface_.chunks.clear();
  surface_.edition = piece.edition;
  surface_.version = piece.version;
  for (const auto& chunk : piece.chunks) {
    if (chunk->triangles.empty()) {
      surface_.chunks.erase(chunk->index);
    } else {
      surface_.chunks[chunk->index] = chunk;
    }
  }
}

}  // namespace saccade::session
