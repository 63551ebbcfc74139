#include "client/session/thing_edits.hpp"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <utility>

namespace saccade::session {
namespace {

constexpr std::size_t kMostSteps = 50;

}  // namespace

std::string PlacedWords(const net::PlacedThing& placed) {
  const std::string touched = placed.stop
                                  ? absl::StrFormat("touches %s after %.3f m, ",
                                                    placed.stop->object_name, placed.stop->moved_m)
                                  : "";
  return absl::StrCat(placed.object.name, " ", touched, "rests on ", placed.support.object_name);
}

void ThingEdits::Ask(Session::Request request, const Done& done) {
  if (absl::Status asked = session_.Ask(std::move(request)); !asked.ok()) done(asked);
}

void ThingEdits::Remember(Step step) {
  steps_.push_back(std::move(step));
  if (steps_.size() > kMostSteps) steps_.erase(steps_.begin());
}

/// A thing that came back has another id: earlier changes of it mean that one.
void ThingEdits::Renumber(const std::string& old, const std::string& id) {
  for (Step& step : steps_) {
    if (step.added_id == old) step.added_id = id;
    if (step.was && step.was->id == old) step.was->id = id;
  }
}

std::optional<SceneObject> ThingEdits::Known(const std::string& id) const {
  const SceneObject* known = session_.state().scene.scene().Find(id);
  if (known == nullptr) return std::nullopt;
  return *known;
}

void ThingEdits::Placed(const absl::StatusOr<net::PlacedThing>& placed,
                        const std::optional<SceneObject>& was, const Done& done) {
  if (!placed.ok()) return done(placed.status());
  Remember(was ? Step{was, ""} : Step{std::nullopt, placed->object.id});
  done(Told{placed->object.id, PlacedWords(*placed)});
}

void ThingEdits::Place(const SceneObject& draft, const std::optional<Eigen::Vector3d>& push,
                       Done done) {
  const std::optional<SceneObject> was = Known(draft.id);
  Ask(
      [this, draft, push, was, done](net::Connection& connection) -> Session::Answer {
        return [this, placed = connection.PlaceThing(draft, push), was, done](State& /*state*/) {
          Placed(placed, was, done);
        };
      },
      done);
}

void ThingEdits::PlaceModel(const std::string& name, const std::string& file, SceneObject draft,
                            Done done) {
  Ask(
      [this, name, file, draft = std::move(draft),
       done](net::Connection& connection) mutable -> Session::Answer {
        const absl::StatusOr<net::ModelFacts> model = connection.UploadModel(name, file);
        if (!model.ok()) {
          return [status = model.status(), done](State& /*state*/) { done(status); };
        }
        draft.model = model->id;
        return [this, placed = connection.PlaceThing(draft, std::nullopt), done](State& /*state*/) {
          Placed(placed, std::nullopt, done);
        };
      },
      done);
}

void ThingEdits::TellPut(const absl::StatusOr<SceneObject>& put,
                         const std::optional<SceneObject>& was, const Said& said,
                         const Done& done) {
  if (!put.ok()) return done(put.status());
  Remember(was ? Step{was, ""} : Step{std::nullopt, put->id});
  done(Told{put->id, said(*put)});
}

void ThingEdits::Put(const SceneObject& draft, Said said, Done done, bool further) {
  Ask(
      [this, draft, was = Known(draft.id), said = std::move(said), done,
       further](net::Connection& connection) -> Session::Answer {
        return
            [this, put = connection.PutThing(draft), was, said, done, further](State& /*state*/) {
              if (!put.ok() || !further) return TellPut(put, was, said, done);
              done(Told{put->id, said(*put)});
            };
      },
      done);
}

void ThingEdits::PutModel(const std::string& name, const std::string& file, SceneObject draft,
                          Said said, Done done) {
  Ask(
      [this, name, file, draft = std::move(draft), said = std::move(said),
       done](net::Connection& connection) mutable -> Session::Answer {
        const absl::StatusOr<net::ModelFacts> model = connection.UploadModel(name, file);
        if (!model.ok()) {
          return [status = model.status(), done](State& /*state*/) { done(status); };
        }
        draft.model = model->id;
        return [this, put = connection.PutThing(draft), said, done](State& /*state*/) {
          TellPut(put, std::nullopt, said, done);
        };
      },
      done);
}

void ThingEdits::TryRegister(
    const std::string& id, const std::vector<net::PointPair>& pairs, bool with_scale,
    std::function<void(const absl::StatusOr<net::RegisteredThing>&)> done) {
  Ask(
      [id, pairs, with_scale, done](net::Connection& connection) -> Session::Answer {
        return [found = connection.RegisterThing(id, pairs, with_scale, false),
                done](State& /*state*/) { done(found); };
      },
      [done](const absl::StatusOr<Told>& refused) { done(refused.status()); });
}

void ThingEdits::Register(const std::string& id, const std::vector<net::PointPair>& pairs,
                          bool with_scale, Done done) {
  Ask(
      [this, id, pairs, with_scale, was = Known(id),
       done](net::Connection& connection) -> Session::Answer {
        return [this, found = connection.RegisterThing(id, pairs, with_scale, true), was,
                done](State& /*state*/) {
          if (!found.ok()) return done(found.status());
          if (was) Remember({was, ""});
          done(Told{found->object.id,
                    absl::StrFormat("%s registered: %.1f mm", found->object.name, found->rms_mm)});
        };
      },
      done);
}

void ThingEdits::Remove(const std::string& id, Done done) {
  const SceneObject* known = session_.state().scene.scene().Find(id);
  if (known == nullptr) return done(absl::NotFoundError("it is not there any more"));
  Ask(
      [this, was = *known, done](net::Connection& connection) -> Session::Answer {
        return [this, removed = connection.RemoveThing(was.id), was, done](State& /*state*/) {
          if (!removed.ok()) return done(removed);
          Remember({was, ""});
          done(Told{"", absl::StrCat(was.name, " deleted; Undo brings it back")});
        };
      },
      done);
}

void ThingEdits::Undo(Done done) {
  if (steps_.empty()) {
    return done(absl::FailedPreconditionError("there is nothing of yours to take back"));
  }
  const Step step = std::move(steps_.back());
  steps_.pop_back();
  if (!step.was) {
    return Ask(
        [id = step.added_id, done](net::Connection& connection) -> Session::Answer {
          return [removed = connection.RemoveThing(id), done](State& /*state*/) {
            if (!removed.ok()) return done(removed);
            done(Told{"", "removed again"});
          };
        },
        done);
  }
  SceneObject back = *step.was;
  const bool there = session_.state().scene.scene().Find(back.id) != nullptr;
  if (!there) back.id.clear();
  Ask(
      [this, back, old = step.was->id, there,
       done](net::Connection& connection) -> Session::Answer {
        return [this, put = connection.PutThing(back), old, there, done](State& /*state*/) {
          if (!put.ok()) return done(put.status());
          Renumber(old, put->id);
          done(Told{put->id, absl::StrCat(put->name, there ? " is where it was" : " is back")});
        };
      },
      done);
}

}  // namespace saccade::session
