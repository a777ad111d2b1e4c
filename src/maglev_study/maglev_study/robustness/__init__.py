"""How a controller does on many machines: drawn, flown, and what became of them on one page.

``campaign`` does it all; any one machine can be drawn alone, by the campaign's seed and its number.
"""

from __future__ import annotations

from maglev_study.robustness.fleet import campaign as campaign
