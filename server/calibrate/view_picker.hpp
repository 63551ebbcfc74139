#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "server/calibrate/board.hpp"

namespace saccade {

/// Picks from the views of a board those that add something, and knows what is still missing: the
/// board in every part of the picture, tilted each of four ways, near and far.
class ViewPicker {
 public:
  /// Parts of the picture that corners are counted in.
  static constexpr int kColumns = 6, kRows = 4;
  static constexpr int kMostViews = 60, kEnoughViews = 24;

  explicit ViewPicker(cv::Size picture) : picture_(picture) {}

  /// Takes `view` whatever it adds.
  void Take(const BoardView& view);
  enum class Verdict { kTaken, kAlike, kMoving };
  /// Takes `view`, if it differs from all those taken. One that follows another within a fifth of a
  /// second is taken only if the board hardly moved: else it is blurred, or torn.
  Verdict Offer(const BoardView& view);

  const std::vector<BoardView>& views() const { return views_; }
  /// Share of the parts that some corner was in.
  double Covered() const;
  int Corners(int column, int row) const { return counts_[row * kColumns + column]; }
  /// Nothing is missing, and there are enough.
  bool Complete() const;
  /// What to do next with the board, in the words of who holds it; empty if nothing is missing.
  std::string Advice() const;

 private:
  struct Place {
    double x, y, size;      // of the board in the picture, each 0 to 1
    double tilt_x, tilt_y;  // of its normal, roughly: the lens is not known yet
    double Distance(const Place& other) const;
  };
  Place PlaceOf(const BoardView& view) const;
  std::string TiltAdvice() const;
  std::string PlaceAdvice() const;

  cv::Size picture_;
  std::vector<BoardView> views_;
  std::vector<Place> places_;
  std::array<int, kColumns * kRows> counts_{};
  BoardView last_;
};

}  // namespace saccade
