// SPDX-License-Identifier: Apache-2.0
// Which libjpeg-turbo decodes here. TurboJPEG has no function that says so: the version is that of the headers, and the
// loaded library is named by its file and its build ID, which is another one for each compilation of it.
#include <elf.h>
#include <inttypes.h>
#include <limits.h>
#include <link.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

#include "waymark/video.h"

#ifndef WM_TURBOJPEG_VERSION
#define WM_TURBOJPEG_VERSION "of unknown version"
#endif
#define BUILD_ID_SHOWN 8  // bytes of usually 20: as many as tell builds apart

typedef struct loaded {
  uintptr_t address;  // of one of its functions
  char file[64], build[2 * BUILD_ID_SHOWN + 1];
} loaded;

static void take_build_id(loaded *self, const uint8_t *notes, size_t size) {
  const size_t head_size = sizeof(ElfW(Nhdr));
  for (size_t at = 0; at + head_size <= size;) {
    ElfW(Nhdr) note;
    memcpy(&note, notes + at, head_size);
    const size_t name = at + head_size, content = name + ((note.n_namesz + 3u) & ~3u);
    if (content + note.n_descsz > size) return;
    if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == sizeof "GNU" &&
        memcmp(notes + name, "GNU", sizeof "GNU") == 0) {
      for (size_t i = 0; i < BUILD_ID_SHOWN && i < note.n_descsz; i++)
        (void)snprintf(&self->build[2 * i], 3, "%02x", notes[content + i]);
      return;
    }
    at = content + ((note.n_descsz + 3u) & ~3u);
  }
}

static int look(struct dl_phdr_info *info, size_t size, void *context) {
  (void)size;
  loaded *self = context;
  int is_it = 0;
  for (int i = 0; i < info->dlpi_phnum; i++) {
    const ElfW(Phdr) *part = &info->dlpi_phdr[i];
    const uintptr_t begin = info->dlpi_addr + part->p_vaddr;
    is_it |= part->p_type == PT_LOAD && self->address >= begin && self->address - begin < part->p_memsz;
  }
  if (!is_it) return 0;
  for (int i = 0; i < info->dlpi_phnum; i++) {
    const ElfW(Phdr) *part = &info->dlpi_phdr[i];
    if (part->p_type == PT_NOTE && !self->build[0])
      take_build_id(self, (const uint8_t *)(info->dlpi_addr + part->p_vaddr), part->p_memsz);
  }
  char path[PATH_MAX];
  const char *whole = realpath(info->dlpi_name, path) ? path : info->dlpi_name;
  const char *slash = strrchr(whole, '/');
  (void)snprintf(self->file, sizeof self->file, "%.63s", slash ? slash + 1 : whole);
  return 1;
}

void wm_video_decoder(char *out, size_t capacity) {
  loaded library = {.address = (uintptr_t)&tjInitDecompress};
  (void)dl_iterate_phdr(look, &library);
  (void)snprintf(out, capacity, "libjpeg-turbo " WM_TURBOJPEG_VERSION " when built, %s (build %s)",
                 library.file[0] ? library.file : "in the program", library.build[0] ? library.build : "unknown");
}
