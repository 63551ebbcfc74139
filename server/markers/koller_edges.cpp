#include "server/markers/koller_edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace saccade {
namespace {

// In cells. Beyond the outermost cells the frame is half a cell wide.
constexpr double kReach = 0.3, kHalfWidth = 0.3;
constexpr int kAcross = 9, kAlong = 7;  // samples of a strip
constexpr double kMiddle = 0.24;        // half of what a cell's own red is taken from
constexpr int kMiddleSamples = 5;       // a side
constexpr int kWays[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};  // columns, rows

double Place(double cells) { return kKollerFrame + kKollerCell * cells; }

/// From -1 to 1.
double Step(int k, int count) { return 2.0 * k / (count - 1) - 1; }

double RedOfMiddle(const SquareSampler& square, double column, double row) {
  double sum = 0;
  for (int j = 0; j < kMiddleSamples; ++j) {
    for (int i = 0; i < kMiddleSamples; ++i) {
      sum += Redness(square.At(Place(column + kMiddle * Step(i, kMiddleSamples)),
                               Place(row + kMiddle * Step(j, kMiddleSamples))));
    }
  }
  return sum / (kMiddleSamples * kMiddleSamples);
}

double RedOfStrip(const SquareSampler& square, double column, double row, const int (&way)[2]) {
  double sum = 0;
  for (int i = 0; i < kAcross; ++i) {
    for (int j = 0; j < kAlong; ++j) {
      const double out = 0.5 + kReach * Step(i, kAcross), along = kHalfWidth * Step(j, kAlong);
      sum += Redness(square.At(Place(column + way[0] * out + way[1] * along),
                               Place(row + way[1] * out + way[0] * along)));
    }
  }
  return sum / (kAcross * kAlong);
}

}  // namespace

KollerEdges LookAtEdges(const SquareSampler& square, const KollerCells& red, double black) {
  KollerEdges edges;
  double squares = 0;
  int count = 0;
  for (int cell = 0; cell < 9; ++cell) {
    if (!red[cell]) continue;
    const int column = cell % 3, row = cell / 3;
    const double own = RedOfMiddle(square, column + 0.5, row + 0.5) - black;
    for (const auto& way : kWays) {
      const int x = column + way[0], y = row + way[1];
      if (std::min(x, y) >= 0 && std::max(x, y) < 3 && red[3 * y + x]) continue;
      const double strip = RedOfStrip(square, column + 0.5, row + 0.5, way) - black;
      const double off = 2 * kReach * (strip / std::max(own, 1.0) - 0.5);
      edges.worst_cells = std::max(edges.worst_cells, std::abs(off));
      squares += off * off;
      ++count;
    }
  }
  if (count > 0) edges.rms_cells = std::sqrt(squares / count);
  return edges;
}

}  // namespace saccade
