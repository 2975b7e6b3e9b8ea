# SPDX-License-Identifier: Apache-2.0
"""The mistake in a recording's or a configuration's files that explains a drive: `waymark causes`, which `waymark check` starts."""
