#pragma once

#include <map>
#include <memory>
#include <string>

#include "client/tools/view.hpp"
#include "client/view/desk.hpp"
#include "client/view/painter.hpp"
#include "shared/render/texture.hpp"

namespace saccade::view {

/// What was pinned up, drawn into its outline in any view; of marks not to be trusted the outline
/// alone stays. Lives on the thread of its OpenGL context.
class PictureLayer {
 public:
  PictureLayer(const GlFunctions& gl, Desk& desk) : gl_(gl), desk_(desk) {}
  void Draw(const tools::View& view, Painter& painter);

 private:
  const Texture* TextureOf(const Annotation& mark);

  const GlFunctions& gl_;
  Desk& desk_;
  std::map<std::string, std::unique_ptr<Texture>> textures_;  // by the picture's sha256
};

}  // namespace saccade::view
