// SPDX-License-Identifier: Apache-2.0
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <wm_version.h>
#include "cli/commands.h"
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
    "  config    give a robot that runs another configuration, on trial; or print what one may have (JSON schema)\n"
    "  help      this text; `waymark COMMAND --help` has the options\n"
    "\n"
    "at the desk (programs named waymark-COMMAND, beside this one or in PATH):\n";

static const char kHelpEnd[] =
    "\n"
    "exit code: 0 done, 1 the work failed, 2 usage or configuration\n"
    "\n"
    "example:\n"
    "  waymark replay first-drive --config config/robot.yaml --out out/run\n";

// Programs of their own, with the package of each.
static const struct {
  const char *name, *about, *package;
} kDesk[] = {
    {"batch", "replay and judge many recordings on all cores", "waymark-fleet"},
    {"bench", "measure a board: detectors, filters, wake-ups, temperature", "waymark-fleet"},
    {"calibrate", "find a camera's lens and mounting; read calibrations of other programs", "waymark-calibrate"},
    {"causes", "find the mistake in the files that explains a drive", "waymark, of Python (pip)"},
    {"compare", "what a change did to all drives of a batch", "waymark-fleet"},
    {"detect", "run a detector on pictures: what it finds, drawn and as a table", "waymark-tools"},
    {"diff", "compare two runs: what differs, and where the difference begins", "waymark-tools"},
    {"eval", "measure a run against truth, GNSS or labels", "waymark-tools"},
    {"export", "write a run and its recording as one MCAP file", "waymark, of Python (pip)"},
    {"hil", "play recordings into a robot's computer or a guest, and judge its run", "waymark-fleet"},
    {"import", "make a recording of a bag (ROS, MCAP), or a video part of one", "waymark-tools"},
    {"init", "make the configuration of a new robot from what it has", "waymark-tools"},
    {"map", "make, check and survey maps; print markers", "waymark-tools"},
    {"mavlink", "give a run's poses to PX4 or ArduPilot, and a localizer's poses to the run",
     "waymark, of Python (pip)"},
    {"mine", "what black boxes hold, by place and by cause", "waymark-fleet"},
    {"play", "play a recording into CAN, cameras and LCM, with faults", "waymark"},
    {"reference", "smooth a run into a reference trajectory", "waymark-tools"},
    {"report", "show a run as one page", "waymark-tools"},
    {"ros2", "give a run's poses to ROS 2, and its data to the run", "waymark-ros2"},
    {"simulate", "make a recording of a drive with known truth", "waymark-sim"},
    {"suggest", "find noises and priors that fit a run better", "waymark, of Python (pip)"},
    {"vda5050", "give a run's position to a fleet manager (VDA 5050, MQTT), and take maps from it",
     "waymark, of Python (pip)"},
    {"web", "show a run as it goes, as a page for a browser", "waymark"},
};
#define DESK (sizeof kDesk / sizeof kDesk[0])

static const struct {
  const char *name;
  int (*run)(int argc, char *const *argv);
} kCommands[] = {{"run", command_run},       {"replay", command_replay}, {"check", command_check},
                 {"record", command_record}, {"watch", command_watch},   {"doctor", command_doctor},
                 {"stamps", command_stamps}, {"config", command_config}};
#define COMMANDS (sizeof kCommands / sizeof kCommands[0])

static void print_help(FILE *to) {
  (void)fputs(kHelp, to);
  for (size_t i = 0; i < DESK; i++) {
    char missing[48] = "";
    if (!desk_command_is_there(kDesk[i].name))
      (void)snprintf(missing, sizeof missing, " (not installed; package %s)", kDesk[i].package);
    (void)fprintf(to, "  %-9s %s%s\n", kDesk[i].name, kDesk[i].about, missing);
  }
  (void)fputs(kHelpEnd, to);
}

// No such command, and no such program.
static int unknown(const char *command) {
  const char *names[COMMANDS + DESK + 2] = {"help"};
  for (size_t i = 0; i < COMMANDS; i++) names[1 + i] = kCommands[i].name;
  for (size_t i = 0; i < DESK; i++) {
    names[1 + COMMANDS + i] = kDesk[i].name;
    if (strcmp(command, kDesk[i].name) != 0) continue;
    (void)fprintf(stderr,
                  "waymark: '%s' needs the program waymark-%s, which is not installed here; package %s has it\n",
                  command, command, kDesk[i].package);
    return EXIT_USAGE;
  }
  const char *nearest = wm_word_nearest(command, names);
  if (nearest)
    (void)fprintf(stderr, "waymark: '%s' is not a command; did you mean '%s'? (waymark help lists them)\n", command,
                  nearest);
  else
    (void)fprintf(stderr,
                  "waymark: '%s' is not a command, and there is no program waymark-%s (waymark help lists them)\n",
                  command, command);
  return EXIT_USAGE;
}

int main(int argc, char **argv) {
  const char *command = argc > 1 ? argv[1] : NULL;
  if (!command) {
    print_help(stderr);
    return EXIT_USAGE;
  }
  if (strcmp(command, "help") == 0 || strcmp(command, "--help") == 0 || strcmp(command, "-h") == 0) {
    print_help(stdout);
    return EXIT_DONE;
  }
  if (strcmp(command, "--version") == 0) {
    (void)puts("waymark " WM_VERSION);
    return EXIT_DONE;
  }
  for (size_t i = 0; i < COMMANDS; i++)
    if (strcmp(command, kCommands[i].name) == 0) return kCommands[i].run(argc - 2, argv + 2);

  run_desk_command(command, argv + 1);
  return unknown(command);
}
