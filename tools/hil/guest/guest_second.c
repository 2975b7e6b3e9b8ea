// SPDX-License-Identifier: Apache-2.0 OR GPL-2.0-only
// For a guest of x86-64 whose counter of time (TSC) was announced as faster than it is (tsc_early_khz): gives the local
// APIC's timer the same factor. The kernel measured that timer by another clock, so that it fires early and is set
// again a dozen times before each wake-up. Without this module the guest works, too, and takes the desk twice the time.
//   insmod guest_second.ko factor_permille=2000
#include <linux/clockchips.h>
#include <linux/kprobes.h>
#include <linux/module.h>
#include <linux/percpu.h>

static unsigned int factor_permille = 1000;
module_param(factor_permille, uint, 0444);

// Address of a symbol that is not exported: where a probe of it would be.
static void *address_of(const char *name) {
  struct kprobe probe = {.symbol_name = name};
  void *address;
  if (register_kprobe(&probe) < 0) return NULL;
  address = probe.addr;
  unregister_kprobe(&probe);
  return address;
}

static int __init second_init(void) {
  unsigned long (*lookup)(const char *) = address_of("kallsyms_lookup_name");
  int (*update)(struct clock_event_device *, u32) = lookup ? (void *)lookup("clockevents_update_freq") : NULL;
  struct clock_event_device __percpu *timers = lookup ? (void *)lookup("lapic_events") : NULL;
  struct clock_event_device *timer;
  unsigned long flags;
  u64 hz;
  if (!update || !timers || factor_permille < 1000) return -ENODEV;
  timer = per_cpu_ptr(timers, 0);
  // mult / 2^shift is ticks a nanosecond.
  hz = ((u64)timer->mult * NSEC_PER_SEC) >> timer->shift;
  hz = div_u64(hz * factor_permille, 1000);
  local_irq_save(flags);
  update(timer, (u32)hz);
  local_irq_restore(flags);
  pr_info("guest_second: the APIC timer has %llu ticks a second\n", hz);
  return 0;
}
module_init(second_init);
MODULE_LICENSE("GPL");
