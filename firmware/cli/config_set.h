// SPDX-License-Identifier: Apache-2.0
// Another configuration for a robot that runs, on trial (cli/trial.h); its versions.
#ifndef WAYMARK_CLI_CONFIG_SET_H
#define WAYMARK_CLI_CONFIG_SET_H

typedef struct config_set_options {
  const char *config;           // the robot's
  const char *file;             // the other one
  double within_s, good_for_s;  // so long a pose has to be good on end, so long it may take
  unsigned keep;                // versions
  int is_untried;               // takes the file at once
} config_set_options;

// Exit codes. 0: taken. 1: the robot has the configuration before. 2: the file is wrong; no run saw it.
int config_set(const config_set_options *options);
// The same with the newest version in place of options->file.
int config_back(config_set_options *options);
int config_versions(const char *config_path);

#endif
