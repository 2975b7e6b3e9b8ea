# SPDX-License-Identifier: Apache-2.0
wm_test(config_parse SOURCES config_parse.c config_registry.c USES wm_config)
