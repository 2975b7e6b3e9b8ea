// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_KEEP_BEST_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_KEEP_BEST_HPP

namespace wm {

// A list of the best `Most` places, the best first (by .score), one of those that same(a.pose, b.pose) calls one.
// Offers it one more; of equal scores the earlier stays.
template <int Most, class Place, class Same>
void keep_best(Place (&list)[Most], int *count, const Place &offered, Same same) {
  if (*count == Most && offered.score <= list[Most - 1].score) return;
  int at = *count;
  for (int i = 0; i < *count; i++)
    if (same(list[i].pose, offered.pose)) {
      if (list[i].score >= offered.score) return;
      at = i;
      break;
    }
  if (at == *count) {
    if (*count < Most)
      ++*count;
    else
      at = Most - 1;
  }
  for (; at > 0 && list[at - 1].score < offered.score; at--) list[at] = list[at - 1];
  list[at] = offered;
}

}  // namespace wm

#endif
