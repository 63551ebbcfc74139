#include "server/encode/video_encoder.hpp"

#include <absl/strings/str_cat.h>
#include <wels/codec_api.h>

#include <algorithm>
#include <cmath>

#include "server/encode/i420.hpp"

namespace saccade {
namespace {

constexpr int kTemporalLayers = 3;
constexpr double kDefaultBitsPerPixelSecond = 2e6 / (640.0 * 480.0);

struct EncoderDeleter {
  void operator()(ISVCEncoder* encoder) const {
    encoder->Uninitialize();
    WelsDestroySVCEncoder(encoder);
  }
};
using EncoderPtr = std::unique_ptr<ISVCEncoder, EncoderDeleter>;

// Says in the stream what ToI420 does, or players guess by picture size.
void DescribeColour(SSpatialLayerConfig& layer) {
  layer.bVideoSignalTypePresent = true;
  layer.uiVideoFormat = VF_UNDEF;
  layer.bFullRange = false;
  layer.bColorDescriptionPresent = true;
  layer.uiColorPrimaries = CP_SMPTE170M;
  layer.uiTransferCharacteristics = TRC_SMPTE170M;
  layer.uiColorMatrix = CM_SMPTE170M;
}

void Configure(const VideoEncoderOptions& options, SEncParamExt& parameters) {
  parameters.iUsageType = CAMERA_VIDEO_REAL_TIME;
  parameters.iPicWidth = options.width & ~1;
  parameters.iPicHeight = options.height & ~1;
  parameters.iTargetBitrate = options.bit_rate_bit_s;
  parameters.iMaxBitrate = UNSPECIFIED_BIT_RATE;
  parameters.iRCMode = RC_BITRATE_MODE;
  parameters.bEnableFrameSkip = false;  // every frame has its pose; none may vanish
  parameters.fMaxFrameRate = static_cast<float>(options.fps_hz);
  parameters.iTemporalLayerNum = kTemporalLayers;
  parameters.iSpatialLayerNum = 1;
  parameters.uiIntraPeriod = 0;  // key frames on demand only
  parameters.eSpsPpsIdStrategy = CONSTANT_ID;
  parameters.bPrefixNalAddingCtrl = false;
  parameters.iEntropyCodingModeFlag = 0;  // CAVLC: baseline
  parameters.iMultipleThreadIdc = 1;      // one picture takes 3 to 5 ms; cores are the tracker's
  parameters.iComplexityMode = LOW_COMPLEXITY;
  parameters.bEnableDenoise = false;
  parameters.bEnableBackgroundDetection = false;
  parameters.bEnableSceneChangeDetect = false;  // a key frame nobody asked for is a burst
  parameters.bEnableLongTermReference = false;
  SSpatialLayerConfig& layer = parameters.sSpatialLayers[0];
  layer.iVideoWidth = parameters.iPicWidth;
  layer.iVideoHeight = parameters.iPicHeight;
  layer.fFrameRate = parameters.fMaxFrameRate;
  layer.iSpatialBitrate = parameters.iTargetBitrate;
  layer.iMaxSpatialBitrate = UNSPECIFIED_BIT_RATE;
  layer.uiProfileIdc = PRO_BASELINE;
  layer.sSliceArgument.uiSliceMode = SM_SINGLE_SLICE;
  DescribeColour(layer);
}

EncodedPicture Collect(const SFrameBSInfo& info) {
  auto data = std::make_shared<std::string>();
  data->reserve(static_cast<std::size_t>(info.iFrameSizeInBytes));
  EncodedPicture picture;
  for (int i = 0; i < info.iLayerNum; ++i) {
    const SLayerBSInfo& layer = info.sLayerInfo[i];
    int bytes = 0;
    for (int nal = 0; nal < layer.iNalCount; ++nal) bytes += layer.pNalLengthInByte[nal];
    data->append(reinterpret_cast<const char*>(layer.pBsBuf), static_cast<std::size_t>(bytes));
    if (layer.uiLayerType == VIDEO_CODING_LAYER) picture.temporal_layer = layer.uiTemporalId;
  }
  picture.key_frame = info.eFrameType == videoFrameTypeIDR;
  picture.data = std::move(data);
  return picture;
}

}  // namespace

absl::Status VideoEncoderOptions::Validate() const {
  if (width < 16 || width > 4096 || height < 16 || height > 4096) {
    return absl::InvalidArgumentError(absl::StrCat("encoder: picture of ", width, " x ", height,
                                                   " px: each side must be 16 to 4096"));
  }
  if (!(fps_hz >= 1.0 && fps_hz <= 240.0)) {
    return absl::InvalidArgumentError(absl::StrCat("encoder: fps_hz ", fps_hz, ": 1 to 240"));
  }
  if (bit_rate_bit_s != 0 &&
      (bit_rate_bit_s < kLeastBitRate_bit_s || bit_rate_bit_s > kMostBitRate_bit_s)) {
    return absl::InvalidArgumentError(absl::StrCat("encoder: bit_rate_bit_s ", bit_rate_bit_s, ": ",
                                                   kLeastBitRate_bit_s, " to ",
                                                   kMostBitRate_bit_s));
  }
  return absl::OkStatus();
}

class VideoEncoder::Impl {
 public:
  Impl(const VideoEncoderOptions& options, EncoderPtr encoder)
      : options_(options), encoder_(std::move(encoder)) {}

