// SPDX-License-Identifier: Apache-2.0
// The program's lines as entries of systemd's journal with fields, where standard error is the journal; else on
// standard error as before. Source: the journal's native protocol, systemd.io/JOURNAL_NATIVE_PROTOCOL: stable, without
// libsystemd.
#ifndef WAYMARK_CLI_JOURNAL_H
#define WAYMARK_CLI_JOURNAL_H

#include "findings/findings.h"

typedef enum journal_level { JOURNAL_ERROR = 3, JOURNAL_WARNING = 4, JOURNAL_NOTICE = 5 } journal_level;  // syslog(3)

// "START: LINE". In the journal also PRIORITY, WAYMARK_ABOUT (what the line begins with: "can:can0"), and of a finding
// WAYMARK_FINDING (its identifier) and WAYMARK_FIX. Notices and warnings beyond 2 a second, after the first 200, are
// left out there; the next one has their number as WAYMARK_LEFT_OUT. From any thread; may wait for the disk.
void journal_line(journal_level level, const char *start, const char *line);
// The findings of a run at its end: entries as above, or the table of wm_findings_print on standard error.
void journal_findings(const wm_findings *findings);

#endif
