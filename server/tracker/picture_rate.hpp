#pragma once

#include <deque>
#include <optional>

namespace saccade {

/// How often pictures come, and whether that is too seldom for how the camera moves.
class PictureRate {
 public:
  /// A new picture has come, `dt_s` after the one before.
  void Add(double dt_s);
  /// What became of the searches in it. `moved_px`: how far things have moved in the picture since
  /// the one before; nothing: not known.
  void Record(int attempted, int accepted, std::optional<double> moved_px);

  /// Pictures a second [Hz] if they are few, things move, and most of what should be in view is not
  /// found; nothing: they are enough, or something else is the matter.
  std::optional<double> TooFew() const;

 private:
  std::optional<double> Median_s() const;

  std::deque<double> intervals_s_;
  bool moves_ = true;  // unless it is seen that nothing does
  bool failing_ = false;
  int good_in_row_ = 0;
};

}  // namespace saccade
