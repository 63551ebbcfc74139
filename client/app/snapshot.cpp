#include "client/app/snapshot.hpp"

#include <absl/strings/str_cat.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

namespace saccade::app {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kEndBytes = 12;  // of IEND

/// CRC-32 of a chunk's type and data (ISO 3309, as PNG 1.2, 3.4).
std::uint32_t Crc32(const std::string& bytes) {
  std::uint32_t crc = 0xffffffff;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xedb88320u : 0u);
  }
  return ~crc;
}

std::string BigEndian(std::uint32_t value) {
  std::string out;
  for (const int shift : {24, 16, 8, 0}) out += static_cast<char>(value >> shift & 0xff);
  return out;
}

}  // namespace

absl::StatusOr<std::string> WithText(const std::string& png, const std::string& keyword,
                                     const std::string& text) {
  if (png.size() < kEndBytes + 8 || png.compare(0, 4, "\x89PNG") != 0 ||
      png.compare(png.size() - 8, 4, "IEND") != 0) {
    return absl::InvalidArgumentError("the server's picture is not a whole PNG");
  }
  // keyword, its end, not compressed (2 bytes), no language, no translated keyword
  const std::string chunk = absl::StrCat("iTXt", keyword, std::string(5, '\0'), text);
  std::string out = png.substr(0, png.size() - kEndBytes);
  absl::StrAppend(&out, BigEndian(static_cast<std::uint32_t>(chunk.size() - 4)), chunk,
                  BigEndian(Crc32(chunk)), png.substr(png.size() - kEndBytes));
  return out;
}

fs::path PicturesFolder() {
  const char* pictures = std::getenv("XDG_PICTURES_DIR");
  if (pictures != nullptr && *pictures != 0) return pictures;
  const char* home = std::getenv("HOME");
  if (home == nullptr || *home == 0) return ".";
  std::error_code ignored;
  const fs::path folder = fs::path(home) / "Pictures";
  return fs::is_directory(folder, ignored) ? folder : fs::path(home);
}

absl::StatusOr<fs::path> KeepSnapshot(const net::Still& still, const std::vector<Annotation>& marks,
                                      const std::string& source, const std::string& taken_by,
                                      const fs::path& folder) {
  const Eigen::Vector3d& p = still.pose.world_from_camera.translation;
  const Eigen::Quaterniond& q = still.pose.world_from_camera.rotation;
  nlohmann::json facts = {
      {"frameId", still.frame_id},
      {"source", source},
      {"takenBy", taken_by},
      {"metric", still.pose.metric},
      {"worldFromCamera",
       {{"translation", {p.x(), p.y(), p.z()}}, {"rotationXyzw", {q.x(), q.y(), q.z(), q.w()}}}},
      {"marks", nlohmann::json::array()}};
  for (const Annotation& mark : marks) {
    facts["marks"].push_back({{"id", mark.id}, {"text", mark.text}, {"author", mark.author}});
  }
  const absl::StatusOr<std::string> png = WithText(
      still.png, "saccade", facts.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  if (!png.ok()) return png.status();
  const fs::path file = folder / absl::StrCat("saccade-", still.frame_id, ".png");
  std::ofstream out(file, std::ios::binary);
  out.write(png->data(), static_cast<std::streamsize>(png->size()));
  out.flush();
  if (out) return file;
  return absl::UnavailableError(absl::StrCat("cannot write ", file.string(),
                                             ": is the folder there, and the disk not full?"));
}

}  // namespace saccade::app
