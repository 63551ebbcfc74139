#include "client/session/scene_book.hpp"

#include <algorithm>
#include <utility>

namespace saccade::session {

void SceneBook::Apply(const net::SceneChange& change) {
  light_ = change.light;
  const bool light_alone = !change.full && change.revision == scene_.revision;
  if (light_alone) return;
  std::vector<SceneObject>& objects = scene_.objects;
  if (change.full) objects.clear();  // models are what their ids say: they stay
  std::erase_if(objects, [&change](const SceneObject& one) {
    const auto& gone = change.removed_ids;
    return std::find(gone.begin(), gone.end(), one.id) != gone.end();
  });
  for (const SceneObject& object : change.upserted) {
    const auto old =
        std::find_if(objects.begin(), objects.end(),
                     [&object](const SceneObject& one) { return one.id == object.id; });
    if (old == objects.end()) {
      objects.push_back(object);
    } else {
      *old = object;
    }
  }
  scene_.revision = change.revision;
  ++version_;
}

void SceneBook::Add(std::shared_ptr<const SceneModel> model) {
  if (scene_.Model(model->id) != nullptr) return;
  scene_.models.push_back(std::move(model));
  ++version_;
}

}  // namespace saccade::session
