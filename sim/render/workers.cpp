// SPDX-License-Identifier: Apache-2.0
#include "render/workers.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

namespace wm::render {

struct Workers::Data {
  std::vector<std::thread> threads;
  std::mutex mutex;
  std::condition_variable begin, done;
  const std::function<void(int, int, int)> *work = nullptr;
  int rows = 0, piece = 1, next = 0, busy = 0;
  uint64_t round = 0;
  bool stop = false;

  void take_pieces(const std::function<void(int, int, int)> &task, int worker) {
    for (;;) {
      int from;
      {
        std::lock_guard<std::mutex> lock(mutex);
        if (next >= rows) return;
        from = next;
        next += piece;
      }
      task(from, std::min(from + piece, rows), worker);
    }
  }

  void serve(int worker) {
    uint64_t seen = 0;
    for (;;) {
      const std::function<void(int, int, int)> *task;
      {
        std::unique_lock<std::mutex> lock(mutex);
        begin.wait(lock, [&] { return stop || round != seen; });
        if (stop) return;
        seen = round;
        task = work;
      }
      take_pieces(*task, worker);
      std::lock_guard<std::mutex> lock(mutex);
      if (--busy == 0) done.notify_one();
    }
  }
};

Workers::Workers(int threads) : data_(std::make_unique<Data>()) {
  const int n = threads > 0 ? threads : static_cast<int>(std::max(std::thread::hardware_concurrency(), 1u));
  for (int i = 1; i < n; i++) data_->threads.emplace_back([this, i] { data_->serve(i); });
}

Workers::~Workers() {
  {
    std::lock_guard<std::mutex> lock(data_->mutex);
    data_->stop = true;
  }
  data_->begin.notify_all();
  for (std::thread &t : data_->threads) t.join();
}

int Workers::count() const { return static_cast<int>(data_->threads.size()) + 1; }

void Workers::run(int rows, int piece, const std::function<void(int, int, int)> &work) {
  {
    std::lock_guard<std::mutex> lock(data_->mutex);
    data_->work = &work;
    data_->rows = rows, data_->piece = std::max(piece, 1), data_->next = 0;
    data_->busy = static_cast<int>(data_->threads.size());
    data_->round++;
  }
  data_->begin.notify_all();
  data_->take_pieces(work, 0);
  std::unique_lock<std::mutex> lock(data_->mutex);
  data_->done.wait(lock, [&] { return data_->busy == 0; });
}

}  // namespace wm::render
