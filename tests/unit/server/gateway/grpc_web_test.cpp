#include "server/gateway/grpc_web.hpp"

#include <gmock/gmock.h>

#include <string>

namespace saccade::grpc_web_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

std::string Bytes(std::initializer_list<int> bytes) {
  std::string out;
  for (const int byte : bytes) out.push_back(static_cast<char>(byte));
  return out;
}

TEST(GrpcWebFormatOf, KnowsBothFormatsAndNothingElse) {
  EXPECT_EQ(GrpcWebFormatOf("application/grpc-web+proto"), GrpcWebFormat::kBinary);
  EXPECT_EQ(GrpcWebFormatOf("Application/GRPC-web ; charset=x"), GrpcWebFormat::kBinary);
  EXPECT_EQ(GrpcWebFormatOf("application/grpc-web-text"), GrpcWebFormat::kText);
  EXPECT_FALSE(GrpcWebFormatOf("application/grpc-web+json"));
  EXPECT_FALSE(GrpcWebFormatOf("application/json"));
  EXPECT_FALSE(GrpcWebFormatOf(""));
}

TEST(GrpcWebFrames, MessageComesBackInBothFormats) {
  const std::string message = Bytes({0, 1, 2, 0xff, 0x80});
  for (const GrpcWebFormat format : {GrpcWebFormat::kBinary, GrpcWebFormat::kText}) {
    const auto decoded = DecodeGrpcWebRequest(EncodeGrpcWebMessage(message, format), format);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, message);
  }
  EXPECT_EQ(EncodeGrpcWebMessage("ab", GrpcWebFormat::kBinary), Bytes({0, 0, 0, 0, 2, 'a', 'b'}));
}

TEST(GrpcWebFrames, TextMayBeSeveralPaddedPieces) {
  // {0, 0, 0, 0} and {2, 'a', 'b'}, each encoded by itself.
  const auto decoded = DecodeGrpcWebRequest("AAAAAA==AmFi", GrpcWebFormat::kText);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, "ab");
}

TEST(GrpcWebFrames, MalformedRequestsAreRefused) {
  const auto code = [](const std::string& body, GrpcWebFormat format = GrpcWebFormat::kBinary) {
    return DecodeGrpcWebRequest(body, format).status().code();
  };
  EXPECT_EQ(code(""), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(Bytes({0, 0, 0, 0})), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(Bytes({0, 0, 0, 0, 2, 'a'})), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(Bytes({0, 0, 0, 0, 1, 'a', 'b'})), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(Bytes({0, 0xff, 0xff, 0xff, 0xff, 'a'})), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(Bytes({0x80, 0, 0, 0, 0})), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code(Bytes({1, 0, 0, 0, 0})), absl::StatusCode::kUnimplemented);
  EXPECT_EQ(code("%%%%", GrpcWebFormat::kText), absl::StatusCode::kInvalidArgument);
}

TEST(GrpcWebFrames, TrailersCarryStatusAndMetadata) {
  const std::string frame = EncodeGrpcWebTrailers(
      {3, "pixel.u: 9\n% off", "\x01\x02", {{"x-a", "1"}, {"x-b-bin", "\xff"}}},
      GrpcWebFormat::kBinary);
  EXPECT_EQ(frame.substr(0, 4), Bytes({0x80, 0, 0, 0}));
  EXPECT_EQ(static_cast<unsigned char>(frame[4]), frame.size() - 5);
  EXPECT_EQ(frame.substr(5),
            "grpc-status: 3\r\ngrpc-message: pixel.u: 9%0A%25 off\r\n"
            "grpc-status-details-bin: AQI=\r\nx-a: 1\r\nx-b-bin: /w==\r\n");
}

TEST(ParseGrpcTimeout, UnitsAndNonsense) {
  EXPECT_EQ(ParseGrpcTimeout("1500m"), milliseconds(1500));
  EXPECT_EQ(ParseGrpcTimeout("2S"), milliseconds(2000));
  EXPECT_EQ(ParseGrpcTimeout("7n"), nanoseconds(7));
  EXPECT_EQ(ParseGrpcTimeout("99999999H"), std::chrono::hours(7 * 24));
  for (const char* text : {"", "5", "m", "1.5S", "-1S", "999999999S", "5x", "5 S"}) {
    EXPECT_FALSE(ParseGrpcTimeout(text)) << text;
  }
}

TEST(IsMethodPath, OnlyServiceAndMethod) {
  EXPECT_TRUE(IsMethodPath("/saccade.v1.SessionService/Join"));
  for (const char* path : {"", "/", "/a", "/a/b/c", "a/b", "/a/..", "/a/b?x=1", "//b", "/a/b%20"}) {
    EXPECT_FALSE(IsMethodPath(path)) << path;
  }
}

}  // namespace
}  // namespace saccade::grpc_web_test