  absl::StatusOr<EncodedPicture> Encode(const cv::Mat& picture, bool force_key_frame) {
    if (picture.cols != options_.width || picture.rows != options_.height ||
        (picture.type() != CV_8UC1 && picture.type() != CV_8UC3)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "encoder: picture of ", picture.cols, " x ", picture.rows, " type ", picture.type(),
          "; needs ", options_.width, " x ", options_.height, " grey or BGR, 8 bits"));
    }
    ToI420(picture, i420_);
    SSourcePicture source = Describe();
    if (force_key_frame) encoder_->ForceIntraFrame(true);
    SFrameBSInfo info{};
    const int result = encoder_->EncodeFrame(&source, &info);
    if (result != cmResultSuccess || info.eFrameType == videoFrameTypeInvalid) {
      return absl::InternalError(absl::StrCat("encoder: OpenH264 error ", result));
    }
    if (info.eFrameType == videoFrameTypeSkip) {
      return absl::InternalError("encoder: OpenH264 skipped a picture");
    }
    return Collect(info);
  }

  void SetFrameRate(double fps_hz) {
    constexpr double kSlowest = 1.0 / 6.0;
    constexpr double kAsGood = 0.15;  // so much off it stays: rate control begins anew with each
    if (!std::isfinite(fps_hz)) return;
    const double wanted = std::clamp(fps_hz, kSlowest * options_.fps_hz, options_.fps_hz);
    if (std::abs(wanted - fps_hz_) <= kAsGood * fps_hz_) return;
    auto rate = static_cast<float>(wanted);
    if (encoder_->SetOption(ENCODER_OPTION_FRAME_RATE, &rate) == cmResultSuccess) fps_hz_ = wanted;
  }

  const VideoEncoderOptions& options() const { return options_; }

 private:
  SSourcePicture Describe() {
    const int width = options_.width & ~1;
    const int height = options_.height & ~1;
    SSourcePicture source{};
    source.iColorFormat = videoFormatI420;
    source.iPicWidth = width;
    source.iPicHeight = height;
    source.iStride[0] = width;
    source.iStride[1] = source.iStride[2] = width / 2;
    source.pData[0] = i420_.data;
    source.pData[1] = i420_.data + width * height;
    source.pData[2] = source.pData[1] + width * height / 4;
    // Evenly spaced, whatever the scene's clock does: rate control shares bits by these.
    source.uiTimeStamp = std::llround(time_ms_);
    time_ms_ += 1e3 / fps_hz_;
    return source;
  }

  const VideoEncoderOptions options_;
  EncoderPtr encoder_;
  cv::Mat i420_;
  double fps_hz_ = options_.fps_hz;
  double time_ms_ = 0.0;
};

VideoEncoder::VideoEncoder(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VideoEncoder::~VideoEncoder() = default;

absl::StatusOr<std::unique_ptr<VideoEncoder>> VideoEncoder::Create(
    const VideoEncoderOptions& given) {
  if (absl::Status valid = given.Validate(); !valid.ok()) return valid;
  VideoEncoderOptions options = given;
  if (options.bit_rate_bit_s == 0) {
    options.bit_rate_bit_s = std::max(
        200'000, static_cast<int>(kDefaultBitsPerPixelSecond * options.width * options.height));
  }
  ISVCEncoder* raw = nullptr;
  if (WelsCreateSVCEncoder(&raw) != 0 || raw == nullptr) {
    return absl::InternalError("encoder: OpenH264 could not be created");
  }
  EncoderPtr encoder(raw);
  int level = WELS_LOG_ERROR;
  encoder->SetOption(ENCODER_OPTION_TRACE_LEVEL, &level);
  SEncParamExt parameters{};
  encoder->GetDefaultParams(&parameters);
  Configure(options, parameters);
  if (const int result = encoder->InitializeExt(&parameters); result != cmResultSuccess) {
    return absl::InternalError(absl::StrCat("encoder: OpenH264 refused ", options.width, " x ",
                                            options.height, " at ", options.bit_rate_bit_s,
                                            " bit/s: error ", result));
  }
  return std::unique_ptr<VideoEncoder>(
      new VideoEncoder(std::make_unique<Impl>(options, std::move(encoder))));
}

absl::StatusOr<EncodedPicture> VideoEncoder::Encode(const cv::Mat& picture, bool force_key_frame) {
  return impl_->Encode(picture, force_key_frame);
}

void VideoEncoder::SetFrameRate(double fps_hz) { impl_->SetFrameRate(fps_hz); }

int VideoEncoder::coded_width() const { return impl_->options().width & ~1; }
int VideoEncoder::coded_height() const { return impl_->options().height & ~1; }

}  // namespace saccade
