#include "tests/lint/include_rules.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <optional>
#include <span>
#include <sstream>

namespace saccade::lint {
namespace {

using std::string_view;

// Listed along the data flow: a folder includes only itself and those before it.
constexpr auto kServerOrder = std::to_array<string_view>(
    {"pipeline", "mount",     "gl",       "capture", "sim",     "scene", "features",
     "markers",  "calibrate", "filter",   "map",     "surface", "team",  "tracker",
     "anchors",  "gaze",      "wearable", "overlay", "encode",  "store", "identity",
     "rpc",      "record",    "wear",     "audio",   "gateway", "eval",  "app"});
constexpr auto kClientOrder =
    std::to_array<string_view>({"net", "session", "talk", "decode", "tools", "view", "cli", "app"});
constexpr auto kSharedOrder =
    std::to_array<string_view>({"version", "io", "text", "geometry", "time", "audio", "camera",
                                "scene", "models", "marks", "wire", "render"});

// Folders that see less than what is above them: only snapshots, packets and commands.
struct Restriction {
  string_view folder;
  std::vector<string_view> may_see;
};
const std::vector<Restriction>& Restrictions() {
  static const std::vector<Restriction> restrictions = {
      {"server/rpc", {"server/rpc", "server/pipeline", "server/encode", "server/identity"}},
      {"server/gateway", {"server/gateway", "server/pipeline"}},
  };
  return restrictions;
}

// Third-party headers with one home.
struct Home {
  string_view prefix;  // of the include; ends_with if it starts with '*'
  std::vector<string_view> folders;
};
const std::vector<Home>& Homes() {
  static const std::vector<Home> homes = {
      {"*.grpc.pb.h", {"server/rpc", "server/audio", "client/net"}},
      {"*.pb.h",
       {"shared/wire", "server/rpc", "server/record", "server/wear", "server/audio", "client/net"}},
      {"grpcpp/", {"server/rpc", "server/audio", "server/gateway", "server/app", "client/net"}},
      {"boost/beast", {"server/gateway"}},
      {"sqlite3.h", {"server/store"}},
      {"openssl/", {"server/identity", "client/net"}},
      {"cjose/", {"server/identity"}},
      {"curl/", {"server/identity"}},
      {"qrencode.h", {"shared/io"}},
      {"alsa/", {"shared/audio"}},
      {"opus.h", {"shared/audio"}},
      {"speex/", {"shared/audio"}},
      {"wels/", {"server/encode", "client/decode"}},
      {"GL/osmesa.h", {"server/gl"}},
      {"EGL/", {"server/gl"}},
      {"GLFW/", {"client/view"}},
      {"imgui", {"client/view", "client/app"}},
      {"backends/imgui", {"client/view"}},
      {"hb.h", {"shared/text"}},
      {"ft2build.h", {"shared/text"}},
      {"fribidi.h", {"shared/text"}},
      {"fontconfig/", {"shared/text"}},
      {"libavformat/", {"server/capture"}},
      {"libavcodec/", {"server/capture"}},
      {"seccomp.h", {"server/capture"}},
      {"apriltag/", {"server/markers"}},
      {"cairo", {"server/markers"}},
      {"tiny_gltf.h", {"shared/models"}},
      {"fcl/", {"server/scene"}},
      {"opencv2/aruco", {"server/markers"}},
      {"opencv2/videoio", {}},
      {"opencv2/highgui", {}},
  };
  return homes;
}

// The first two parts of a path: "server/filter" of "server/filter/ekf.hpp".
string_view FolderOf(string_view path) {
  const auto first = path.find('/');
  if (first == string_view::npos) return path;
  return path.substr(0, path.find('/', first + 1));
}
string_view SideOf(string_view path) { return path.substr(0, path.find('/')); }
string_view NameOf(string_view folder) {
  const auto slash = folder.find('/');
  return slash == string_view::npos ? string_view{} : folder.substr(slash + 1);
}

std::optional<std::span<const string_view>> OrderOf(string_view side) {
  if (side == "server") return std::span<const string_view>(kServerOrder);
  if (side == "client") return std::span<const string_view>(kClientOrder);
  if (side == "shared") return std::span<const string_view>(kSharedOrder);
  return std::nullopt;
}

bool Contains(std::span<const string_view> list, string_view item) {
  return std::find(list.begin(), list.end(), item) != list.end();
}

// Why `file` may not include the project header `target`; nothing if it may.
std::optional<std::string> CheckProjectInclude(string_view file, string_view target) {
  const string_view side = SideOf(file), target_side = SideOf(target);
  if (target_side == "tests") return "only tests see tests/";
  // An integrator's program: the public API and the plain structs it speaks in.
  if (side == "examples") {
    if (target_side == "shared" || FolderOf(target) == "client/net") return std::nullopt;
    return "examples see only client/net and shared";
  }
  if (side == "shared" && target_side != "shared") return "shared sees only shared and proto";
  if (side != target_side && target_side != "shared") {
    return std::string(side) + " never sees " + std::string(target_side);
  }
  if (side != target_side) return std::nullopt;
  const string_view folder = FolderOf(file), target_folder = FolderOf(target);
  for (const Restriction& restriction : Restrictions()) {
    if (restriction.folder == folder && !Contains(restriction.may_see, target_folder)) {
      return std::string(folder) + " sees only snapshots, packets and commands";
    }
  }
  const auto order = *OrderOf(side);
  const auto own = std::find(order.begin(), order.end(), NameOf(folder));
  const auto other = std::find(order.begin(), order.end(), NameOf(target_folder));
  if (own == order.end()) return "folder " + std::string(folder) + " is not in the architecture";
  if (other > own) return std::string(target_folder) + " is listed below " + std::string(folder);
  return std::nullopt;
}

std::optional<std::string> CheckThirdParty(string_view file, string_view target) {
  for (const Home& home : Homes()) {
    const bool suffix = home.prefix.starts_with('*');
    const bool hit =
        suffix ? target.ends_with(home.prefix.substr(1)) : target.starts_with(home.prefix);
    if (!hit) continue;
    if (Contains(home.folders, FolderOf(file))) return std::nullopt;
    std::string rule = std::string(home.prefix) + " belongs to";
    for (const string_view folder : home.folders) rule.append(" ").append(folder);
    return home.folders.empty() ? std::string(home.prefix) + " belongs nowhere" : rule;
  }
  return std::nullopt;
}

std::optional<std::string> CheckInclude(string_view file, string_view target, bool quoted) {
  if (target.starts_with(".")) return "includes start at the root";
  if (OrderOf(SideOf(target)) || SideOf(target) == "tests") {
    return CheckProjectInclude(file, target);
  }
  if (quoted && target.find('/') == string_view::npos) return "includes start at the root";
  return CheckThirdParty(file, target);
}

// The text between the first pair of delimiters at the start of an #include line.
std::optional<std::pair<string_view, bool>> ParseInclude(string_view line) {
  const auto skip = [&line] {
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
  };
  skip();
  if (!line.starts_with("#")) return std::nullopt;
  line.remove_prefix(1);
  skip();
  if (!line.starts_with("include")) return std::nullopt;
  line.remove_prefix(string_view("include").size());
  skip();
  if (line.empty() || (line[0] != '"' && line[0] != '<')) return std::nullopt;
  const bool quoted = line[0] == '"';
  const auto end = line.find(quoted ? '"' : '>', 1);
  if (end == string_view::npos) return std::nullopt;
  return std::pair(line.substr(1, end - 1), quoted);
}

// The module of `import ... from 'x'`, `import 'x'`, `export ... from "x"` or `import('x')`.
std::optional<string_view> ParseImport(string_view line) {
  auto at = line.find("from ");
  const bool statement = line.find("import") != string_view::npos || line.starts_with("export") ||
                         line.starts_with("}");
  if (!statement) return std::nullopt;
  if (at == string_view::npos) at = line.find("import");
  if (at == string_view::npos) return std::nullopt;
  const auto open = line.find_first_of("'\"", at);
  if (open == string_view::npos) return std::nullopt;
  const auto close = line.find(line[open], open + 1);
  if (close == string_view::npos) return std::nullopt;
  return line.substr(open + 1, close - open - 1);
}

std::optional<std::string> CheckImport(string_view file, string_view target) {
  namespace fs = std::filesystem;
  const string_view area = FolderOf(file.substr(string_view("web/").size()));  // src/session
  if (target.starts_with(".")) {
    const fs::path full = (fs::path(file).parent_path() / target).lexically_normal();
    if (full.generic_string().starts_with("deploy/models/")) return std::nullopt;  // data
    if (!full.generic_string().starts_with("web/")) return "web sees proto alone";
    return std::nullopt;
  }
  const bool pure = area == "src/session" || area == "src/geometry" || area == "src/transport";
  const bool three = target == "three" || target.starts_with("three/");
  if (pure && three && !file.ends_with("geometry/axes.ts")) {
    return "web/" + std::string(area) + " knows no three.js";
  }
  return std::nullopt;
}

bool IsCpp(string_view file) {
  return file.ends_with(".hpp") || file.ends_with(".cpp") || file.ends_with(".h");
}

struct Scan {
  int includes = 0;
  std::vector<Violation> violations;
};

Scan ScanFile(string_view file, string_view text) {
  Scan scan;
  int number = 0;
  const bool cpp = IsCpp(file);
  for (std::size_t begin = 0; begin < text.size();) {
    const auto end = std::min(text.find('\n', begin), text.size());
    const string_view line = text.substr(begin, end - begin);
    begin = end + 1;
    ++number;
    string_view target;
    std::optional<std::string> rule;
    if (cpp) {
      const auto include = ParseInclude(line);
      if (!include) continue;
      target = include->first;
      rule = CheckInclude(file, target, include->second);
    } else {
      const auto import = ParseImport(line);
      if (!import) continue;
      target = *import;
      rule = CheckImport(file, target);
    }
    ++scan.includes;
    if (rule) scan.violations.push_back({std::string(file), number, std::string(target), *rule});
  }
  return scan;
}

}  // namespace

std::vector<std::string> ProjectIncludes(string_view text) {
  std::vector<std::string> includes;
  for (std::size_t begin = 0; begin < text.size();) {
    const auto end = std::min(text.find('\n', begin), text.size());
    const auto include = ParseInclude(text.substr(begin, end - begin));
    begin = end + 1;
    if (include && OrderOf(SideOf(include->first))) includes.emplace_back(include->first);
  }
  return includes;
}

std::vector<std::string> FoldersOfTheRules() {
  std::vector<std::string> folders;
  for (const char* side : {"server", "client", "shared"}) {
    const std::span<const string_view> order = *OrderOf(side);
    for (const string_view name : order) {
      folders.push_back(std::string(side).append("/").append(name));
    }
  }
  for (const Restriction& each : Restrictions()) {
    folders.insert(folders.end(), each.may_see.begin(), each.may_see.end());
  }
  for (const Home& home : Homes()) {
    folders.insert(folders.end(), home.folders.begin(), home.folders.end());
  }
  return folders;
}

std::vector<Violation> CheckFile(string_view file, string_view text) {
  return ScanFile(file, text).violations;
}

TreeReport CheckTree(const std::filesystem::path& root) {
  TreeReport report;
  for (const char* top : {"shared", "server", "client", "examples/cpp", "web/src"}) {
    if (!std::filesystem::exists(root / top)) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / top)) {
      const std::string file = std::filesystem::relative(entry.path(), root).generic_string();
      const bool source = IsCpp(file) || file.ends_with(".ts") || file.ends_with(".tsx");
      if (!entry.is_regular_file() || !source) continue;
      std::ifstream in(entry.path(), std::ios::binary);
      std::stringstream text;
      text << in.rdbuf();
      Scan scan = ScanFile(file, text.str());
      ++report.files;
      report.includes += scan.includes;
      std::move(scan.violations.begin(), scan.violations.end(),
                std::back_inserter(report.violations));
    }
  }
  return report;
}

}  // namespace saccade::lint
