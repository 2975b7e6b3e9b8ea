// SPDX-License-Identifier: Apache-2.0
// On which floor is the robot? Multiple models [BarShalom2001], one a floor: at a lift the floor may
// change, and each observation is weighed by how well the filter of each floor explains it. Floors that can't be the
// robot's are closed and cost nothing.
#ifndef WAYMARK_ESTIMATOR_FLOORS_FLOOR_BELIEF_HPP
#define WAYMARK_ESTIMATOR_FLOORS_FLOOR_BELIEF_HPP

#include <cstdint>

#include "waymark/setup.h"
#include "waymark/time.h"

namespace wm {

class floor_belief {
 public:
  void begin(int count);                     // any of so many floors, all as likely
  void decide(int floor);                    // this one
  void open(int floor, double probability);  // with so much of the others' probability, at least
  void close(int floor);
  bool is_open(int floor) const { return open_ >> floor & 1u; }
  bool is_decided() const { return (open_ & (open_ - 1)) == 0; }
  uint64_t open_floors() const { return open_; }
  double probability(int floor) const { return p_[floor]; }
  int most_probable() const;
  // One of the floors `among` may have become another one of them, with this rate.
  void change(uint64_t among, double rate_per_s, double dt_s);
  // An observation of `key` by log Bayes factors of "anywhere" against "as expected", one a floor.
  void weigh(wm_time_ns t_ns, int64_t key, const double *log_bayes);

 private:
  struct source {
    int64_t key;
    wm_time_ns t_ns;
    double weight;
  };
  static constexpr int kSources = 16;  // landmarks in view at once
  double weight_of(wm_time_ns t_ns, int64_t key);
  void normalise();

  double p_[WM_FLOORS_MAX];
  uint64_t open_;
  int64_t count_;  // 64 bits: no padding
  source source_[kSources];
  int64_t sources_;
};

}  // namespace wm

#endif
