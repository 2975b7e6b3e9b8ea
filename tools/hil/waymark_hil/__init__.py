# SPDX-License-Identifier: Apache-2.0
"""Hardware in the loop (`waymark hil`): a recording played into a target's own interfaces, judged at the desk (docs/hil.md).
Processes and files alone: Python's standard library and PyYAML."""


class HilError(Exception):
    """What a user can correct."""
