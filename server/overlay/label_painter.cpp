#include "server/overlay/label_painter.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "server/overlay/text_painter.hpp"

namespace saccade {
namespace {

constexpr std::size_t kMaxLabels = 48;
constexpr double kText_px = 14.0;  // of the em square; sizes for a picture 640 px wide
constexpr double kMargin_px = 5.0;
constexpr double kShort_px = 220.0, kLong_px = 380.0;  // widths of the text
constexpr int kShortLines = 3;
constexpr double kStatus_px = 30.0;  // at the bottom, kept free
constexpr double kSmallest = 0.78;   // of kText_px, where a text would not fit otherwise
constexpr double kLookedAt = 0.3;    // of the picture's height, from its middle
constexpr std::string_view kWarning = "do not trust";

class LabelPainter {
 public:
  LabelPainter(cv::Mat& picture, Painter& painter)
      : picture_(picture), painter_(painter), text_(TextPainter::OfThisThread()) {}

  /// Up to three short lines.
  std::shared_ptr<const TextSprite> Short(const ColoredLabel& label) {
    return Sprite(label, 1.0, kShort_px * Scale(), kShortLines);
  }

  /// All of it: a wider box, then smaller letters, where it is too high for the picture.
  std::shared_ptr<const TextSprite> Whole(const ColoredLabel& label) {
    const double widest = picture_.cols - 2 * (kMargin_px + 3) * Scale();
    std::shared_ptr<const TextSprite> sprite;
    for (const auto& [share, width] : {std::pair(1.0, std::min(kLong_px * Scale(), widest)),
                                       std::pair(1.0, widest), std::pair(kSmallest, widest)}) {
      const double line = 1.28 * kText_px * share * Scale();
      const int most = std::max(kShortLines, static_cast<int>(Room().height / line) - 2);
      sprite = Sprite(label, share, width, most);
      if (!sprite->cut) break;
    }
    return sprite;
  }

  void Draw(const ColoredLabel& label, const TextSprite& sprite) {
    const cv::Size size = sprite.pixels.size();
    const cv::Point corner = Place(label.label->at_px, size);
    TextPainter::Lay(sprite, corner, picture_);
    const Eigen::Vector2d a(corner.x, corner.y), right(size.width, 0), down(0, size.height);
    painter_.Lines({{a, a + right, a + right + down, a + down, a}}, label.color, 1.5,
                   label.label->hollow);
  }

 private:
  /// Of letters: they stay legible in a small picture.
  double Scale() const { return std::max(11.0 / kText_px, picture_.cols / 640.0); }

  /// Right of the mark and above it; from there it slides into the picture. Only where it would
  /// come to lie on the mark it goes to the other side.
  cv::Point Place(const Eigen::Vector2d& mark, const cv::Size& size) const {
    const cv::Rect room = Room();
    const double aside = 6 * painter_.scale(), above = 4 * painter_.scale();
    const auto slide = [](double at, int low, int high) {
      return std::clamp(static_cast<int>(at), low, std::max(low, high));
    };
    const double left[] = {mark.x() + aside, mark.x() - aside - size.width};
    const double top[] = {mark.y() - above - size.height, mark.y() + above};
    const cv::Rect keep_free(static_cast<int>(mark.x() - above), static_cast<int>(mark.y() - 1),
                             static_cast<int>(2 * above), 3);
    std::optional<cv::Point> first;
    for (const double y : top) {
      for (const double x : left) {
        const cv::Point corner(slide(x, room.x, room.br().x - size.width),
                               slide(y, room.y, room.br().y - size.height));
        if (!first) first = corner;
        if ((cv::Rect(corner, size) & keep_free).area() == 0) return corner;
      }
    }
    return *first;
  }

  cv::Rect Room() const {
    const int border = std::max(1, static_cast<int>(2 * painter_.scale()));
    return {border, border, std::max(1, picture_.cols - 2 * border),
            std::max(1, picture_.rows - static_cast<int>(kStatus_px * painter_.scale()) - border)};
  }

  std::shared_ptr<const TextSprite> Sprite(const ColoredLabel& label, double share, double width_px,
                                           int lines) {
    TextStyle style;
    style.layout = {std::max(8, static_cast<int>(std::lround(kText_px * share * Scale()))),
                    std::floor(width_px), lines};
    style.color = label.color;
    style.ground = TextGround::kBox;
    style.margin_px = static_cast<int>(std::lround(kMargin_px * Scale()));
    return text_.Sprite(label.label->hollow ? kWarning : "", label.label->words, style);
  }

  cv::Mat& picture_;
  Painter& painter_;
  TextPainter& text_;
};

}  // namespace

void DrawLabels(std::vector<ColoredLabel> labels, cv::Mat& picture, Painter& painter) {
  const Eigen::Vector2d middle(0.5 * (picture.cols - 1), 0.5 * (picture.rows - 1));
  const auto nearer = [&middle](const ColoredLabel& a, const ColoredLabel& b) {
    return (a.label->at_px - middle).squaredNorm() < (b.label->at_px - middle).squaredNorm();
  };
  std::stable_sort(labels.begin(), labels.end(), nearer);
  if (labels.size() > kMaxLabels) labels.resize(kMaxLabels);

  LabelPainter drawer(picture, painter);
  std::vector<std::shared_ptr<const TextSprite>> sprites;
  std::size_t opened = labels.size();
  for (std::size_t i = 0; i < labels.size(); ++i) {
    sprites.push_back(drawer.Short(labels[i]));
    const double away = (labels[i].label->at_px - middle).norm();
    const bool looked_at = away < kLookedAt * picture.rows;
    if (!sprites[i]->cut || !looked_at || opened != labels.size()) continue;
    opened = i;
    sprites[i] = drawer.Whole(labels[i]);
  }
  for (std::size_t i = labels.size(); i-- > 0;) {
    if (i != opened) drawer.Draw(labels[i], *sprites[i]);
  }
  if (opened != labels.size()) drawer.Draw(labels[opened], *sprites[opened]);
}

}  // namespace saccade
