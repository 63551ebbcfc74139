#include "server/markers/koller_reading.hpp"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/markers/koller_edges.hpp"
#include "server/markers/square_sampler.hpp"

namespace saccade {
namespace {

using Point = Eigen::Vector2d;
using Color = Eigen::Vector3d;  // blue, green, red

constexpr double kBand = kKollerFrame / 2;  // where the frame is looked at
constexpr double kOutside = 0.09, kLeastOutside_px = 2.2;
constexpr double kLeastCellContrast = 15;
constexpr int kLeastClearBands = 8;  // of twelve: something may lie over the others
constexpr double kLeastRedness = 28;
constexpr double kMostFrameRedness = 0.3;
// Outside of the frame it is brighter than in it, by so much of the contrast, in shadow too.
constexpr double kLeastWhite = 0.24;
// Brighter than the frame near by, of the contrast to white: covered, or in glare.
constexpr double kBlackTolerance = 0.16, kRedTolerance = 0.35, kCellNoise = 5;
// A reflection brightens cells, too, but bends nowhere as sharply as the edge of what covers one:
// of its height, over an eighth of the side to either hand. Only squares so large are looked at.
constexpr double kMostGlare = 0.75, kMostBend = 0.8, kLeastBend = 0.1, kBendNoise = 4;
constexpr double kGlareSide_px = 32;
constexpr int kGrid = 15;  // places across the square, a sixteenth of the side apart
// Red of the reddest cell that still is black, and that is red: in cells of a few pixels their
// neighbours are mixed in; in larger ones shadow takes from red.
struct Bounds {
  double pitch_px, most_black, least_red;
};
constexpr Bounds kSmall = {3.0, 0.42, 0.50}, kLarge = {7.0, 0.17, 0.27};
// Edges of red cells, in cells: the worst, and of all. An edge of shadow within a cell moves its
// edges by 0.2 at most; a side that is something else's lets the whole code slip by 0.25 or more.
constexpr double kMostEdgeOff = 0.24, kMostEdgesOff = 0.13;

struct Band {
  double u, v;  // where along the frame
  Color inner, outer;
  double darkest;  // outside, of blue and green: of three places the least
  bool clear() const { return outer[1] - inner[1] >= kLeastCellContrast; }
};

class Reader {
 public:
  Reader(const cv::Mat& color, const std::array<Point, 4>& corners)
      : square_(color, corners), side_px_(square_.side_px()) {}

  absl::StatusOr<KollerReading> Read() {
    if (!MeasureFrame()) return absl::InvalidArgumentError("its frame is not black on white");
    if (IsCrossed()) {
      return absl::InvalidArgumentError("something as dark as it lies over its frame");
    }
    std::array<Color, 9> cells;
    double most = 0;
    for (int k = 0; k < 9; ++k) {
      cells[k] = CellColor(k / 3, k % 3);
      most = std::max(most, Redness(cells[k]));
    }
    if (most < kLeastRedness) return absl::InvalidArgumentError("no cell is red");
    int reddish = 0;
    for (const Band& band : bands_) reddish += Redness(band.inner) > kMostFrameRedness * most;
    if (reddish > 12 - kLeastClearBands) {
      return absl::InvalidArgumentError("its frame is red in places");
    }
    KollerCells red{};
    for (int k = 0; k < 9; ++k) {
      const absl::StatusOr<bool> is_red = IsRed(k, cells[k], most);
      if (!is_red.ok()) return is_red.status();
      red[k] = *is_red;
    }
    absl::StatusOr<KollerReading> reading = ReadKollerCells(red);
    if (reading.ok() && !EdgesAgree(red)) {
      return absl::InvalidArgumentError(
          "its red cells do not end where they must; something lies over it, or it is no square");
    }
    return reading;
  }

 private:
  Color At(double u, double v) const { return square_.At(u, v); }

  /// Three places a side, each over the middle of a cell.
  bool MeasureFrame() {
    const double out = std::max(kOutside, kLeastOutside_px / side_px_);
    for (int side = 0; side < 4; ++side) {
      for (int k = 0; k < 3; ++k) {
        Color inner = Color::Zero(), outer = Color::Zero();
        double u = 0, v = 0, darkest = 255;
        for (const double shift : {-0.06, 0.0, 0.06}) {
          const double along = kKollerFrame + (k + 0.5) * kKollerCell + shift;
          const auto at = [&](double deep) {
            return side == 0   ? Point(along, deep)
                   : side == 1 ? Point(1 - deep, along)
                   : side == 2 ? Point(along, 1 - deep)
                               : Point(deep, along);
          };
          const Point in = at(kBand), beyond = at(-out);
          inner += At(in.x(), in.y()) / 3;
          const Color outside = At(beyond.x(), beyond.y());
          outer += outside / 3;
          darkest = std::min(darkest, outside.head<2>().maxCoeff());
          u += in.x() / 3;
          v += in.y() / 3;
        }
        bands_[3 * side + k] = {u, v, inner, outer, darkest};
      }
    }
    std::vector<double> contrasts;
    for (const Band& band : bands_) {
      if (band.clear()) contrasts.push_back(band.outer[1] - band.inner[1]);
    }
    if (contrasts.size() < static_cast<std::size_t>(kLeastClearBands)) return false;
    std::nth_element(contrasts.begin(), contrasts.begin() + contrasts.size() / 2, contrasts.end());
    contrast_ = contrasts[contrasts.size() / 2];
    return true;
  }

