#include "client/cli/map_commands.hpp"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/cli/commands.hpp"
#include "client/cli/text.hpp"
#include "client/cli/waiting_commands.hpp"
#include "shared/io/regular_file.hpp"

namespace saccade::cli {
namespace {

constexpr std::size_t kMostBytes = std::size_t{256} << 20;  // what a server takes

/// By the beginning of its id, or by a name that only one has.
absl::StatusOr<std::string> MapId(const std::string& which, net::Connection& connection) {
  const absl::StatusOr<std::vector<net::StoredMapFacts>> all = connection.ListMaps();
  if (!all.ok()) return all.status();
  std::vector<std::string> ids;
  for (const net::StoredMapFacts& map : *all) {
    if (map.id == which) return which;
    if (map.name == which || absl::StartsWith(map.id, which)) ids.push_back(map.id);
  }
  if (ids.size() == 1) return ids.front();
  return absl::NotFoundError(
      ids.empty()
          ? absl::StrCat("there is no map ", which, "; `saccade maps list` says which there are")
          : absl::StrCat(ids.size(), " maps are meant by ", which,
                         "; give more of the id that `saccade maps list` shows"));
}

absl::Status RunList(const Options& options, net::Connection& connection) {
  const absl::StatusOr<std::vector<net::StoredMapFacts>> all = connection.ListMaps();
  if (!all.ok()) return all.status();
  if (options.json) {
    nlohmann::json list = nlohmann::json::array();
    for (const net::StoredMapFacts& map : *all) {
      list.push_back({{"id", map.id},
                      {"name", map.name},
                      {"world", map.world},
                      {"saved_unix_s", map.saved_unix_s},
                      {"metric", map.metric},
                      {"landmarks", map.landmarks},
                      {"places", map.places},
                      {"width", map.width},
                      {"height", map.height},
                      {"bytes", map.bytes}});
    }
    std::cout << Dump(list, 2) << "\n";
    return absl::OkStatus();
  }
  std::vector<std::vector<std::string>> rows = {
      {"id", "name", "saved", "landmarks", "places", "scale", "size"}};
  for (const net::StoredMapFacts& map : *all) {
    rows.push_back({map.id, map.name.empty() ? "(kept by itself)" : map.name,
                    TimeText(map.saved_unix_s), absl::StrCat(map.landmarks),
                    absl::StrCat(map.places), map.metric ? "metres" : "arbitrary",
                    absl::StrFormat("%.1f MB", 1e-6 * static_cast<double>(map.bytes))});
  }
  std::cout << (all->empty() ? "no maps are kept yet\n" : Table(rows));
  return absl::OkStatus();
}

absl::Status RunSave(const Options& options, net::Connection& connection) {
  const absl::StatusOr<std::string> id = connection.SaveMap(options.map_name);
  if (!id.ok()) return id.status();
  if (options.json) {
    std::cout << Dump({{"id", *id}, {"name", options.map_name}}) << "\n";
  } else {
    std::cout << "saved '" << options.map_name << "' as " << *id << "\n";
  }
  return absl::OkStatus();
}

absl::Status RunExport(const Options& options, net::Connection& connection) {
  const absl::StatusOr<std::string> id = MapId(options.id, connection);
  if (!id.ok()) return id.status();
  const absl::StatusOr<std::string> file = connection.ExportMapFile(*id);
  if (!file.ok()) return file.status();
  if (absl::Status written = WriteFile(options.out, *file); !written.ok()) return written;
  if (options.json) {
    std::cout << Dump({{"id", *id}, {"out", options.out}, {"bytes", file->size()}}) << "\n";
  } else {
    std::cout << options.out << ": the map " << *id << ", "
              << absl::StrFormat("%.1f MB", 1e-6 * static_cast<double>(file->size())) << "\n";
  }
  return absl::OkStatus();
}

absl::Status RunImport(const Options& options, net::Connection& connection) {
  const absl::StatusOr<std::string> file = ReadRegularFile(options.map_file, kMostBytes, "a map");
  if (!file.ok()) return file.status();
  const absl::StatusOr<net::StoredMapFacts> map = connection.ImportMapFile(*file);
  if (!map.ok()) return map.status();
  if (options.json) {
    std::cout << Dump({{"id", map->id}, {"name", map->name}, {"landmarks", map->landmarks}})
              << "\n";
  } else {
    std::cout << "took in the map " << map->id << (map->name.empty() ? "" : " '" + map->name + "'")
              << "; `saccade maps load` looks for it\n";
  }
  return absl::OkStatus();
}

}  // namespace

void AddMaps(CLI::App& app, Options& options) {
  CLI::App* maps = app.add_subcommand("maps", "Maps on the server's disk, to come back to");
  maps->require_subcommand(1);
  maps->add_subcommand("list", "Which there are, newest first");
  CLI::App* save = maps->add_subcommand("save", "Keep a copy of the map as it is now");
  save->add_option("name", options.map_name, "For people")->required();
  CLI::App* load = maps->add_subcommand(
      "load", "Look for another map in the pictures that come; this one is kept");
  load->add_option("id", options.id, "Its id, the beginning of it, or its name")->required();
  CLI::App* out = maps->add_subcommand("export", "Write the file of one, to keep it elsewhere");
  out->add_option("id", options.id, "Its id, the beginning of it, or its name")->required();
  out->add_option("--out", options.out, "The file to write: bench.map")->required();
  maps->add_subcommand("import", "Take such a file in; it keeps its id")
      ->add_option("file", options.map_file, "Written by `saccade maps export`, or a copy of one")
      ->required();
  CLI::App* remove = maps->add_subcommand("delete", "Remove one from the disk");
  remove->add_option("id", options.id, "Its id, the beginning of it, or its name")->required();
}

absl::Status RunMaps(const Options& options, net::Connection& connection) {
  if (options.command == Command::kMapsList) return RunList(options, connection);
  if (options.command == Command::kMapsSave) return RunSave(options, connection);
  if (options.command == Command::kMapsExport) return RunExport(options, connection);
  if (options.command == Command::kMapsImport) return RunImport(options, connection);
  const absl::StatusOr<std::string> id = MapId(options.id, connection);
  if (!id.ok()) return id.status();
  const bool load = options.command == Command::kMapsLoad;
  const absl::Status done = load ? connection.LoadMap(*id) : connection.DeleteMap(*id);
  if (!done.ok()) return done;
  if (options.json) {
    std::cout << Dump({{load ? "looked_for" : "deleted", *id}}) << "\n";
  } else {
    std::cout << (load ? "map " : "deleted ") << *id << (load ? " is looked for\n" : "\n");
  }
  return absl::OkStatus();
}

}  // namespace saccade::cli
