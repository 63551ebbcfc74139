#include "server/calibrate/picture_set.hpp"

#include <utility>

#include "server/calibrate/picture_folder.hpp"

namespace saccade {

absl::StatusOr<PictureSet> PicturesOfFolder(const std::filesystem::path& folder) {
  absl::StatusOr<std::vector<std::filesystem::path>> files = PicturesIn(folder);
  if (!files.ok()) return files.status();
  PictureSet set;
  set.source = folder.string();
  for (const std::filesystem::path& file : *files) set.names.push_back(file.filename().string());
  set.load = [files = *std::move(files)](std::size_t k) { return LoadGrey(files[k]); };
  return set;
}

void EvenPictures::Offer(const std::string& name, const cv::Mat& grey) {
  if (offered_++ % every_ != 0) return;
  names_.push_back(name);
  pictures_.push_back(grey.clone());  // a source may use its buffer again
  if (pictures_.size() <= most_) return;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < pictures_.size(); k += 2, ++kept) {
    names_[kept] = names_[k];
    pictures_[kept] = pictures_[k];
  }
  names_.resize(kept);
  pictures_.resize(kept);
  every_ *= 2;
}

PictureSet EvenPictures::Take(std::string source) && {
  return {std::move(source), std::move(names_),
          [pictures = std::move(pictures_)](std::size_t k) -> absl::StatusOr<cv::Mat> {
            return pictures[k];
          }};
}

}  // namespace saccade
