#include "tests/integration/stream/h264_sink.hpp"

#include <wels/codec_api.h>

namespace saccade::testing {

class H264Sink::Impl {
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
  bool Decode(const std::string& access_unit) {
    unsigned char* planes[3] = {};
    SBufferInfo info{};
    const auto* data = reinterpret_cast<const unsigned char*>(access_unit.data());
    return decoder_->DecodeFrameNoDelay(data, static_cast<int>(access_unit.size()), planes,
                                        &info) == dsErrorFree &&
           info.iBufferStatus == 1;
  }

 private:
  ISVCDecoder* decoder_ = nullptr;
};

H264Sink::H264Sink() : impl_(std::make_unique<Impl>()) {}
H264Sink::~H264Sink() = default;
bool H264Sink::Decode(const std::string& access_unit) { return impl_->Decode(access_unit); }

}  // namespace saccade::testing
