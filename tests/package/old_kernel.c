// SPDX-License-Identifier: Apache-2.0
// old_kernel PROGRAM ARGUMENTS...: runs PROGRAM where system calls that came after Linux 4.9 are not there (ENOSYS), as
// on the boards' older images. By a seccomp filter of the few numbers; what is left in the kernel's table behind them
// is newer still and refused as a whole. Exit code 77 where the kernel lets no filter be set.
#include <errno.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#if defined(__x86_64__)
#define ARCHITECTURE AUDIT_ARCH_X86_64
#define LAST_OF_4_9 SYS_pkey_free  // 331; statx, 332, is of 4.11
#elif defined(__aarch64__)
#define ARCHITECTURE AUDIT_ARCH_AARCH64
#define LAST_OF_4_9 SYS_pkey_free  // 290; statx is 291
#elif defined(__arm__)
#define ARCHITECTURE AUDIT_ARCH_ARM
#define LAST_OF_4_9 SYS_pkey_free  // 396; statx is 397
#endif
#define ARM_PRIVATE 0x0f0000  // cacheflush, set_tls: old, and far beyond the table

int main(int argc, char **argv) {
  struct sock_filter code[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, arch)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ARCHITECTURE, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
      // Every table has grown at its end alone since: statx, io_pgetevents, rseq, pidfd_*, io_uring_*, clone3,
      // close_range, openat2, faccessat2, epoll_pwait2, futex_waitv, and on 32 bits the calls with 64-bit times.
      BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, ARM_PRIVATE, 1, 0),
      BPF_JUMP(BPF_JMP | BPF_JGT | BPF_K, LAST_OF_4_9, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOSYS),
  };
  struct sock_fprog program = {.len = sizeof code / sizeof code[0], .filter = code};
  if (argc < 2) {
    (void)fprintf(stderr, "usage: old_kernel PROGRAM ARGUMENTS...\n");
    return 2;
  }
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program, 0, 0) != 0) {
    (void)fprintf(stderr, "skipped: no seccomp filter: %s\n", strerror(errno));
    return 77;
  }
  errno = 0;
  if (syscall(LAST_OF_4_9 + 1, 0, 0, 0, 0, 0) != -1 || errno != ENOSYS) {  // statx
    (void)fprintf(stderr, "the filter refuses nothing\n");
    return 1;
  }
  (void)execvp(argv[1], argv + 1);
  (void)fprintf(stderr, "%s: %s\n", argv[1], strerror(errno));
  return 127;
}
