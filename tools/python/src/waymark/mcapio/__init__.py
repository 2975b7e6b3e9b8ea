# SPDX-License-Identifier: Apache-2.0
"""MCAP files: what is written and read, by subject."""
