#include "server/app/picture_gallery.hpp"

#include <algorithm>
#include <utility>

#include "server/app/picture_reader.hpp"

namespace saccade {

PictureGallery::PictureGallery()
    : runner_({.capacity = kWaiting, .when_full = WhenFull::kRefuse},
              [this](Request request) { Step(std::move(request)); }) {}

void PictureGallery::Read(std::string bytes, Done<PicturePtr> done) {
  const absl::Status queued = runner_.Post(ReadRequest{std::move(bytes), done});
  if (!queued.ok()) done(queued);
}

cv::Mat PictureGallery::Find(const PicturePtr& picture) {
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(kept_.begin(), kept_.end(),
                                    [&](const Kept& one) { return one.sha256 == picture->sha256; });
    if (found != kept_.end()) {
      kept_.splice(kept_.begin(), kept_, found);
      return found->pixels;
    }
    kept_.push_front({picture->sha256, {}, false});
    if (kept_.size() > kKept) kept_.pop_back();
  }
  if (runner_.Post(picture).ok()) return {};
  const std::lock_guard lock(mutex_);  // busy: asked for again with the next frame
  std::erase_if(kept_,
                [&](const Kept& one) { return one.sha256 == picture->sha256 && !one.decoded; });
  return {};
}

cv::Mat PictureGallery::FindNow(const PicturePtr& picture) {
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(kept_.begin(), kept_.end(),
                                    [&](const Kept& one) { return one.sha256 == picture->sha256; });
    if (found != kept_.end() && found->decoded) return found->pixels;
    if (found == kept_.end()) kept_.push_front({picture->sha256, {}, false});
    if (kept_.size() > kKept) kept_.pop_back();
  }
  return Keep(*picture);
}

void PictureGallery::Step(Request request) {
  if (auto* read = std::get_if<ReadRequest>(&request)) {
    return read->done(ReadPictureFile(std::move(read->bytes)));
  }
  Keep(*std::get<PicturePtr>(request));
}

cv::Mat PictureGallery::Keep(const Picture& picture) {
  const cv::Mat pixels = DecodePicture(picture, kDrawnSide);
  const std::lock_guard lock(mutex_);
  for (Kept& one : kept_) {
    if (one.sha256 != picture.sha256) continue;
    one.pixels = pixels;
    one.decoded = true;
  }
  return pixels;
}

}  // namespace saccade
