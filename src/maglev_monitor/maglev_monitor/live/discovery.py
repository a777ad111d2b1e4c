"""Whether the nodes of a run find each other, and what to look at when they do not. No ROS here."""

from __future__ import annotations

from collections.abc import Collection

PATIENCE = 4.0
"""How long the others are looked for in silence [s]."""


class DiscoveryWatch:
    """Keeps whether any other node of the run was ever seen.

    :param domain: the ROS_DOMAIN_ID in use.
    :param namespace: where the nodes of the run are looked for.
    :param now: time on a steady clock [s].
    """

    def __init__(self, domain: int, namespace: str, now: float) -> None:
        self._where = f'on domain {domain}' + (f' in {namespace}' if namespace != '/' else '')
        self._since = now
        self._warned = False
        self.seen = False
        """Whether discovery works: some other node was there."""

    def update(self, others: Collection[str]) -> None:
        """Take the names of the other nodes in the namespace."""
        self.seen = self.seen or bool(others)

    def warning(self, now: float) -> str:
        """What to say of a discovery that seems broken, once; empty otherwise."""
        if self.seen or self._warned or now - self._since < PATIENCE:
            return ''
        self._warned = True
        return self.nobody()

    def nobody(self) -> str:
        """That no node was seen, and why that may be."""
        return (
            f'no node of the run is seen {self._where}. If they run, look at: ROS_DOMAIN_ID and'
            ' namespace (the same for all?), ROS_AUTOMATIC_DISCOVERY_RANGE, the loopback interface'
            ' (up, with multicast? ip link show lo), a VPN or firewall,'
            ' FASTRTPS_DEFAULT_PROFILES_FILE'
        )
