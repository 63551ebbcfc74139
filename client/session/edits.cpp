#include "client/session/edits.hpp"

#include <utility>

namespace saccade::session {

void Edits::Ask(Session::Request request, const Done& done) {
  if (absl::Status asked = session_.Ask(std::move(request)); !asked.ok()) done(asked);
}

void Edits::Place(Placement placement, Done done) {
  placement.draft.request_id = net::RandomUuid();
  const std::string request_id = placement.draft.request_id;
  Annotation guess;
  guess.id = request_id;
  guess.shape = placement.draft.shape;
  guess.text = placement.draft.text;
  guess.size_m = placement.draft.size_m;
  guess.color_rgba = placement.draft.color_rgba;
  guess.ink_offset_m = placement.draft.ink_offset_m;
  guess.picture = placement.draft.picture;
  if (placement.guess_in_world) {
    guess.anchor.point_in_world = *placement.guess_in_world;
    guess.anchor.state = AnchorState::kPaused;  // drawn hollow: not answered yet
    session_.state().annotations.AddPending(std::move(guess));
  }
  const auto end = [this, request_id, done](const absl::StatusOr<std::string>& id) {
    session_.state().annotations.RemovePending(request_id);
    done(id);
  };
  Ask(
      [placement = std::move(placement), end](net::Connection& connection) -> Session::Answer {
        absl::StatusOr<Annotation> placed =
            connection.CreateAnnotation(placement.draft, placement.edit_group);
        if (placement.later && absl::IsNotFound(placed.status())) {
          AnnotationDraft again = placement.draft;
          again.target = *placement.later;
          placed = connection.CreateAnnotation(again, placement.edit_group);
        }
        return [placed, end](State& state) {
          if (!placed.ok()) return end(placed.status());
          state.annotations.Put(*placed);
          end(placed->id);
        };
      },
      end);
}

void Edits::Update(AnnotationPatch patch, Done done, const std::string& edit_group) {
  Ask(
      [patch = std::move(patch), done, edit_group](net::Connection& connection) -> Session::Answer {
        return [changed = connection.UpdateAnnotation(patch, edit_group), done](State& state) {
          if (!changed.ok()) return done(changed.status());
          state.annotations.Put(*changed);
          done(changed->id);
        };
      },
      done);
}

void Edits::Remove(const std::string& id, Done done, const std::string& edit_group) {
  session_.state().annotations.Hide(id);
  const auto end = [this, id, done](const absl::StatusOr<std::string>& told) {
    if (!told.ok()) session_.state().annotations.Show(id);
    done(told);
  };
  Ask(
      [id, end, edit_group](net::Connection& connection) -> Session::Answer {
        return [id, removed = connection.DeleteAnnotation(id, edit_group), end](State& /*state*/) {
          end(removed.ok() ? absl::StatusOr<std::string>(id) : removed);
        };
      },
      end);
}

void Edits::Tick(const std::string& id, std::uint32_t index, bool tick, Done done) {
  Ask(
      [id, index, tick, done](net::Connection& connection) -> Session::Answer {
        return [ticked = connection.TickCheckItem(id, index, tick), done](State& state) {
          if (!ticked.ok()) return done(ticked.status());
          state.annotations.Put(*ticked);
          done(ticked->id);
        };
      },
      done);
}

void Edits::Say(const std::string& text, const std::string& annotation_id, Done done) {
  Ask(
      [text, annotation_id, done](net::Connection& connection) -> Session::Answer {
        return [said = connection.Say(text, annotation_id), done](State& state) {
          if (!said.ok()) return done(said.status());
          state.chat.Add({*said});
          done(absl::StatusOr<std::string>(""));
        };
      },
      done);
}

void Edits::FetchPicture(const std::string& id,
                         std::function<void(const absl::StatusOr<Picture>&)> done) {
  const absl::Status asked =
      session_.Ask([id, done](net::Connection& connection) -> Session::Answer {
        return [picture = connection.GetPicture(id), done](State& /*state*/) { done(picture); };
      });
  if (!asked.ok()) done(asked);
}

void Edits::AskForWords(absl::StatusOr<std::string> (net::Connection::*call)(), Done done) {
  Ask(
      [call, done](net::Connection& connection) -> Session::Answer {
        return [words = (connection.*call)(), done](State& /*state*/) { done(words); };
      },
      done);
}

void Edits::Undo(Done done) { AskForWords(&net::Connection::Undo, std::move(done)); }
void Edits::Redo(Done done) { AskForWords(&net::Connection::Redo, std::move(done)); }

void Edits::ResetMap(Done done) {
  Ask(
      [done](net::Connection& connection) -> Session::Answer {
        return [reset = connection.ResetMap(), done](State& /*state*/) {
          done(reset.ok() ? absl::StatusOr<std::string>("map reset") : reset.status());
        };
      },
      done);
}

void Edits::Point(net::PointerWord word, Done done) {
  Ask(
      [word = std::move(word), done](net::Connection& connection) -> Session::Answer {
        return [told = connection.Point(word), done](State& /*state*/) {
          done(told.ok() ? absl::StatusOr<std::string>("") : told);
        };
      },
      done);
}

void Edits::FetchStill(FrameId frame_id, net::VideoView view,
                       std::function<void(const absl::StatusOr<net::Still>&)> done) {
  const absl::Status asked =
      session_.Ask([frame_id, view, done](net::Connection& connection) -> Session::Answer {
        return
            [still = connection.GetFrame(frame_id, view), done](State& /*state*/) { done(still); };
      });
  if (!asked.ok()) done(asked);
}

}  // namespace saccade::session
