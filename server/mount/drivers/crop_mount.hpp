#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <mutex>

#include "server/mount/encoder_ring.hpp"
#include "server/mount/mount.hpp"
#include "shared/camera/camera_model.hpp"

namespace saccade {

/// Digital gaze: a mount without motors. Its base is the real, fixed camera; what it turns is a
/// crop of that camera's picture, a virtual pinhole camera with the same optic centre. Joints are
/// where they are told at once; limits keep the crop inside the picture.
class CropMount final : public Mount {
 public:
  /// A crop of `width` x `height` pixels at the camera's own scale.
  /// InvalidArgument: not smaller than the picture, or too small to be of use.
  static absl::StatusOr<std::shared_ptr<CropMount>> Create(const CameraIntrinsics& camera,
                                                           int width, int height);

  const MountModel& model() const override { return model_; }
  absl::Status Send(const MountDemand& demand) override;
  void Stop() override {}
  std::optional<EncoderReading> Newest() const override;
  std::optional<MountAngles> AnglesAt(Timestamp time_ns) const override;
  MountStatus status() const override { return {}; }

  /// The virtual camera: pinhole, focal length of the real one.
  const CameraIntrinsics& view() const { return view_; }

 private:
  CropMount(const MountModel& model, const CameraIntrinsics& view) : model_(model), view_(view) {}

  const MountModel model_;
  const CameraIntrinsics view_;
  mutable std::mutex mutex_;
  MountAngles angles_;
};

}  // namespace saccade
