// SPDX-License-Identifier: Apache-2.0
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cli/commands.h"
#include "waymark/devices.h"
#include "waymark/text.h"

static const char kHelp[] =
    "waymark localizes a robot on its own computer.\n"
    "\n"
    "usage: waymark COMMAND ...\n"
    "\n"
    "  run       localize live, on the robot's devices or a recording at real speed; poses over LCM\n"
    "  replay    localize from a recording or an event log, as fast as it goes\n"
    "  record    write the data of the robot's devices into a recording\n"
    "  watch     show a run as it goes, in a terminal\n"
    "  check     find mistakes in a configuration and a recording before driving\n"
    "  doctor    find what is wrong with this computer, and how to mend it\n"
    "  stamps    switch the clocks of CAN adapters on, before a run\n"
    "  help      this text; `waymark COMMAND --help` has the options\n"
    "\n"
    "The desk's commands (waymark eval, report, simulate ...) are programs named waymark-COMMAND beside this one.\n"
    "\n"
    "exit code: 0 done, 1 the work failed, 2 usage or configuration\n"
    "\n"
    "example:\n"
    "  waymark replay RECORDING --config config/starry-night-plan.yaml --out out/run\n";

static const struct {
  const char *name;
  int (*run)(int argc, char *const *argv);
} kCommands[] = {{"run", command_run},       {"replay", command_replay}, {"check", command_check},
                 {"record", command_record}, {"watch", command_watch},   {"doctor", command_doctor},
                 {"stamps", command_stamps}};
#define COMMANDS (sizeof kCommands / sizeof kCommands[0])

int main(int argc, char **argv) {
  if (wm_camera_is_process(argc, argv)) return EXIT_DONE;
  const char *command = argc > 1 ? argv[1] : NULL;
  if (!command) {
    (void)fputs(kHelp, stderr);
    return EXIT_USAGE;
  }
  if (strcmp(command, "help") == 0 || strcmp(command, "--help") == 0 || strcmp(command, "-h") == 0) {
    (void)fputs(kHelp, stdout);
    return EXIT_DONE;
  }
  if (strcmp(command, "--version") == 0) {
    (void)puts("waymark " WM_VERSION);
    return EXIT_DONE;
  }
  for (size_t i = 0; i < COMMANDS; i++)
    if (strcmp(command, kCommands[i].name) == 0) return kCommands[i].run(argc - 2, argv + 2);

  run_desk_command(command, argv + 1);
  static const char *const kNames[] = {"run",  "replay",    "record", "watch",    "check", "doctor",
                                       "help", "eval",      "report", "simulate", "diff",  "calibrate",
                                       "map",  "reference", "stamps", NULL};
  const char *nearest = wm_word_nearest(command, kNames);
  if (nearest && strcmp(nearest, command) != 0) {
    (void)fprintf(stderr, "waymark: '%s' is no command; did you mean '%s'? (waymark help lists them)\n", command,
                  nearest);
  } else {
    (void)fprintf(stderr, "waymark: '%s' is no command, and there is no program waymark-%s (waymark help lists them)\n",
                  command, command);
  }
  return EXIT_USAGE;
}
