# SPDX-License-Identifier: Apache-2.0
"""The fleet bench: many drives at once (`waymark batch`), what a change did to them (`waymark compare`), and what black
boxes hold (`waymark mine`). Processes and files alone: Python's standard library and PyYAML (docs/fleet.md)."""
