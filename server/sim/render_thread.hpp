#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <thread>

namespace saccade {

/// One thread that runs what it is given, in order: an OpenGL context belongs to a thread.
class RenderThread {
 public:
  RenderThread() : thread_([this](std::stop_token stop) { Loop(stop); }) {}

  /// Runs `work` there; the future holds what it returns. Work left over at the end is dropped, and
  /// its future broken.
  template <typename Work>
  auto Submit(Work work) -> std::future<decltype(work())> {
    auto task = std::make_shared<std::packaged_task<decltype(work())()>>(std::move(work));
    auto future = task->get_future();
    {
      const std::lock_guard lock(mutex_);
      queue_.emplace_back([task] { (*task)(); });
    }
    wake_.notify_one();
    return future;
  }

 private:
  void Loop(std::stop_token stop) {
    while (true) {
      std::function<void()> work;
      {
        std::unique_lock lock(mutex_);
        if (!wake_.wait(lock, stop, [this] { return !queue_.empty(); })) return;
        work = std::move(queue_.front());
        queue_.pop_front();
      }
      work();
    }
  }

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<std::function<void()>> queue_;
  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace saccade
