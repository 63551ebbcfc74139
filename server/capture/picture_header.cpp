#include "server/capture/picture_header.hpp"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "server/capture/stray_file.hpp"

namespace saccade {
namespace {

using Bytes = std::span<const std::uint8_t>;
using MaybeSize = std::optional<std::pair<std::uint64_t, std::uint64_t>>;  // width, height

bool StartsWith(Bytes data, std::string_view magic) {
  return data.size() >= magic.size() && std::memcmp(data.data(), magic.data(), magic.size()) == 0;
}

/// Unsigned number of `size` bytes at `at`; 0 beyond the end.
std::uint64_t Number(Bytes data, std::size_t at, std::size_t size, bool big_endian) {
  if (at > data.size() || size > data.size() - at) return 0;
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) {
    value = value << 8 | data[at + (big_endian ? i : size - 1 - i)];
  }
  return value;
}
std::uint64_t Big(Bytes data, std::size_t at, std::size_t size) {
  return Number(data, at, size, true);
}
std::uint64_t Little(Bytes data, std::size_t at, std::size_t size) {
  return Number(data, at, size, false);
}

MaybeSize PngSize(Bytes data) {
  if (Big(data, 8, 4) != 13 ||
      !StartsWith(data.subspan(std::min<std::size_t>(12, data.size())), "IHDR")) {
    return std::nullopt;
  }
  return {{Big(data, 16, 4), Big(data, 20, 4)}};
}

/// The first frame header (SOF) before the first scan.
MaybeSize JpegSize(Bytes data) {
  for (std::size_t at = 2; at + 4 <= data.size();) {
    if (data[at] != 0xFF) return std::nullopt;
    const std::uint8_t marker = data[at + 1];
    if (marker == 0xFF) {  // filling
      ++at;
    } else if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8)) {
      at += 2;
    } else if (marker == 0xDA || marker == 0xD9) {
      return std::nullopt;
    } else if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 &&
               marker != 0xCC) {
      return {{Big(data, at + 7, 2), Big(data, at + 5, 2)}};
    } else {
      at += 2 + Big(data, at + 2, 2);
    }
  }
  return std::nullopt;
}

MaybeSize PnmSize(Bytes data) {
  std::uint64_t numbers[2] = {0, 0};
  std::size_t at = 2;
  for (std::uint64_t& number : numbers) {
    while (at < data.size() && (absl::ascii_isspace(data[at]) || data[at] == '#')) {
      if (data[at] == '#') {
        while (at < data.size() && data[at] != '\n') ++at;
      } else {
        ++at;
      }
    }
    while (at < data.size() && absl::ascii_isdigit(data[at])) {
      number = std::min<std::uint64_t>(10 * number + (data[at++] - '0'), 1'000'000'000);
    }
  }
  return {{numbers[0], numbers[1]}};
}

MaybeSize BmpSize(Bytes data) {
  if (Little(data, 14, 4) == 12) return {{Little(data, 18, 2), Little(data, 20, 2)}};
  const auto height = static_cast<std::int32_t>(Little(data, 22, 4));  // negative: top line first
  return {{Little(data, 18, 4), static_cast<std::uint64_t>(std::abs(std::int64_t{height}))}};
}

/// The first directory; a tag that comes twice counts with its larger value.
MaybeSize TiffSize(Bytes data) {
  const bool big = data[0] == 'M';
  const std::size_t directory = Number(data, 4, 4, big);
  const std::uint64_t entries = Number(data, directory, 2, big);
  std::uint64_t size[2] = {0, 0};
  for (std::uint64_t i = 0; i < entries; ++i) {
    const std::size_t at = directory + 2 + 12 * i;
    const std::uint64_t tag = Number(data, at, 2, big), type = Number(data, at + 2, 2, big);
    if (tag != 256 && tag != 257) continue;
    std::uint64_t& out = size[tag - 256];
    out = std::max(out, Number(data, at + 8, type == 3 ? 2 : 4, big));
  }
  return {{size[0], size[1]}};
}

MaybeSize WebpSize(Bytes data) {
  const Bytes chunk = data.subspan(std::min<std::size_t>(12, data.size()));
  if (StartsWith(chunk, "VP8X")) return {{Little(data, 24, 3) + 1, Little(data, 27, 3) + 1}};
  if (StartsWith(chunk, "VP8L")) {
    const std::uint64_t bits = Little(data, 21, 4);
    return {{(bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1}};
  }
  if (StartsWith(chunk, "VP8 ")) {
    return {{Little(data, 26, 2) & 0x3FFF, Little(data, 28, 2) & 0x3FFF}};
  }
  return std::nullopt;
}

}  // namespace

absl::StatusOr<cv::Size> ReadPictureSize(std::span<const std::uint8_t> data) {
  using std::string_view_literals::operator""sv;
  MaybeSize size;
  if (StartsWith(data, "\x89PNG\r\n\x1A\n"sv)) {
    size = PngSize(data);
  } else if (StartsWith(data, "\xFF\xD8\xFF"sv)) {
    size = JpegSize(data);
  } else if (data.size() > 2 && data[0] == 'P' && data[1] >= '1' && data[1] <= '6') {
    size = PnmSize(data);
  } else if (StartsWith(data, "BM"sv)) {
    size = BmpSize(data);
  } else if (StartsWith(data, "II*\0"sv) || StartsWith(data, "MM\0*"sv)) {
    size = TiffSize(data);
  } else if (StartsWith(data, "RIFF"sv)) {
    size = WebpSize(data);
  } else if (const std::string stray =
                 NameOfStray({reinterpret_cast<const char*>(data.data()), data.size()});
             !stray.empty()) {
    return absl::DataLossError(absl::StrCat("it ", stray));
  } else {
    return absl::DataLossError(
        "it is damaged or not a picture that is read here (PNG, JPEG, PNM, BMP, TIFF, WebP)");
  }
  constexpr std::uint64_t kMost = std::numeric_limits<int>::max();
  if (!size || size->first == 0 || size->second == 0 || size->first > kMost ||
      size->second > kMost) {
    return absl::DataLossError("its header is damaged: it gives no size");
  }
  return cv::Size(static_cast<int>(size->first), static_cast<int>(size->second));
}

}  // namespace saccade
