# SPDX-License-Identifier: Apache-2.0
"""What the grounds share."""


def said(function):
    """What a call gives, or that it raises."""
    try:
        return str(function())
    except Exception as error:  # noqa: BLE001  (that it raises is what is measured)
        return f"raises {type(error).__name__}"
