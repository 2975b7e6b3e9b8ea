// SPDX-License-Identifier: Apache-2.0
// The best candidates of a search that are not neighbours of a better one, the best first.
#ifndef WAYMARK_ESTIMATOR_RELOCALIZE_SHORTLIST_HPP
#define WAYMARK_ESTIMATOR_RELOCALIZE_SHORTLIST_HPP

namespace wm {

// A candidate has is_near(other) and is_better(other).
template <class Candidate, int kCapacity>
struct shortlist {
  Candidate best[kCapacity];
  int count;

  void clear() { count = 0; }
  void offer(const Candidate &c) {
    int at = 0;
    while (at < count && !best[at].is_near(c)) at++;
    if (at < count && !c.is_better(best[at])) return;
    if (at == count && count == kCapacity && !c.is_better(best[--at])) return;
    if (at == count) count++;
    for (; at > 0 && c.is_better(best[at - 1]); at--) best[at] = best[at - 1];
    best[at] = c;
  }
};

}  // namespace wm

#endif
