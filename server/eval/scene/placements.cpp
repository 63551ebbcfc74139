#include "server/eval/scene/placements.hpp"

#include <absl/status/statusor.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <random>

#include "server/eval/output_file.hpp"
#include "server/eval/scene/placement_judge.hpp"
#include "server/eval/scene/random_room.hpp"
#include "server/scene/placement.hpp"
#include "shared/models/shapes.hpp"

namespace saccade {
namespace {

constexpr double kLimit_m = 1e-3;   // T34
constexpr double kJudged_m = 2e-3;  // how far gaps are looked for
constexpr int kPathSteps = 100;

struct World {
  std::vector<TriangleMesh> meshes;
  std::vector<bool> solids;
  std::vector<Obstacle> obstacles;
  std::size_t triangles = 0;
};

World MakeWorld(const std::vector<NamedMesh>& things) {
  World world;
  for (const NamedMesh& thing : things) {
    TriangleMesh in_world;
    Append(thing.mesh, thing.world_from_mesh, 1.0, in_world);
    world.triangles += in_world.triangles.size();
    world.solids.push_back(thing.name != "room");
    world.obstacles.push_back({thing.name, thing.name, in_world});
    world.meshes.push_back(std::move(in_world));
  }
  return world;
}

PlacementRequest RandomRequest(const Rigid3& world_from_room, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  PlacementRequest request;
  Eigen::Quaterniond turn(Eigen::AngleAxisd(M_PI * unit(random), Eigen::Vector3d::UnitY()));
  if (random() % 3 == 0) {  // one in three is let go on a slant
    turn = turn * Eigen::AngleAxisd(unit(random), Eigen::Vector3d::UnitX()) *
           Eigen::AngleAxisd(unit(random), Eigen::Vector3d::UnitZ());
  }
  const Eigen::Vector3d at(1.4 * unit(random), -1.0 - 0.9 * unit(random), 1.4 * unit(random));
  request.world_from_body = world_from_room * Rigid3{turn, at};
  if (random() % 5 != 0) {
    const double angle = M_PI * unit(random);
    request.push = Eigen::Vector3d(std::cos(angle), 0.1 * unit(random), std::sin(angle));
    if (random() % 2 == 0) request.hand_m = 2.0 + 2.0 * unit(random);
  }
  return request;
}

/// It went from one to the other without cutting anything.
bool PathFree(const PlacementJudge& judge, const TriangleMesh& mesh, const Rigid3& from,
              const Rigid3& to) {
  for (int step = 0; step <= kPathSteps; ++step) {
    const double share = static_cast<double>(step) / kPathSteps;
    const Rigid3 pose{from.rotation, (1 - share) * from.translation + share * to.translation};
    if (judge.Cuts(mesh, pose)) return false;
  }
  return true;
}

/// Whether the judge sees the reason of a refusal too.
bool RightlyRefused(const PlacementJudge& judge, const TriangleMesh& mesh,
                    const PlacementRequest& request, const std::string& why) {
  if (absl::StrContains(why, "inside of")) return judge.Cuts(mesh, request.world_from_body);
  return false;  // every room has walls and a floor
}

std::string Line(std::uint64_t index, const PlacementOutcome& one) {
  if (!one.refused.empty()) {
    return absl::StrFormat("%d,%s,%d,%d,,,,,,,,%s,%s,\n", index, one.thing, one.thing_triangles,
                           one.room_triangles, one.refused_rightly ? "refused" : "refused_wrongly",
                           absl::StrCat("\"", one.refused, "\""));
  }
  return absl::StrFormat("%d,%s,%d,%d,%d,%s,%s,%.4f,%.4f,%.4f,%d,placed,,%.2f\n", index, one.thing,
                         one.thing_triangles, one.room_triangles, one.pushed, one.stop, one.support,
                         1e3 * one.push_gap_m, 1e3 * one.rest_gap_m, 1e3 * one.distance_m,
                         one.path_free, 1e3 * one.slid_m);
}

void Count(const PlacementOutcome& one, PlacementsSummary& summary) {
  if (!one.refused.empty()) {
    ++summary.refused;
    summary.wrongly_refused += one.refused_rightly ? 0 : 1;
    return;
  }
  ++summary.placed;
  summary.pushed += one.pushed ? 1 : 0;
  summary.slid += one.slid_m > 0 ? 1 : 0;
  summary.concave += one.thing != "box" && one.thing != "ball" ? 1 : 0;
  const double least = std::min(one.rest_gap_m, one.pushed ? one.push_gap_m : 0.0);
  const double most = std::max(one.rest_gap_m, one.pushed ? one.push_gap_m : 0.0);
  summary.worst_penetration_m = std::max(summary.worst_penetration_m, -least);
  summary.worst_gap_m = std::max(summary.worst_gap_m, most);
  if (-least >= kLimit_m || most >= kLimit_m || !one.path_free) ++summary.failed;
}

}  // namespace

PlacementOutcome RunPlacement(std::uint64_t seed, std::uint64_t index) {
  std::seed_seq seeds{seed, index};
  std::mt19937_64 random(seeds);
  const std::vector<NamedMesh> things = RandomRoom(random);
  const World world = MakeWorld(things);
  const NamedMesh thing = RandomThing(random);
  const PlacementRequest request = RandomRequest(things[0].world_from_mesh, random);
  PlacementOutcome outcome;
  outcome.thing = thing.name;
  outcome.thing_triangles = thing.mesh.triangles.size();
  outcome.room_triangles = world.triangles;
  const PlacementJudge judge(world.meshes, world.solids);

  const CollisionScene scene(world.obstacles);
  const absl::StatusOr<Placement> placed = Place(scene, Body(thing.mesh), request);
  if (!placed.ok()) {
    outcome.refused = std::string(placed.status().message());
    outcome.refused_rightly = RightlyRefused(judge, thing.mesh, request, outcome.refused);
    return outcome;
  }
  outcome.support = placed->support.obstacle_name;
  outcome.rest_gap_m = judge.Gap(thing.mesh, placed->world_from_body, request.gravity, kJudged_m);
  outcome.distance_m = judge.Distance(thing.mesh, placed->world_from_body, 0.01);
  const Rigid3& before = placed->world_from_pushed.value_or(placed->world_from_start);
  outcome.path_free = PathFree(judge, thing.mesh, before, placed->world_from_body);
  if (placed->world_from_pushed) {
    outcome.pushed = true;
    outcome.stop = placed->stop->obstacle_name;
    const Eigen::Vector3d level =
        (*request.push - request.push->dot(request.gravity) * request.gravity).normalized();
    outcome.push_gap_m = judge.Gap(thing.mesh, placed->world_from_turns[0], level, kJudged_m);
    const std::vector<Rigid3>& turns = placed->world_from_turns;
    Rigid3 from{before.rotation, turns[0].translation - placed->stop->moved_m * level};
    for (const Rigid3& to : turns) {
      outcome.path_free = outcome.path_free && PathFree(judge, thing.mesh, from, to);
      from = to;
    }
    outcome.slid_m = placed->slid_m;
  }
  return outcome;
}

absl::StatusOr<PlacementsSummary> RunPlacements(std::uint64_t seed, int count,
                                                const std::filesystem::path& out,
                                                const std::function<void(int)>& progress) {
  if (absl::Status made = CreateFolder(out); !made.ok()) return made;
  absl::StatusOr<OutputFile> csv = OutputFile::Create(out / "placements.csv");
  if (!csv.ok()) return csv.status();
  csv->Write(
      "index,thing,thing_triangles,room_triangles,pushed,stop,support,push_gap_mm,rest_gap_mm,"
      "distance_mm,path_free,outcome,why,slid_mm\n");
  PlacementsSummary summary;
  for (std::uint64_t index = 0; summary.placed < count; ++index) {
    const PlacementOutcome outcome = RunPlacement(seed, index);
    csv->Write(Line(index, outcome));
    Count(outcome, summary);
    if (outcome.refused.empty() && summary.placed % 100 == 0) progress(summary.placed);
  }
  if (absl::Status written = csv->Close(); !written.ok()) return written;
  const nlohmann::json report = {{"seed", seed},
                                 {"placed", summary.placed},
                                 {"pushed", summary.pushed},
                                 {"slid", summary.slid},
                                 {"concave_things", summary.concave},
                                 {"refused", summary.refused},
                                 {"refused_wrongly", summary.wrongly_refused},
                                 {"worst_penetration_mm", 1e3 * summary.worst_penetration_m},
                                 {"worst_gap_mm", 1e3 * summary.worst_gap_m},
                                 {"limit_mm", 1e3 * kLimit_m},
                                 {"failed", summary.failed}};
  const absl::Status written = WriteFileAtomically(out / "report.json", report.dump(1) + "\n");
  if (!written.ok()) return written;
  return summary;
}

}  // namespace saccade
