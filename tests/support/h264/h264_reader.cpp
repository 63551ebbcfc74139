#include "tests/support/h264/h264_reader.hpp"

#include <wels/codec_api.h>

#include <cmath>

namespace saccade::testing {

std::vector<int> NalTypes(const std::string& access_unit) {
  std::vector<int> types;
  for (std::size_t i = 0; i + 3 < access_unit.size(); ++i) {
    if (access_unit[i] == 0 && access_unit[i + 1] == 0 && access_unit[i + 2] == 1) {
      types.push_back(access_unit[i + 3] & 0x1f);
    }
  }
  return types;
}

class H264Reader::Impl {
 public:
  Impl() {
    WelsCreateDecoder(&decoder_);
    SDecodingParam parameters{};
    parameters.sVideoProperty.eVideoBsType = VIDEO_BITSTREAM_AVC;
    parameters.eEcActiveIdc = ERROR_CON_DISABLE;
    decoder_->Initialize(&parameters);
    int level = WELS_LOG_QUIET;
    decoder_->SetOption(DECODER_OPTION_TRACE_LEVEL, &level);
  }
  ~Impl() {
    decoder_->Uninitialize();
    WelsDestroyDecoder(decoder_);
  }

  cv::Mat Decode(const std::string& access_unit) {
    unsigned char* planes[3] = {};
    SBufferInfo info{};
    const auto* data = reinterpret_cast<const unsigned char*>(access_unit.data());
    const int state =
        decoder_->DecodeFrameNoDelay(data, static_cast<int>(access_unit.size()), planes, &info);
    if (state != dsErrorFree || info.iBufferStatus != 1) return {};
    const SSysMEMBuffer& buffer = info.UsrData.sSystemBuffer;
    return cv::Mat(buffer.iHeight, buffer.iWidth, CV_8UC1, planes[0],
                   static_cast<std::size_t>(buffer.iStride[0]))
        .clone();
  }

 private:
  ISVCDecoder* decoder_ = nullptr;
};

H264Reader::H264Reader() : impl_(std::make_unique<Impl>()) {}
H264Reader::~H264Reader() = default;
cv::Mat H264Reader::DecodeLuma(const std::string& access_unit) {
  return impl_->Decode(access_unit);
}

double Psnr(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat difference;
  cv::subtract(a, b, difference, cv::noArray(), CV_32F);
  const double mean_square = difference.dot(difference) / static_cast<double>(a.total());
  return mean_square == 0.0 ? 100.0 : 10.0 * std::log10(255.0 * 255.0 / mean_square);
}

}  // namespace saccade::testing
