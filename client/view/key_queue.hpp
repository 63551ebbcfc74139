#pragma once

#include <deque>
#include <functional>
#include <set>
#include <utility>

namespace saccade::view {

/// Keys and characters between the window and ImGui, which looks once a picture which keys are
/// down: one pressed and let go between two pictures is none to it, and what was typed after Tab
/// goes where the keyboard was before. So a release waits for a picture with the press in it, and
/// so does whatever comes after it.
class KeyQueue {
 public:
  /// `tell` is called at once or from Next(), in order.
  void Key(int key, bool pressed, bool leaves, std::function<void()> tell) {
    Add({key, pressed, leaves, std::move(tell)});
  }
  void Character(std::function<void()> tell) { Add({kNone, false, false, std::move(tell)}); }

  /// A picture with what was told so far was drawn; true if more is told for the next one.
  bool Next() {
    pressed_.clear();
    left_ = false;
    const bool any = !waiting_.empty();
    while (!waiting_.empty() && !MustWait(waiting_.front())) {
      const Event event = std::move(waiting_.front());
      waiting_.pop_front();
      Tell(event);
    }
    return any;
  }

 private:
  static constexpr int kNone = -1;
  struct Event {
    int key = kNone;
    bool pressed = false, leaves = false;  // leaves: the keyboard goes to another field (Tab)
    std::function<void()> tell;
  };

  bool MustWait(const Event& event) const {
    if (event.key == kNone) return left_;
    return !event.pressed && pressed_.contains(event.key);
  }
  void Add(Event event) {
    if (!waiting_.empty() || MustWait(event)) {
      waiting_.push_back(std::move(event));
    } else {
      Tell(event);
    }
  }
  void Tell(const Event& event) {
    if (event.pressed) pressed_.insert(event.key);
    left_ = left_ || (event.pressed && event.leaves);
    event.tell();
  }

  std::deque<Event> waiting_;
  std::set<int> pressed_;  // since the last picture
  bool left_ = false;
};

}  // namespace saccade::view
