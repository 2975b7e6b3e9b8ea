# SPDX-License-Identifier: Apache-2.0
"""MCAP files and ROS bags as recordings."""
