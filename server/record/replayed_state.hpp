#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "saccade/v1/video.pb.h"
#include "server/pipeline/events.hpp"
#include "server/record/mcap_reader.hpp"

namespace saccade {

/// What a recording says is known, message after message: turns them back into what an engine
/// publishes. Times of the recording become those of now, frame ids and map generations never go
/// back, whatever is sought. One thread.
class ReplayedState {
 public:
  /// Forgets everything: what follows is another moment, and begins with whole states.
  void Restart();
  /// When the pictures that follow are to seem taken [ns, monotonic].
  void SetTime(Timestamp now_ns) { now_ns_ = now_ns; }

  /// Takes a message. What is to be told of it goes to `sink`; null: nothing is told. DataLoss: it
  /// is not as this version writes it.
  absl::Status Take(const McapReader::Message& message, EventSink* sink);

  /// Tells the newest pose once more, as of now: nobody is to think that the camera is away.
  void TellAgain(EventSink& sink);

  /// After the first picture.
  std::shared_ptr<const CameraModel> camera() const { return camera_; }
  std::shared_ptr<const AnnotationList> annotations() const { return annotations_; }
  std::shared_ptr<const GazeSnapshot> gaze() const { return gaze_; }
  /// Never null.
  std::shared_ptr<const SurfaceSnapshot> surface() const { return surface_; }
  std::uint64_t pictures() const { return sequence_; }
  /// Nothing before the first pose.
  const std::optional<TrackedEvent>& newest() const { return newest_; }

 private:
  absl::Status TakePose(const McapReader::Message& message, EventSink* sink);
  absl::Status TakePicture(const McapReader::Message& message);
  absl::Status TakeVideo(const McapReader::Message& message, EventSink* sink);
  absl::Status TakeMap(const McapReader::Message& message);
  absl::Status TakeAnnotations(const McapReader::Message& message);
  void ForgetSurface();
  absl::Status TakeSurface(const McapReader::Message& message, EventSink* sink);
  absl::StatusOr<TrackedEvent> EventOf(const v1::PoseEvent& pose) const;

  Timestamp now_ns_ = 0;
  FrameId first_id_ = 0, last_id_ = 0;  // added to recorded ids; the highest told
  std::uint64_t generation_ = 0, recorded_generation_ = 0, sequence_ = 0;
  std::map<FeatureId, FeatureSnapshot> features_;
  std::map<std::string, Annotation> by_id_;
  std::shared_ptr<const AnnotationList> annotations_ = std::make_shared<const AnnotationList>();
  std::shared_ptr<const GazeSnapshot> gaze_ = std::make_shared<const GazeSnapshot>();
  std::shared_ptr<const SurfaceSnapshot> surface_ = std::make_shared<const SurfaceSnapshot>();
  std::uint64_t surface_edition_ = FirstSurfaceEdition(), recorded_edition_ = 0;
  std::shared_ptr<const CameraModel> camera_;
  std::string lens_;                       // the same, as recorded
  std::optional<v1::AccessUnit> picture_;  // its bytes come with the next message
  std::optional<TrackedEvent> newest_;
};

}  // namespace saccade
