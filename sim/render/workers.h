// SPDX-License-Identifier: Apache-2.0
// Threads that share out the rows of a picture. What a row becomes doesn't depend on who makes it.
#pragma once

#include <functional>
#include <memory>

namespace wm::render {

class Workers {
 public:
  explicit Workers(int threads);  // 0: as many as the machine has; 1: the caller alone
  ~Workers();
  int count() const;
  // Calls work(begin, end, worker) for pieces of [0, rows) until all are done; the caller works too. worker < count().
  void run(int rows, int piece, const std::function<void(int begin, int end, int worker)> &work);

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace wm::render