  /// Something black or red comes in over the frame: what it covers cannot be told from cells.
  bool IsCrossed() const {
    return std::any_of(bands_.begin(), bands_.end(), [&](const Band& band) {
      const Color black = BlackAt(band.u, band.v, &band);
      return band.darkest < black.head<2>().maxCoeff() + kLeastWhite * contrast_;
    });
  }

  /// Black at a place, from the frame about it but for `without`, nearer parts counting more.
  Color BlackAt(double u, double v, const Band* without = nullptr) const {
    Color sum = Color::Zero();
    double weights = 0;
    for (const Band& band : bands_) {
      if (!band.clear() || &band == without) continue;
      const double weight = 1 / ((band.u - u) * (band.u - u) + (band.v - v) * (band.v - v));
      sum += weight * weight * band.inner;
      weights += weight * weight;
    }
    return sum / weights;
  }

  /// Mean over the cell's middle half, or a third of it where it is small.
  Color CellColor(int row, int column) const {
    const double pitch_px = kKollerCell * side_px_;
    const int each = std::clamp(static_cast<int>(0.5 * pitch_px) + 1, 2, 6);
    const double share = pitch_px < 4 ? 0.34 : 0.55;
    Color sum = Color::Zero();
    for (int j = 0; j < each; ++j) {
      for (int i = 0; i < each; ++i) {
        const double du = share * ((i + 0.5) / each - 0.5), dv = share * ((j + 0.5) / each - 0.5);
        sum += At(kKollerFrame + (column + 0.5 + du) * kKollerCell,
                  kKollerFrame + (row + 0.5 + dv) * kKollerCell);
      }
    }
    return sum / (each * each);
  }

  /// Whether green and blue change within the square as gently as light does, for `height`
  /// grey levels more, not as by edges.
  bool IsSmooth(double height) const {
    if (side_px_ < kGlareSide_px) return false;
    std::array<std::array<Color, kGrid>, kGrid> at;
    constexpr double kPitch = 1.0 / (kGrid + 1);
    for (int row = 0; row < kGrid; ++row) {
      for (int column = 0; column < kGrid; ++column) {
        at[row][column] = Color::Zero();
        for (int k = 0; k < 9; ++k) {
          at[row][column] += At(kPitch * (column + 1 + (k % 3 - 1) / 3.0),
                                kPitch * (row + 1 + (k / 3 - 1) / 3.0)) /
                             9;
        }
      }
    }
    const double most = std::max(kMostBend * height, kLeastBend * contrast_ + kBendNoise);
    const auto bent = [&](const Color& a, const Color& b, const Color& c) {
      return (a - 2 * b + c).head<2>().cwiseAbs().maxCoeff() > most;
    };
    for (int row = 0; row < kGrid; ++row) {
      for (int k = 0; k + 4 < kGrid; ++k) {
        if (bent(at[row][k], at[row][k + 2], at[row][k + 4])) return false;
        if (bent(at[k][row], at[k + 2][row], at[k + 4][row])) return false;
      }
    }
    return true;
  }

  absl::StatusOr<bool> IsRed(int cell, const Color& color, double most) const {
    const double pitch_px = kKollerCell * side_px_;
    const double share =
        std::clamp((pitch_px - kSmall.pitch_px) / (kLarge.pitch_px - kSmall.pitch_px), 0.0, 1.0);
    const double most_black = std::lerp(kSmall.most_black, kLarge.most_black, share) * most;
    const double least_red = std::lerp(kSmall.least_red, kLarge.least_red, share) * most;
    const double redness = Redness(color);
    const std::string name = absl::StrCat("cell ", cell / 3 + 1, ",", cell % 3 + 1);
    if (redness > most_black && redness < least_red) {
      return absl::InvalidArgumentError(absl::StrCat(name, " is neither red nor black"));
    }
    const bool red = redness >= least_red;
    const Color black = BlackAt(kKollerFrame + (cell % 3 + 0.5) * kKollerCell,
                                kKollerFrame + (cell / 3 + 0.5) * kKollerCell);
    const Color more = color - black;
    const double above = more.head<2>().maxCoeff();
    if (above > (red ? kRedTolerance : kBlackTolerance) * contrast_ + kCellNoise &&
        (above > kMostGlare * contrast_ || !IsSmooth(above))) {
      return absl::InvalidArgumentError(absl::StrCat(name, " is covered, or in glare"));
    }
    return red;
  }

  bool EdgesAgree(const KollerCells& red) const {
    std::array<double, 12> black;
    for (int k = 0; k < 12; ++k) black[k] = Redness(bands_[k].inner);
    std::nth_element(black.begin(), black.begin() + 6, black.end());
    const KollerEdges edges = LookAtEdges(square_, red, black[6]);
    return edges.worst_cells < kMostEdgeOff && edges.rms_cells < kMostEdgesOff;
  }

  const SquareSampler square_;
  const double side_px_;
  double contrast_ = 0;
  std::array<Band, 12> bands_{};
};

}  // namespace

absl::StatusOr<KollerReading> ReadKollerSquare(const cv::Mat& color,
                                               const std::array<Point, 4>& corners) {
  return Reader(color, corners).Read();
}

}  // namespace saccade
