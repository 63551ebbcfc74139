#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace saccade {

/// Pictures of one camera that are looked at more than once, in order.
struct PictureSet {
  std::string source;              // where they are from, for reports
  std::vector<std::string> names;  // for messages and tables
  /// The kth, 8-bit grey.
  std::function<absl::StatusOr<cv::Mat>(std::size_t k)> load;

  std::size_t size() const { return names.size(); }
};

/// Those of a folder; errors as PicturesIn's (server/calibrate/picture_folder.hpp).
absl::StatusOr<PictureSet> PicturesOfFolder(const std::filesystem::path& folder);

/// Keeps at most `most` pictures of a stream, evenly spread over what has come so far: when there
/// are too many every second one goes, and from then on only half as many are taken.
class EvenPictures {
 public:
  explicit EvenPictures(std::size_t most) : most_(most) {}

  void Offer(const std::string& name, const cv::Mat& grey);
  PictureSet Take(std::string source) &&;

 private:
  std::size_t most_;
  std::size_t every_ = 1, offered_ = 0;
  std::vector<std::string> names_;
  std::vector<cv::Mat> pictures_;
};

}  // namespace saccade
