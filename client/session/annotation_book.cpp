#include "client/session/annotation_book.hpp"

#include <algorithm>
#include <utility>

namespace saccade::session {

void AnnotationBook::Apply(const net::AnnotationChange& change) {
  if (change.full) known_.clear();
  for (const Annotation& annotation : change.upserted) {
    known_[annotation.id] = annotation;
    gone_.erase(annotation.id);
  }
  for (const net::AnchorUpdate& update : change.anchors) {
    const auto known = known_.find(update.id);
    if (known != known_.end()) known->second.anchor = update.anchor;
  }
  for (const std::string& id : change.removed_ids) {
    known_.erase(id);
    leaving_.erase(id);
    gone_.insert(id);
  }
}

void AnnotationBook::Put(const Annotation& annotation) {
  if (!gone_.contains(annotation.id)) known_[annotation.id] = annotation;
}

void AnnotationBook::Hide(const std::string& id) { leaving_.insert(id); }
void AnnotationBook::Show(const std::string& id) { leaving_.erase(id); }

void AnnotationBook::PreviewTurn(const std::string& id, const Eigen::Quaterniond& turn) {
  turned_[id] = turn;
}
void AnnotationBook::EndPreview(const std::string& id) { turned_.erase(id); }

void AnnotationBook::AddPending(Annotation guess) {
  const std::string id = guess.id;
  pending_[id] = std::move(guess);
}
void AnnotationBook::RemovePending(const std::string& request_id) { pending_.erase(request_id); }

std::vector<Annotation> AnnotationBook::List() const {
  std::vector<Annotation> list;
  for (const auto& [id, annotation] : known_) {
    if (leaving_.contains(id)) continue;
    list.push_back(annotation);
    const auto turned = turned_.find(id);
    if (turned != turned_.end()) list.back().world_from_mark = turned->second;
  }
  std::sort(list.begin(), list.end(), CreatedBefore);
  return list;
}

std::vector<Annotation> AnnotationBook::Pending() const {
  std::vector<Annotation> list;
  for (const auto& [id, annotation] : pending_) list.push_back(annotation);
  return list;
}

const Annotation* AnnotationBook::Find(const std::string& id) const {
  const auto known = known_.find(id);
  return known == known_.end() || leaving_.contains(id) ? nullptr : &known->second;
}

}  // namespace saccade::session
