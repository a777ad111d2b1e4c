"""The fault campaign: the real bridge on emulated boards, every fault in every phase, judged."""
