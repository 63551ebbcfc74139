#include "client/decode/video_decoder.hpp"

#include <absl/strings/str_cat.h>
#include <wels/codec_api.h>

#include <opencv2/imgproc.hpp>
#include <utility>

namespace saccade::decode {

class VideoDecoder::Impl {
 public:
  explicit Impl(ISVCDecoder* decoder) : decoder_(decoder) {}
  ~Impl() {
    decoder_->Uninitialize();
    WelsDestroyDecoder(decoder_);
  }

  absl::StatusOr<cv::Mat> Decode(const std::string& access_unit) {
    unsigned char* planes[3] = {};
    SBufferInfo info{};
    const auto* data = reinterpret_cast<const unsigned char*>(access_unit.data());
    const int state =
        decoder_->DecodeFrameNoDelay(data, static_cast<int>(access_unit.size()), planes, &info);
    if (state != dsErrorFree || info.iBufferStatus != 1) {
      return absl::DataLossError(absl::StrCat("OpenH264 cannot decode this picture (", state, ")"));
    }
    const SSysMEMBuffer& buffer = info.UsrData.sSystemBuffer;
    Gather(planes, buffer);
    cv::Mat picture;
    cv::cvtColor(i420_, picture, cv::COLOR_YUV2RGBA_I420);
    return picture;
  }

 private:
  // The decoder's rows are longer than the picture's.
  void Gather(unsigned char* const (&planes)[3], const SSysMEMBuffer& buffer) {
    const int width = buffer.iWidth, height = buffer.iHeight;
    i420_.create(height * 3 / 2, width, CV_8UC1);
    cv::Mat(height, width, CV_8UC1, planes[0], static_cast<std::size_t>(buffer.iStride[0]))
        .copyTo(i420_.rowRange(0, height));
    unsigned char* out = i420_.ptr(height);
    for (int plane = 1; plane < 3; ++plane) {
      const cv::Mat from(height / 2, width / 2, CV_8UC1, planes[plane],
                         static_cast<std::size_t>(buffer.iStride[1]));
      cv::Mat to(height / 2, width / 2, CV_8UC1, out);
      from.copyTo(to);
      out += to.total();
    }
  }

  ISVCDecoder* const decoder_;
  cv::Mat i420_;
};

VideoDecoder::VideoDecoder(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VideoDecoder::~VideoDecoder() = default;

absl::StatusOr<std::unique_ptr<VideoDecoder>> VideoDecoder::Create() {
  ISVCDecoder* decoder = nullptr;
  if (WelsCreateDecoder(&decoder) != 0 || decoder == nullptr) {
    return absl::InternalError("OpenH264 makes no decoder");
  }
  auto impl = std::make_unique<Impl>(decoder);
  SDecodingParam parameters{};
  parameters.sVideoProperty.eVideoBsType = VIDEO_BITSTREAM_AVC;
  parameters.eEcActiveIdc = ERROR_CON_DISABLE;
  if (const long code = decoder->Initialize(&parameters); code != 0) {
    return absl::InternalError(absl::StrCat("OpenH264 refuses to decode (", code, ")"));
  }
  int level = WELS_LOG_QUIET;
  decoder->SetOption(DECODER_OPTION_TRACE_LEVEL, &level);
  return std::unique_ptr<VideoDecoder>(new VideoDecoder(std::move(impl)));
}

absl::StatusOr<cv::Mat> VideoDecoder::Decode(const std::string& access_unit) {
  return impl_->Decode(access_unit);
}

}  // namespace saccade::decode
