#pragma once

#include <list>
#include <mutex>
#include <opencv2/core.hpp>
#include <string>
#include <variant>

#include "server/pipeline/commands.hpp"
#include "server/pipeline/runner.hpp"
#include "shared/scene/annotation.hpp"

namespace saccade {

/// Pictures that are pinned up: read and decoded on a thread of its own, and kept small, to be
/// drawn. Any thread.
class PictureGallery {
 public:
  static constexpr int kDrawnSide = 512;       // [px]
  static constexpr std::size_t kKept = 64;     // decoded, 0.8 MB each at most
  static constexpr std::size_t kWaiting = 16;  // to be read

  PictureGallery();
  ~PictureGallery() { Stop(); }
  void Stop() { runner_.Stop(); }

  /// ReadPictureFile. ResourceExhausted: too many wait.
  void Read(std::string bytes, Done<PicturePtr> done);
  /// What to draw; empty: not decoded yet, which it asks for, or not to be decoded at all.
  cv::Mat Find(const PicturePtr& picture);
  /// The same, decoded here where it is not yet: for what is drawn once, and whose thread may wait.
  cv::Mat FindNow(const PicturePtr& picture);

 private:
  struct ReadRequest {
    std::string bytes;
    Done<PicturePtr> done;
  };
  using Request = std::variant<ReadRequest, PicturePtr>;
  struct Kept {
    std::string sha256;
    cv::Mat pixels;
    bool decoded = false;
  };
  void Step(Request request);
  cv::Mat Keep(const Picture& picture);

  std::mutex mutex_;
  std::list<Kept> kept_;    // most recently used first
  Runner<Request> runner_;  // last
};

}  // namespace saccade
