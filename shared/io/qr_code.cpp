#include "shared/io/qr_code.hpp"

#include <qrencode.h>

#include <memory>

namespace saccade {
namespace {

constexpr int kQuiet = 2;  // modules; four by the standard, two are enough for every phone
constexpr const char* kBlackOnWhite = "\x1b[30;47m";
constexpr const char* kPlain = "\x1b[0m";

}  // namespace

std::vector<std::string> QrCodeLines(absl::string_view text) {
  const std::string copy(text);
  const std::unique_ptr<QRcode, void (*)(QRcode*)> code(
      QRcode_encodeString8bit(copy.c_str(), 0, QR_ECLEVEL_L), QRcode_free);
  std::vector<std::string> lines;
  if (code == nullptr) return lines;
  const auto dark = [&code](int x, int y) {
    const bool inside = x >= 0 && y >= 0 && x < code->width && y < code->width;
    return inside && (code->data[y * code->width + x] & 1) != 0;
  };
  for (int y = -kQuiet; y < code->width + kQuiet; y += 2) {
    std::string line = kBlackOnWhite;
    for (int x = -kQuiet; x < code->width + kQuiet; ++x) {
      const bool above = dark(x, y), below = dark(x, y + 1);
      line += above && below ? "\u2588" : above ? "\u2580" : below ? "\u2584" : " ";
    }
    lines.push_back(line + kPlain);
  }
  return lines;
}

}  // namespace saccade
