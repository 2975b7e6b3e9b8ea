// SPDX-License-Identifier: Apache-2.0
// A plugin of qemu-user: counts the instructions that a program of one thread executes, and says so at its end.
// Built by instructions.py. Debian ships no header of the plugin interface (version 1): the few functions are declared
// here.
#include <inttypes.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#define WM_EXPORT __attribute__((visibility("default")))

typedef uint64_t plugin_id;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
void qemu_plugin_register_vcpu_tb_trans_cb(plugin_id id, void (*block)(plugin_id, struct qemu_plugin_tb *));
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *block);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *block, size_t i);
void qemu_plugin_register_vcpu_insn_exec_inline(struct qemu_plugin_insn *one, int operation, void *to, uint64_t value);
void qemu_plugin_register_atexit_cb(plugin_id id, void (*end)(plugin_id, void *), void *data);
WM_EXPORT int qemu_plugin_version = 1;
WM_EXPORT int qemu_plugin_install(plugin_id id, const void *info, int argc, char **argv);

static const int kAdd = 0;  // the only inline operation
static uint64_t instructions;

static void on_block(plugin_id id, struct qemu_plugin_tb *block) {
  (void)id;
  const size_t count = qemu_plugin_tb_n_insns(block);
  for (size_t i = 0; i < count; i++)
    qemu_plugin_register_vcpu_insn_exec_inline(qemu_plugin_tb_get_insn(block, i), kAdd, &instructions, 1);
}

static void on_end(plugin_id id, void *data) {
  (void)id;
  (void)data;
  const char *path = getenv("WM_COUNT_OUT");
  FILE *out = path ? fopen(path, "w") : stderr;
  if (!out) return;
  fprintf(out, "%" PRIu64 "\n", instructions);
  if (path) fclose(out);
}

int qemu_plugin_install(plugin_id id, const void *info, int argc, char **argv) {
  (void)info;
  (void)argc;
  (void)argv;
  qemu_plugin_register_vcpu_tb_trans_cb(id, on_block);
  qemu_plugin_register_atexit_cb(id, on_end, NULL);
  return 0;
}
