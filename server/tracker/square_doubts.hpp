#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/markers/marker.hpp"
#include "server/markers/square_map.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade {

/// What is wrong with squares, in words for a person, each said once: one that is there twice, one
/// that is printed at another size than said, a picture that is mirrored. One thread.
class SquareDoubts {
 public:
  /// The squares of one picture. Which is of another size shows where at least two others of the
  /// map agree on where the camera is. After the first pictures it looks at few.
  void Add(const CameraModel& camera, const std::vector<MarkerSighting>& seen,
           const SquareMap& map);
  /// Of a picture without squares: how many its mirror image has.
  void AddMirrored(std::size_t squares);
  /// A square is `factor` times as large as said, by what others say that a metre is.
  void AddSize(const std::string& family, int id, double said_m, double factor);
  /// Two disagree, and nobody else tells which is wrong.
  void AddDisagreement(const std::string& family, int id, int other, double factor);

  /// More pictures would tell something.
  bool wants_pictures() const { return pictures_ < kFirstPictures && looks_ < kMostLooks; }
  /// What was found out since this was last asked.
  std::vector<std::string> Take() { return std::exchange(news_, {}); }

  /// A square that is off by less, of its side, may be the lens's or the ruler's fault.
  static constexpr double kLeastOff = 0.04;

 private:
  using Key = std::pair<std::string, int>;
  void Say(const std::string& what, std::string words);
  void LookForTwins(const std::vector<MarkerSighting>& seen);

  static constexpr int kFirstPictures = 12, kMostLooks = 60;
  int looks_ = 0, pictures_ = 0, skipped_ = 0, mirrored_ = 0;
  std::map<Key, std::vector<double>> factors_;
  std::map<Key, int> twins_;
  std::set<std::string> said_;
  std::vector<std::string> news_;
};

}  // namespace saccade
