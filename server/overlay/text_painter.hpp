#pragma once

#include <absl/container/flat_hash_map.h>

#include <cstdint>
#include <list>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>

#include "shared/text/font_store.hpp"
#include "shared/text/text_layout.hpp"

namespace saccade {

/// What lies under the letters.
enum class TextGround {
  kBox,      // a dark, opaque field with a margin
  kHalo,     // a dark rim round each letter
  kPicture,  // nothing: the caller has darkened the picture
};

struct TextStyle {
  LayoutOptions layout;
  cv::Scalar color;  // BGR; emoji keep their own
  TextGround ground = TextGround::kPicture;
  int margin_px = 0;
};

/// Text, set and drawn, ready to be laid onto pictures.
struct TextSprite {
  cv::Mat pixels;       // CV_8UC3 BGR where `ground` is a box, else CV_8UC4 BGRA, premultiplied
  bool cut = false;     // not all of the text is in it
  int baseline_px = 0;  // of the first line, from the top
};

/// Sets and draws text, and keeps what it drew: a text that is shown again costs a copy. At most
/// 256 sprites or 64 MiB, the one unused for longest goes. One for each thread.
class TextPainter {
 public:
  /// This thread's own, with the fonts of the system.
  static TextPainter& OfThisThread();

  explicit TextPainter(const FontCatalogue& catalogue) : fonts_(catalogue) {}

  /// Never null. `utf8` is any bytes; a `heading` stands in lines of its own before it.
  std::shared_ptr<const TextSprite> Sprite(std::string_view heading, std::string_view utf8,
                                           const TextStyle& style);

  /// Lays `sprite` onto a BGR picture, its upper left corner at `corner`; what does not fit is cut.
  static void Lay(const TextSprite& sprite, const cv::Point& corner, cv::Mat& picture);

 private:
  struct Kept {
    std::string key;
    std::shared_ptr<const TextSprite> sprite;
    std::size_t bytes = 0;
  };
  void MakeRoom();

  FontStore fonts_;
  std::list<Kept> kept_;  // most recently used first
  absl::flat_hash_map<std::string, std::list<Kept>::iterator> by_key_;
  std::size_t bytes_ = 0;
};

}  // namespace saccade
