// SPDX-License-Identifier: Apache-2.0
// Says what a configuration may have.
#include <stdio.h>

#include "cli/commands.h"
#include "cli/options.h"

static const char kHelp[] =
    "usage: waymark config --schema\n"
    "\n"
    "Prints the JSON schema of a configuration: keys, types, limits, defaults and meanings, from the tables by which\n"
    "this program reads it. An editor completes and checks robot.yaml by it (docs/config.md).\n"
    "\n"
    "  --schema   the schema, on standard output\n"
    "\n"
    "example:\n"
    "  waymark config --schema > waymark.schema.json\n";

int command_config(int argc, char *const *argv) {
  int help = 0, schema = 0;
  const char *words[1];
  const option options[] = {
      {"--schema", OPTION_FLAG, &schema}, {"--help", OPTION_FLAG, &help}, {"-h", OPTION_FLAG, &help}};
  wm_error err = {0};
  size_t count;
  if (options_parse(argc, argv, options, sizeof options / sizeof options[0], words, 0, &count, &err) != WM_OK)
    return complain(&err);
  if (help) {
    (void)fputs(kHelp, stdout);
    return EXIT_DONE;
  }
  if (!schema) {
    (void)fprintf(stderr, "waymark: config needs --schema\n\n%s", kHelp);
    return EXIT_USAGE;
  }
  wm_config_schema(stdout);
  return fflush(stdout) == 0 && !ferror(stdout) ? EXIT_DONE : EXIT_WORK_FAILED;
}
