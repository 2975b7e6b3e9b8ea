# SPDX-License-Identifier: Apache-2.0
"""`waymark vda5050`: a run's position and the maps of its building for a fleet manager, by VDA 5050 version 2.1.0 over MQTT."""
