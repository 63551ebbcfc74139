#include "server/sim/paint.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace saccade {

cv::Scalar Rgb(double r, double g, double b) { return {b, g, r}; }

cv::Scalar Shade(const cv::Scalar& color, double amount) {
  cv::Scalar result;
  for (int c = 0; c < 3; ++c) {
    result[c] = amount < 0 ? color[c] * (1 + amount) : color[c] + (255 - color[c]) * amount;
  }
  return result;
}

cv::RNG RngFor(std::uint64_t seed, const std::string& thing) {
  std::uint64_t hash = 1469598103934665603ULL ^ (seed * 0x9e3779b97f4a7c15ULL);
  for (const char c : thing) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return cv::RNG(hash | 1);
}

cv::Mat Cloud(cv::RNG& rng, const cv::Size& size, const cv::Size& cells) {
  cv::Mat coarse(std::max(cells.height, 1), std::max(cells.width, 1), CV_32FC1), field;
  rng.fill(coarse, cv::RNG::UNIFORM, -1.0, 1.0);
  cv::resize(coarse, field, size, 0, 0, cv::INTER_CUBIC);
  return field;
}

void Modulate(cv::Mat& image, const cv::Mat& field, double amount) {
  cv::Mat factor, factor3, real;
  field.convertTo(factor, CV_32F, amount, 1.0);
  cv::merge(std::vector<cv::Mat>{factor, factor, factor}, factor3);
  image.convertTo(real, CV_32FC3);
  cv::multiply(real, factor3, real);
  real.convertTo(image, CV_8UC3);
}

void Grain(cv::Mat& image, cv::RNG& rng, double sigma, int scale) {
  cv::Mat coarse(std::max(1, image.rows / scale), std::max(1, image.cols / scale), CV_16SC1), noise;
  rng.fill(coarse, cv::RNG::NORMAL, 0, sigma);
  cv::resize(coarse, noise, image.size(), 0, 0, cv::INTER_LINEAR);
  cv::Mat noise3;
  cv::merge(std::vector<cv::Mat>{noise, noise, noise}, noise3);
  cv::add(image, noise3, image, cv::noArray(), CV_8U);
}

void Text(cv::Mat& image, const std::string& text, const cv::Point& at, double height,
          const cv::Scalar& color, int thickness, bool left) {
  constexpr int kFont = cv::FONT_HERSHEY_DUPLEX;
  const double scale = height / 21.0;  // capitals of the font are 21 high at scale 1
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, kFont, scale, thickness, &baseline);
  const cv::Point origin(left ? at.x : at.x - size.width / 2,
                         at.y + static_cast<int>(std::lround(height / 2)));
  cv::putText(image, text, origin, kFont, scale, color, thickness, cv::LINE_AA);
}

void Lines(cv::Mat& image, cv::RNG& rng, const cv::Rect& area, int line, const cv::Scalar& color) {
  for (int y = area.y; y + line <= area.y + area.height; y += 2 * line) {
    const int end = area.x + area.width -
                    (rng.uniform(0, 4) == 0 ? rng.uniform(0, area.width / 2 + 1)
                                            : rng.uniform(0, area.width / 8 + 1));
    for (int x = area.x; x < end;) {
      const int word = rng.uniform(line, 5 * line);
      // Words as rows of uneven strokes look like print from where it cannot be read.
      for (int u = x; u < std::min(x + word, end); u += std::max(2, line / 2)) {
        const int top = y + rng.uniform(0, std::max(1, line / 3));
        cv::rectangle(image, cv::Point(u, top),
                      cv::Point(u + std::max(0, line / 4 - 1), y + line - 1), color, cv::FILLED);
      }
      x += word + line;
    }
  }
}

void Fill(cv::Mat& image, const cv::Rect& area, const cv::Scalar& color) {
  cv::rectangle(image, area, color, cv::FILLED);
}

void DrawFrame(cv::Mat& image, const cv::Rect& area, const cv::Scalar& color, int thickness) {
  cv::rectangle(image, area, color, thickness, cv::LINE_AA);
}

void DropShadow(cv::Mat& image, const cv::Rect& area, int reach, double strength) {
  const cv::Rect bounds =
      cv::Rect(area.x - reach, area.y - reach, area.width + 3 * reach, area.height + 3 * reach) &
      cv::Rect(0, 0, image.cols, image.rows);
  if (bounds.empty()) return;
  cv::Mat mask(bounds.size(), CV_32FC1, cv::Scalar(0));
  const cv::Point shift(reach / 2 - bounds.x, reach / 2 - bounds.y);
  cv::rectangle(mask, area + shift, cv::Scalar(1), cv::FILLED);
  cv::blur(mask, mask, {reach + 1, reach + 1});
  cv::Mat part = image(bounds);
  Modulate(part, mask, -strength);
  part.copyTo(image(bounds));
}

cv::Mat Wood(cv::RNG& rng, const cv::Size& size, const cv::Scalar& base) {
  cv::Mat image(size, CV_8UC3, base);
  Modulate(image, Cloud(rng, size, {3, std::max(3, size.height / 24)}), 0.13);
  Modulate(image, Cloud(rng, size, {std::max(2, size.width / 160), std::max(4, size.height / 5)}),
           0.10);
  Modulate(image, Cloud(rng, size, {std::max(2, size.width / 40), std::max(4, size.height / 2)}),
           0.06);
  return image;
}

}  // namespace saccade
