#include "client/view/picture_layer.hpp"

#include <array>
#include <span>
#include <vector>

#include "client/tools/marks.hpp"
#include "shared/marks/shape_lines.hpp"

namespace saccade::view {
namespace {

constexpr int kCells = 8;                  // a side: the lens bends it
constexpr std::size_t kMostTextures = 40;  // on the card; the others are made again when seen

using Corners = std::array<Eigen::Vector3d, 4>;

Eigen::Vector3d Within(const Corners& corners, double u, double v) {
  const Eigen::Vector3d top = (1 - u) * corners[3] + u * corners[2];
  const Eigen::Vector3d foot = (1 - u) * corners[0] + u * corners[1];
  return (1 - v) * top + v * foot;
}

void DrawOne(const tools::View& view, const Corners& corners, const Texture& texture,
             Painter& painter) {
  std::array<std::array<std::optional<Eigen::Vector2d>, kCells + 1>, kCells + 1> at;
  for (int row = 0; row <= kCells; ++row) {
    for (int column = 0; column <= kCells; ++column) {
      at[row][column] = view.Project(Within(corners, 1.0 * column / kCells, 1.0 * row / kCells));
    }
  }
  const auto share = [](int i) { return static_cast<float>(i) / kCells; };
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      const auto &a = at[row][column], &b = at[row][column + 1], &c = at[row + 1][column + 1],
                 &d = at[row + 1][column];
      if (!a || !b || !c || !d) continue;
      painter.Image(texture.id(), {*a, *b, *c, *d}, {share(column), share(row)},
                    {share(column + 1), share(row + 1)});
    }
  }
}

}  // namespace

const Texture* PictureLayer::TextureOf(const Annotation& mark) {
  const auto known = textures_.find(mark.picture->sha256);
  if (known != textures_.end()) return known->second.get();
  const cv::Mat* rgba = desk_.PictureOf(mark);
  if (rgba == nullptr) return nullptr;
  if (textures_.size() >= kMostTextures) textures_.clear();
  const std::span<const std::uint8_t> pixels(rgba->data, rgba->total() * rgba->elemSize());
  auto texture = std::make_unique<Texture>(gl_, rgba->cols, rgba->rows, PixelLayout::kRgba8, pixels,
                                           Texture::Options{.repeat = false});
  return textures_.emplace(mark.picture->sha256, std::move(texture)).first->second.get();
}

void PictureLayer::Draw(const tools::View& view, Painter& painter) {
  const tools::Scale scale = tools::ScaleOf(desk_.session());
  for (const Annotation& mark : desk_.session().annotations.List()) {
    if (mark.shape != AnnotationShape::kPicture || !mark.picture || !mark.anchor.place_known) {
      continue;
    }
    if (!desk_.state().Draws(mark) || tools::DoNotTrust(mark.anchor, scale)) continue;
    if (const Texture* texture = TextureOf(mark)) {
      DrawOne(view, PictureCorners(mark, view.world_from_camera), *texture, painter);
    }
  }
}

}  // namespace saccade::view
