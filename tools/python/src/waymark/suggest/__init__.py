# SPDX-License-Identifier: Apache-2.0
"""Noises and priors that make the observations of a run more likely."""
