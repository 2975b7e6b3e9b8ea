// SPDX-License-Identifier: Apache-2.0
// Says what a configuration may have, and changes that of a robot that runs.
#include <stdio.h>
#include <string.h>

#include "cli/commands.h"
#include "cli/config_set.h"
#include "cli/options.h"

static const char kHelp[] =
    "usage: waymark config --schema\n"
    "       waymark config set FILE [options]\n"
    "       waymark config back [options]\n"
    "       waymark config versions [--config FILE]\n"
    "\n"
    "set gives a robot that runs another configuration, on trial: a file that is wrong is refused, and the run goes\n"
    "on from its pose. Where that stays good (tracking, or no worse than before) the file takes the place of the\n"
    "robot's, which is kept as a version. Else, or where this program or the computer is switched off meanwhile, the\n"
    "robot has the configuration before. back does so with the newest version. Files that a configuration names are\n"
    "its folder's.\n"
    "\n"
    "  --schema       prints the JSON schema of a configuration: keys, types, limits, defaults and meanings, from the\n"
    "                 tables by which this program reads it; an editor completes and checks robot.yaml by it\n"
    "  --config FILE  the robot's (default /etc/waymark/robot.yaml)\n"
    "  --good-for S   so long the pose has to be good on end (default 10)\n"
    "  --within S     so long that may take (default 30)\n"
    "  --keep N       versions, in FILE.versions (default 20)\n"
    "  --untried      takes the file at once, where no run is there to try it\n"
    "\n"
    "exit code: 0 the robot has the new one, 1 it has the one before, 2 the file is wrong\n"
    "\n"
    "examples:\n"
    "  waymark config --schema > waymark.schema.json\n"
    "  waymark config set robot-new.yaml --within 60\n";

int command_config(int argc, char *const *argv) {
  int help = 0, schema = 0;
  uint64_t keep = 20;
  config_set_options set = {.config = "/etc/waymark/robot.yaml", .within_s = 30, .good_for_s = 10};
  const char *words[2] = {"", NULL};
  const option options[] = {{"--schema", OPTION_FLAG, &schema},      {"--config", OPTION_TEXT, &set.config},
                            {"--within", OPTION_F64, &set.within_s}, {"--good-for", OPTION_F64, &set.good_for_s},
                            {"--keep", OPTION_U64, &keep},           {"--untried", OPTION_FLAG, &set.is_untried},
                            {"--help", OPTION_FLAG, &help},          {"-h", OPTION_FLAG, &help}};
  wm_error err = {0};
  size_t count;
  if (options_parse(argc, argv, options, sizeof options / sizeof options[0], words, 2, &count, &err) != WM_OK)
    return complain(&err);
  if (help) {
    (void)fputs(kHelp, stdout);
    return EXIT_DONE;
  }
  set.file = words[1];
  set.keep = keep < 1000 ? (unsigned)keep : 1000;
  if (set.within_s < set.good_for_s) set.within_s = set.good_for_s;
  if (count == 0 && schema) {
    wm_config_schema(stdout);
    return fflush(stdout) == 0 && !ferror(stdout) ? EXIT_DONE : EXIT_WORK_FAILED;
  }
  if (count == 2 && strcmp(words[0], "set") == 0) return config_set(&set);
  if (count == 1 && strcmp(words[0], "back") == 0) return config_back(&set);
  if (count == 1 && strcmp(words[0], "versions") == 0) return config_versions(set.config);
  (void)fprintf(stderr, "waymark: config needs --schema, set FILE, back or versions\n\n%s", kHelp);
  return EXIT_USAGE;
}
