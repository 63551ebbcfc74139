#include "shared/models/gltf_preflight.hpp"

#include <absl/strings/str_cat.h>

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>

namespace saccade {
namespace {

using nlohmann::json;

constexpr std::uint32_t kMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinChunk = 0x004e4942;
constexpr std::size_t kHeader = 12, kChunkHeader = 8;

absl::Status Bad(absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("model: ", why));
}

std::uint32_t Word(absl::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);  // little-endian, as every machine it runs on
  return word;
}

struct Chunks {
  absl::string_view text, binary;
};

absl::StatusOr<Chunks> Split(absl::string_view bytes) {
  if (bytes.size() < kHeader + kChunkHeader || Word(bytes, 0) != kMagic) {
    return Bad("not a GLB file; export it as glTF binary (.glb)");
  }
  if (Word(bytes, 4) != 2) {
    return Bad(absl::StrCat("glTF version ", Word(bytes, 4), "; export it as glTF 2.0"));
  }
  if (Word(bytes, 8) != bytes.size()) {
    return Bad(absl::StrCat("torn: it says ", Word(bytes, 8), " bytes and has ", bytes.size(),
                            "; copy it again"));
  }
  Chunks chunks;
  std::size_t at = kHeader;
  for (int index = 0; at < bytes.size(); ++index) {
    if (bytes.size() - at < kChunkHeader || Word(bytes, at) > bytes.size() - at - kChunkHeader) {
      return Bad(absl::StrCat("torn: chunk ", index, " runs beyond its end; copy it again"));
    }
    const std::uint32_t length = Word(bytes, at), kind = Word(bytes, at + 4);
    const absl::string_view body = bytes.substr(at + kChunkHeader, length);
    if ((index == 0) != (kind == kJsonChunk)) return Bad("its first chunk is not JSON");
    if (index == 0) chunks.text = body;
    if (index == 1 && kind == kBinChunk) chunks.binary = body;
    at += kChunkHeader + length;
  }
  return chunks;
}

/// The array of that name; an empty one if there is none.
const json& List(const json& root, const char* name) {
  static const json kNone = json::array();
  const auto found = root.find(name);
  return found != root.end() && found->is_array() ? *found : kNone;
}

std::size_t Count(const json& object, const char* name) {
  if (!object.is_object()) return 0;
  const auto found = object.find(name);
  return found != object.end() && found->is_number_unsigned() ? found->get<std::size_t>() : 0;
}

absl::Status CheckCounts(const json& root, const GltfLimits& limits) {
  if (List(root, "nodes").size() > limits.nodes) {
    return absl::ResourceExhaustedError(absl::StrCat("model: ", List(root, "nodes").size(),
                                                     " nodes; at most ", limits.nodes,
                                                     ": join its parts"));
  }
  const json& accessors = List(root, "accessors");
  std::size_t vertices = 0, corners = 0;
  for (const json& mesh : List(root, "meshes")) {
    if (!mesh.is_object()) return Bad("a mesh that is no object");
    for (const json& part : List(mesh, "primitives")) {
      if (!part.is_object()) return Bad("a primitive that is no object");
      const auto attributes = part.find("attributes");
      const std::size_t position = attributes == part.end() ? 0 : Count(*attributes, "POSITION");
      const std::size_t here =
          position < accessors.size() ? Count(accessors[position], "count") : 0;
      vertices += here;
      const std::size_t index = Count(part, "indices");
      const bool indexed = part.contains("indices") && index < accessors.size();
      const std::size_t mode = part.contains("mode") ? Count(part, "mode") : 4;
      const std::size_t uses = indexed ? Count(accessors[index], "count") : here;
      corners += mode == 4 ? uses : mode > 4 ? 3 * uses : 0;
      if (vertices > limits.vertices || corners / 3 > limits.triangles) {
        return absl::ResourceExhaustedError(absl::StrCat(
            "model: more than ", limits.triangles, " triangles or ", limits.vertices, " vertices (",
            corners / 3, " and ", vertices,
            " counted so far); simplify it (Blender: modifier Decimate) and export it again"));
      }
    }
  }
  return absl::OkStatus();
}

absl::Status CheckParts(const json& root) {
  for (const json& name : List(root, "extensionsRequired")) {
    return Bad(absl::StrCat("needs the extension ",
                            name.is_string() ? name.get<std::string>() : "?",
                            "; export it without compression and extensions"));
  }
  for (const json& buffer : List(root, "buffers")) {
    if (!buffer.is_object()) return Bad("a buffer that is no object");
    if (buffer.contains("uri")) {
      return Bad("needs files beside it (a buffer with a uri); export it as one .glb");
    }
  }
  for (const json& accessor : List(root, "accessors")) {
    if (!accessor.is_object()) return Bad("an accessor that is no object");
    if (accessor.contains("sparse")) {
      return Bad("has sparse data; export it without shape keys");
    }
  }
  return absl::OkStatus();
}

void PutWord(std::size_t word, std::string& out) {
  const auto narrow = static_cast<std::uint32_t>(word);
  out.append(reinterpret_cast<const char*>(&narrow), sizeof narrow);
}

std::string Join(std::string text, absl::string_view binary) {
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string out;
  const std::size_t tail = binary.empty() ? 0 : kChunkHeader + binary.size();
  PutWord(kMagic, out);
  PutWord(2, out);
  PutWord(kHeader + kChunkHeader + text.size() + tail, out);
  PutWord(text.size(), out);
  PutWord(kJsonChunk, out);
  out += text;
  if (binary.empty()) return out;
  PutWord(binary.size(), out);
  PutWord(kBinChunk, out);
  out.append(binary.data(), binary.size());
  return out;
}

}  // namespace

absl::StatusOr<std::string> PreflightGlb(absl::string_view bytes, const GltfLimits& limits) {
  if (bytes.size() > limits.bytes) {
    return absl::ResourceExhaustedError(absl::StrCat("model: ", bytes.size(), " bytes; at most ",
                                                     limits.bytes,
                                                     ": simplify it, leave its pictures out"));
  }
  const absl::StatusOr<Chunks> chunks = Split(bytes);
  if (!chunks.ok()) return chunks.status();
  json root = json::parse(chunks->text.begin(), chunks->text.end(), nullptr, false);
  if (!root.is_object()) return Bad("its JSON cannot be read; export it again");
  absl::Status valid = CheckParts(root);
  if (valid.ok()) valid = CheckCounts(root, limits);
  if (!valid.ok()) return valid;
  for (const char* unused : {"images", "textures", "samplers", "animations", "skins", "cameras",
                             "extensions", "extensionsUsed"}) {
    root.erase(unused);
  }
  return Join(root.dump(-1, ' ', false, json::error_handler_t::replace), chunks->binary);
}

}  // namespace saccade
