"""How a landing is made short where it is not what a test looks at."""

from __future__ import annotations

SWIFT_LANDING = {
    'landing.braking_time': 0.1,
    'landing.descent_time': 0.8,
    'landing.settle_time': 0.05,
}
"""For controller and bridge: down by themselves in a second where the default takes 2.4."""
