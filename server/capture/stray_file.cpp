#include "server/capture/stray_file.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>

namespace saccade {
namespace {

using std::string_view_literals::operator""sv;

constexpr char kConvert[] = "; convert it to PNG or JPEG";

struct Kind {
  std::string_view magic;
  const char* words;
};
constexpr Kind kPictures[] = {
    {"GIF8"sv, "is a GIF"},
    {"\xFF\x0A"sv, "is JPEG XL"},
    {"\0\0\0\x0CJXL "sv, "is JPEG XL"},
    {"\0\0\0\x0CjP  "sv, "is JPEG 2000"},
    {"\xFF\x4F\xFF\x51"sv, "is JPEG 2000"},
    {"8BPS"sv, "is a Photoshop document"},
    {"\x76\x2F\x31\x01"sv, "is OpenEXR"},
    {"#?RADIANCE"sv, "is a Radiance HDR picture"},
    {"FUJIFILM"sv, "is a camera's raw picture"},
    {"II\x2B\0"sv, "is a BigTIFF"},
    {"\x93NUMPY"sv, "is a NumPy array"},
};
constexpr Kind kOthers[] = {
    {"version https://git-lfs.github.com/"sv,
     "is a Git LFS pointer, not the file itself; run `git lfs pull` where it was cloned"},
    {"/annex/objects/"sv, "is a git-annex pointer, not the file itself; run `git annex get`"},
    {"PK\x03\x04"sv, "is a ZIP archive; unpack it"},
    {"\x1F\x8B"sv, "is compressed by gzip; unpack it"},
    {"\x28\xB5\x2F\xFD"sv, "is compressed by zstd; unpack it"},
    {"%PDF"sv, "is a PDF"},
    {"\x1A\x45\xDF\xA3"sv,
     "is a video (Matroska); take its pictures out, or give the video itself"},
    {"<!DOCTYPE html"sv, "is a web page, not the file: the download failed or needs a login"},
    {"<html"sv, "is a web page, not the file: the download failed or needs a login"},
};

/// ISO media files name what they are in their first box.
std::string NameOfBox(std::string_view data) {
  if (data.size() < 12 || data.substr(4, 4) != "ftyp") return "";
  const std::string_view brand = data.substr(8, 4);
  if (brand == "avif" || brand == "avis") return absl::StrCat("is AVIF", kConvert);
  for (const std::string_view heif :
       {"heic", "heix", "heim", "heis", "hevc", "hevx", "mif1", "msf1"}) {
    if (brand == heif) return absl::StrCat("is HEIF (as phones save pictures)", kConvert);
  }
  if (brand == "crx ") return absl::StrCat("is a camera's raw picture", kConvert);
  return "is a video (MP4); take its pictures out, or give the video itself";
}

}  // namespace

std::string NameOfStray(std::string_view data) {
  const absl::string_view begin(data.data(), std::min<std::size_t>(data.size(), 64));
  for (const Kind& kind : kOthers) {
    if (absl::StartsWithIgnoreCase(begin, {kind.magic.data(), kind.magic.size()})) {
      return kind.words;
    }
  }
  for (const Kind& kind : kPictures) {
    if (data.starts_with(kind.magic)) return absl::StrCat(kind.words, kConvert);
  }
  return NameOfBox(data);
}

}  // namespace saccade
