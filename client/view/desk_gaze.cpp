// What clicks and keys do to the head.
#include <absl/strings/str_cat.h>

#include "client/tools/words.hpp"
#include "client/view/desk.hpp"

namespace saccade::view {

std::string Desk::WhyNoHead() const {
  if (!session().link.live()) return "No connection to the server.";
  if (tools::HasHead(session())) return "";
  return "This camera is fixed to the wearer: there is no head to turn. Ask the wearer to look "
         "there.";
}

void Desk::RunHead(tools::Action action, Timestamp now_ns) {
  if (action == tools::Action::kFast) {
    state_.fast = !state_.fast;
    return;
  }
  const std::string why = WhyNoHead();
  if (!why.empty()) return state_.Refuse("head", why, now_ns);
  switch (action) {
    case tools::Action::kStop:
      return pilot_.Run(&net::Connection::StopFixating, Tell("head"));
    case tools::Action::kHome:
      return pilot_.Run(&net::Connection::Home, Tell("head"));
    case tools::Action::kLevel:
      return pilot_.Run(&net::Connection::KeepHorizon, Tell("head"));
    case tools::Action::kExplore:
      return pilot_.Run(&net::Connection::Explore, Tell("head"));
    default:
      return pilot_.Toggle(Tell("head"));
  }
}

void Desk::Look(const tools::Landing& landing, const Where& where, Timestamp now_ns) {
  if (where == "video" && state_.still && !same_map()) {
    return state_.Refuse(where, "Not turned: the map has changed since this picture.", now_ns);
  }
  GazeTarget target = GazePoint{landing.point_in_world};
  if (const auto* feature = std::get_if<FeatureTarget>(&landing.target)) {
    target = GazeFeature{feature->feature_id};
  }
  Fixate(target, landing.point_in_world, where, now_ns);
}

void Desk::LookAtMark(const std::string& id, const Where& where, Timestamp now_ns) {
  const Annotation* annotation = session().annotations.Find(id);
  if (annotation == nullptr) return;
  if (!annotation->anchor.place_known) {
    return state_.Refuse(where, "Not turned: the place of this mark is not known.", now_ns);
  }
  Fixate(GazeAnnotation{id}, annotation->anchor.point_in_world, where, now_ns);
}

void Desk::Fixate(const GazeTarget& target, const Eigen::Vector3d& point, const Where& where,
                  Timestamp now_ns) {
  const std::string why = WhyNoHead();
  if (!why.empty()) return state_.Refuse(where, why, now_ns);
  state_.asked_in_world = point;
  pilot_.Fixate(
      target, state_.fast,
      [this, tell = Tell(where, "Not turned: ")](const absl::StatusOr<std::string>& done) {
        state_.asked_in_world.reset();
        tell(done);
      });
}

}  // namespace saccade::view
